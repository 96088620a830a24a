"""The types of tasks."""

from explore.base.errors import RequestError
from explore.base.suggest import format_value, suggestion
from explore.synthesis.tasks import dead_positions, dwell, function, motion, path, slider_path
from explore.synthesis.tasks.contract import TaskType

#: Types of tasks in the order in which they are listed; a new one is a line here, and its name in `explore init`.
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
#: Types by other names, after what a user gives.
_ALIASES = {"poses": motion.TYPE, "swing": dead_positions.TYPE}


def task_type(name: object) -> TaskType:
    """The type of a name; `RequestError` if there is none."""
    known = {**TASK_TYPES, **_ALIASES}
    if not isinstance(name, str) or name not in known:
        hint = suggestion(name, known) if isinstance(name, str) else f'write task = "{next(iter(TASK_TYPES))}"'
        raise RequestError(f"unknown task {format_value(name)}; {hint}")
    return known[name]
