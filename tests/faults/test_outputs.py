"""Files that commands write beside results: on a full disk, and after kills and power cuts at every call."""

import itertools
import random
from contextlib import nullcontext
from pathlib import Path

import pytest
from command_line import call, succeed
from served import serving
from studies import crank_rockers

import explore
from explore.synthesis.tasks.task_files import task_starter
from faults.disks import take_all_but
from faults.replay import Disk, boundaries, ends_at, put_down, read_trace

STUDY = (
    crank_rockers((80, 160), (1000, 1100))
    + """\
[sampling]
method = "sobol"
count = 64
[rank]
metrics = ["cv", "transmission_angle_min:max"]
"""
)
COVERAGE = crank_rockers([90, 100, 110], (1000, 1100, 11))
MECHANISM = ["simulate", "--mechanism", "crank-rocker"]
for _length in ("crank=100", "coupler=1083.4236", "rocker=541.7118", "ground=691.7118"):
    MECHANISM += ["--set", _length]
EXPORT, CERTIFY = ["export", "{results}", "--design", "0"], ["certify", "{results}", "--design", "0"]
TOLERANCE = ["tolerance", "{results}", "--design", "0", "--tolerance", "0.1", "--draws", "100"]
#: Commands by the file that they write.
WRITERS = {
    "rank.csv": ["rank", "{results}"],
    "report.html": ["report", "{results}"],
    "pareto.pdf": ["plot", "pareto", "{results}"],
    "motion.gif": MECHANISM,
    "design.toml": EXPORT,
    "design.hdf5": EXPORT,
    "proved.csv": CERTIFY,
    "packed.h5": ["pack", "{results}"],
    "tolerance.h5": TOLERANCE,
    "refined.h5": ["refine", "{results}", "--evaluations", "256"],
}
MORE_WRITERS = {
    "rank.json": ["rank", "{results}"],
    "rank.md": ["rank", "{results}"],
    "rank.parquet": ["rank", "{results}"],
    "pareto.svg": ["plot", "pareto", "{results}"],
    "pareto.png": ["plot", "pareto", "{results}"],
    "motion.csv": MECHANISM,
    "motion.svg": MECHANISM,
    "design.dxf": EXPORT,
    "design.svg": EXPORT,
    "design.csv": EXPORT,
    "design.mat": EXPORT,
    "shown.csv": ["show", "{results}", "--design", "0"],
    "proved.json": CERTIFY,
    "polished.csv": ["polish", "{results}", "--design", "0"],
    "tolerance.csv": TOLERANCE,
    "tolerance.png": TOLERANCE,
    "sensitivity.csv": ["sensitivity", "{results}"],
}
#: Those that start from a file or from nothing; without an ending they write a folder.
STARTERS = {
    "swept.h5": ["sweep", "{folder}/study.toml"],
    "found.h5": ["synthesize", "{folder}/task.toml"],
    "atlas.h5": ["atlas", "--count", "64"],
    "coverage.png": ["coverage", "{folder}/coverage.toml"],
    "tuned.csv": ["tune", "{results}", "--design", "0", "--parameter", "crank", "--metric", "cv"],
    "precision": ["precision", "tiny_swing"],
    "stability": ["stability", "gears"],
    "fetched.h5": ["submit", "{folder}/study.toml", "--server", "{url}", "--token-file", "{token}", "--name", "{job}"],
}
SLOW = (*MORE_WRITERS, "atlas.h5", "coverage.png", "precision", "stability", "fetched.h5")
NUMBERS = itertools.count()


@pytest.fixture(scope="session")
def swept(tmp_path_factory):
    """Results of a small study with ranges, not to be changed."""
    folder = tmp_path_factory.mktemp("swept")
    (folder / "study.toml").write_text(STUDY)
    (folder / "task.toml").write_text(task_starter("dead-positions"))
    (folder / "coverage.toml").write_text(COVERAGE)
    return explore.sweep(explore.load_study(folder / "study.toml"), folder / "study.h5").path


def order(words, results, target, service=None):
    """The words of a command with its output."""
    names = {"results": results, "folder": Path(results).parent, "job": f"job-{next(NUMBERS)}"}
    if service is not None:
        names |= {"url": service.url, "token": service.folder / "token"}
    return [*(word.format(**names) for word in words), "-o", str(target)]


def contents(folder):
    """All files of a folder, by path."""
    return {str(file.relative_to(folder)): file.read_bytes() for file in folder.rglob("*") if file.is_file()}


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.slow) if name in SLOW else name
        for name in WRITERS | MORE_WRITERS | STARTERS
    ],
)
def test_a_full_disk_leaves_the_earlier_file(swept, small_disk, tmp_path, name):
    """Full from the beginning, and full in the middle of the file."""
    place, words = tmp_path / "roomy", (WRITERS | MORE_WRITERS | STARTERS)[name]
    place.mkdir()
    with serving(tmp_path / "served") if "{url}" in words else nullcontext() as service:
        succeed(*order(words, swept, place / name, service), seconds=300)
        size = sum(map(len, contents(place).values()))
        for free in (0, size // 2):
            target = small_disk / name
            if target.suffix not in ("", ".h5", ".toml"):  # of which none is replaced
                target.write_text("earlier")
            other = take_all_but(small_disk, free // 4096 * 4096)
            before = contents(small_disk)
            code, out, err = call(*order(words, swept, target, service), seconds=300)
            assert code == 1, (free, out, err)
            (line,) = [line for line in err.splitlines() if line.startswith("error: ")]
            assert "Traceback" not in err
            assert str(target) in line
            assert "free" in line
            left = contents(small_disk)
            assert {name: content for name, content in left.items() if not name.endswith(".log.jsonl")} == before
            other.unlink()


@pytest.mark.parametrize("cuts", [0, 3], ids=["kills", "power cuts"])
@pytest.mark.parametrize("trials", [12, pytest.param(None, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", ["proved.csv", "design.csv", "design.hdf5", "design.svg"])
def test_kill_or_power_cut_at_every_call(server, memory, swept, fresh, figures, request, name, trials, cuts):
    """The earlier file is there or the new one, whole; what else is left the next run removes."""
    folder, trace = memory / request.node.name, memory / f"{request.node.name}.trace"
    folder.mkdir()
    words = (WRITERS | MORE_WRITERS)[name]
    (folder / name).write_text("earlier")
    environment = {"FAULT_FOLDER": str(folder), "FAULT_TRACE": str(trace)}
    writing = server.write(folder / name, arguments=order(words, swept, folder / name), environment=environment)
    assert writing.code == 0, writing.errors
    whole, calls = (folder / name).read_bytes(), read_trace(trace)
    assert whole != b"earlier"
    disk, chance, moments = Disk(folder, {str(folder / name): b"earlier"}), random.Random(6), boundaries(calls)
    chosen = {*moments[-6:], *chance.sample(moments, min(trials or len(moments), len(moments)))}
    found = set()
    for state in ends_at(disk, calls, chosen, *[chance] * cuts):
        target = fresh() / name
        put_down(state, folder, target.parent)
        figures["trials"] += 1
        found.add(target.read_bytes())
    assert found == {b"earlier", whole}
    assert call(*order(words, swept, target), seconds=240)[0] == 0  # beside what the last state left
    assert {file.name: file.read_bytes() for file in target.parent.iterdir()} == {name: whole}


@pytest.mark.parametrize("name", ["proved.csv", "rank.csv"])
def test_the_next_run_removes_what_a_killed_one_left(server, memory, swept, fresh, figures, name):
    """Real kills, before each of the calls that write the file."""
    words = WRITERS[name]
    whole = None
    for at in range(1, 40):
        folder = fresh()
        (folder / name).write_text("earlier")
        environment = {"FAULT_FOLDER": str(folder), "FAULT_ACTION": "kill", "FAULT_AT": str(at)}
        arguments = order(words, swept, folder / name)
        code = server.write(folder / name, arguments=arguments, environment=environment).code
        left = {file.name for file in folder.iterdir()}
        assert server.write(folder / name, arguments=arguments).code == 0
        whole = whole or (folder / name).read_bytes()
        assert {file.name: file.read_bytes() for file in folder.iterdir()} == {name: whole}
        if code == 0:
            break
        figures["trials"] += 1
        figures["left"] += len(left) > 1
    assert code == 0, "the last run was not killed"
    assert figures["left"] > 0
