"""Unfinished outputs of killed commands: the next run removes them, and only them."""

import os
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from command_line import succeed

from explore.base.errors import ResultsError
from explore.results.store.outputs import new_output, new_output_folder

HOLD = """import sys, time
from pathlib import Path
from explore.results.store.outputs import new_output, new_output_folder
path = Path(sys.argv[2])
with (new_output if sys.argv[1] == "file" else new_output_folder)(path) as unfinished:
    (unfinished if sys.argv[1] == "file" else unfinished / "part.csv").write_text("half")
    print(unfinished.name, flush=True)
    time.sleep(600)
"""


@pytest.fixture
def hold():
    """Start a process that writes an output and does not end; returns it and the unfinished name."""
    processes = []

    def start(kind, path):
        process = subprocess.Popen([sys.executable, "-c", HOLD, kind, path], stdout=subprocess.PIPE, text=True)
        processes.append(process)
        return process, process.stdout.readline().strip()

    yield start
    for process in processes:
        process.kill()
        process.communicate()


@pytest.mark.parametrize("kind", ["file", "folder"])
def test_only_what_dead_processes_left_is_removed(hold, tmp_path, kind):
    """A living one's is kept, and so is whatever has another name."""
    path, context = (tmp_path / "a.csv", new_output) if kind == "file" else (tmp_path, new_output_folder)
    others = ["a.csv.unfinished-notes", "b.csv.unfinished-01234567", "a.csv.unfinished-012345678", ".unfinished-01"]
    for name in others:
        (tmp_path / name).touch()
    process, unfinished = hold(kind, path)
    alive = sorted([*others, unfinished])

    def write():
        with context(path) as place:
            (place if kind == "file" else place / "part.csv").write_text("whole")

    write()
    assert sorted({p.name for p in tmp_path.iterdir()} - {"a.csv"}) == alive
    process.send_signal(signal.SIGKILL)
    process.wait()
    write()
    assert sorted({p.name for p in tmp_path.iterdir()} - {"a.csv"}) == sorted(others)


def test_a_link_with_the_name_of_an_unfinished_file_is_left_alone(tmp_path):
    (tmp_path / "precious").mkdir()
    link, folder_link = tmp_path / "a.csv.unfinished-01234567", tmp_path / ".unfinished-01234567"
    link.symlink_to(tmp_path / "precious")
    folder_link.symlink_to(tmp_path / "precious")
    with new_output(tmp_path / "a.csv") as unfinished, new_output_folder(tmp_path):
        unfinished.write_text("whole")
    assert link.is_symlink()
    assert folder_link.is_symlink()


def test_an_error_leaves_nothing(tmp_path):
    (tmp_path / "a.csv").write_text("old")

    def write():
        with new_output(tmp_path / "a.csv") as unfinished:
            unfinished.write_text("half")
            raise ResultsError("the disk is full")

    with pytest.raises(ResultsError, match="is full"):
        write()
    assert {p.name: p.read_text() for p in tmp_path.iterdir()} == {"a.csv": "old"}


def test_content_is_durable_before_it_gets_its_name(tmp_path, monkeypatch):
    """Else a power cut may leave an empty file of the new name."""
    events, sync, replace = [], os.fsync, os.rename
    monkeypatch.setattr(os, "fsync", lambda fd: events.append(str(Path(f"/proc/self/fd/{fd}").readlink())) or sync(fd))
    monkeypatch.setattr("pathlib.Path.replace", lambda old, new: events.append("rename") or replace(old, new))
    with new_output(tmp_path / "a.csv") as unfinished:
        unfinished.write_text("whole")
    assert events == [str(unfinished), "rename", str(tmp_path)]


MECHANISM = ["--mechanism", "crank-rocker"]
for _length in ("crank=100", "coupler=1083.4236", "rocker=541.7118", "ground=691.7118"):
    MECHANISM += ["--set", _length]
OUTPUTS = {
    "a.csv": ["rank", "--top", "3"], "b.md": ["rank", "--top", "3"], "c.html": ["report"],
    "d.svg": ["plot", "pareto"], "e.csv": ["simulate", *MECHANISM], "f.toml": ["export", "--design", "7"],
    "g.hdf5": ["export", "--design", "7"], "h.csv": ["show", "--design", "7"],
}  # fmt: skip


@pytest.mark.parametrize("name", OUTPUTS)
def test_every_command_that_writes_a_file_removes_what_was_left(in_results, name):
    (in_results / f"{name}.unfinished-01234567").write_text("half")
    succeed(*OUTPUTS[name], "-o", name)
    assert [p.name for p in in_results.glob(f"{name}*")] == [name]


@pytest.mark.parametrize("kind", ["file", "folder"])
def test_runs_at_once_do_not_take_each_other_for_abandoned(tmp_path, kind):
    """A run that has made its unfinished file, but not locked it yet, looks like a killed one."""

    def write(number):
        for _ in range(100):
            if kind == "file":
                with new_output(tmp_path / "out.csv") as unfinished:
                    unfinished.write_text(f"{number}" * 99)
            else:
                with new_output_folder(tmp_path) as folder:
                    (folder / "part.csv").write_text("all")

    with ThreadPoolExecutor(8) as pool:
        for each in [pool.submit(write, number) for number in range(8)]:
            each.result()
    assert [path.name for path in tmp_path.iterdir()] == (["out.csv"] if kind == "file" else [])
