"""The types of tasks."""

from explore.synthesis.tasks import dead_positions, dwell, function, motion, path, slider_path

#: The types by name, in the order in which they are listed. A new one is a line here.
TASK_TYPES = {
    each.name: each
    for each in (
        path.TYPE,
        slider_path.TYPE,
        motion.TYPE,
        function.TYPE,
        dead_positions.TYPE,
        dwell.TYPE,
    )
}  # fmt: skip
