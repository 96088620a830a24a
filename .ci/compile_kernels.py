"""Compile what most tests need, in one process: of mechanisms, of the tables of linkages, and of tasks."""

from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory

import explore
from explore.mechanisms.registry import MECHANISMS
from explore.studies.config.study_file import linkage_starter, linkage_starters
from explore.synthesis.tasks.registry import TASK_TYPES
from explore.synthesis.tasks.task_files import task_starter
from explore.testing import check_mechanism

for mechanism in MECHANISMS.values():
    with suppress(AssertionError):  # tests say what is wrong
        check_mechanism(mechanism, designs=2)
with TemporaryDirectory() as folder:
    file = Path(folder) / "text.toml"
    for name in linkage_starters():
        file.write_text(linkage_starter(name), encoding="utf-8")
        explore.sweep(explore.load_study(file), file.with_name(f"{name}.h5"))
    for name in TASK_TYPES:
        file.write_text(task_starter(name), encoding="utf-8")
        explore.synthesize(file, file.with_name(f"task-{name}.h5"))
