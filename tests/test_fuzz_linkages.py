"""Mutated tables of linkages: each is read, or refused with a line for each mistake, and nothing else happens."""

import itertools
import os
import re
import shutil
import tomllib
from pathlib import Path

import pytest
from changed_trees import change, text_of
from command_line import call
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from linkage_cases import REFERENCE, curved_shaper, loaded_shaper

from explore.base.errors import ConfigError
from explore.mechanisms.linkages.steps import find_steps
from explore.studies.config.linkage import Linkage, load_linkage
from explore.studies.config.study_file import linkage_starter, linkage_starters

TABLES = [case["table"] for case in REFERENCE["cases"]] + [linkage_starter(name) for name in linkage_starters()]
TABLES += [loaded_shaper().to_toml(), curved_shaper().to_toml()]

NAMES = [
    "O", "A", "B", "C", "D", "S", "crank", "rod", "rocker", "frame", "guide", "ram", "r", "speed", "pi", "sin", "x_y",
]  # fmt: skip
KEYS = st.sampled_from([
    *NAMES, "driver", "travel", "output", "frame", "links", "slots", "slides", "branch", "sketch", "parameters",
    "range", "copies", "b", "pin", "link", "along", "direction", "radius", "angle", "crank_angle", "unit", "default",
    "min", "max", "meaning", "loads", "masses", "gravity", "forces", "torques", "springs", "dampers", "mass",
    "centroid", "inertia", "torque", "against", "between", "rate", "rest", "", "a b", "ω", "x" * 200, "a\nb", "A_x",
    "mean", "curves", "cut", "over", "points", "file", "shape", "point",
])  # fmt: skip
TEXTS = [
    *NAMES, "r + 1", "2 * r", "r / 0", "1 / 0", "(r", "r ** r ** -r", "9 ** 9 ** 9 ** 9", "sin(r)", "sin(r) + r",
    "atan2(r, 1)", "-" * 900 + "r", "(" * 400, "min(r, 1, 2)", "sqrt(-1)", "left of A C", "right of C A", "far", "near",
    "positive", "negative", "left", "60 rpm", "1 mm", "\x00", "a\nb", "x" * 3000, "__import__('os')", "1e308 * r",
]  # fmt: skip
SCALARS = st.one_of(
    st.floats(), st.floats(-100, 100), st.integers(-3, 10), st.integers(-(2**70), 2**70), st.booleans(),
    st.text(max_size=8), st.sampled_from(TEXTS), st.dates(),
)  # fmt: skip
TREES = st.recursive(SCALARS, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(KEYS, inner, max_size=3))


@st.composite
def mutated_tables(draw):
    """One of the tables with a few of its values, at any depth, replaced, removed or given another key."""
    return change(draw, tomllib.loads(draw(st.sampled_from(TABLES))), KEYS, TREES, most=4)


@pytest.mark.parametrize("examples", [200, pytest.param(5000, marks=pytest.mark.slow)])
def test_mutated_tables_are_read_or_refused(tmp_path, examples):
    # Examples of the same seed on every run.
    @settings(derandomize=True, max_examples=examples, deadline=None, suppress_health_check=list(HealthCheck))
    @given(mutated_tables())
    def check(table):
        assert_read_or_refused(tmp_path / "table.toml", table)

    check()


def assert_read_or_refused(file, table):
    """A linkage that its own content describes, or a line for each mistake that begins with the file and a line."""
    file.write_text(text_of(table), encoding="utf-8", errors="surrogatepass")
    problems, linkage = [], None
    try:
        linkage = load_linkage(file)
    except ConfigError as error:
        problems = error.problems
    for problem in problems:
        assert problem.startswith(f"{file}:")
        assert re.fullmatch(r"\d+: .+| and [\d,]+ more| .+", problem.removeprefix(f"{file}:"))
        assert len(problem) < 1500
    assert len(set(problems)) == len(problems)
    if linkage is not None:
        assert Linkage(linkage.content) == linkage
        assert Linkage(tomllib.loads(linkage.to_toml())).content == linkage.content
        assert find_steps(linkage.table)


#: Commands on a sweep `r.h5` of a study, with options that make them quick; `{parameter}` is one that varies.
COMMANDS = (
    "show r.h5", "show r.h5 --design 0", "show r.h5 --json", "rank r.h5", "rank r.h5 --nearest 3", "plot pareto r.h5",
    "plot motion r.h5", "plot mechanism r.h5", "plot map r.h5", "plot parallel r.h5", "report r.h5",
    "simulate study.toml", "mechanisms study.toml", "export r.h5 -o a.toml -o a.csv -o a.svg -o a.dxf",
    "tolerance r.h5 --tolerance 0.1 --draws 8", "sensitivity r.h5 --evaluations 20000", "certify r.h5",
    "certify r.h5 --json", "refine r.h5 --evaluations 32", "polish r.h5", "tune r.h5 --parameter {parameter}",
    "verify r.h5", "pack r.h5",
)  # fmt: skip


#: Values that most tables are read with, and others.
PLAUSIBLE = st.one_of(
    st.integers(-150, 150), st.floats(-150, 150), st.lists(st.integers(-150, 150), min_size=2, max_size=2), TREES
)


@st.composite
def mutated_studies(draw):
    """The study of a classic with few designs whose table is changed."""
    sections = tomllib.loads(linkage_starter(draw(st.sampled_from(list(linkage_starters())))))
    change(draw, sections["linkage"], KEYS, PLAUSIBLE, most=2)
    sections["sampling"] |= {"count": 16}
    return sections


@pytest.mark.parametrize("examples", [60, pytest.param(5000, marks=pytest.mark.slow)])
def test_every_command_on_mutated_tables_does_its_work_or_says_why_not(tmp_path, monkeypatch, examples):
    """Three commands, in turns, on each of the tables that can be swept."""
    monkeypatch.chdir(tmp_path)
    commands, done = itertools.cycle(COMMANDS), set()

    # Examples of the same seed on every run; a smaller example would take minutes to find.
    @settings(
        derandomize=True, max_examples=examples, deadline=None, suppress_health_check=list(HealthCheck),
        phases=(Phase.generate,),
    )  # fmt: skip
    @given(mutated_studies())
    def check(study):
        shutil.rmtree(tmp_path)
        tmp_path.mkdir()
        os.chdir(tmp_path)
        Path("study.toml").write_text(text_of(study), encoding="utf-8", errors="surrogatepass")
        assert_done_or_refused("sweep study.toml -o r.h5 -q")
        if Path("r.h5").exists():
            varied = next(name for name, value in study["parameters"].items() if isinstance(value, dict))
            for command in itertools.islice(commands, 3):
                if assert_done_or_refused(command.format(parameter=varied)):
                    done.add(command)

    check()
    assert len(done) >= len(COMMANDS) * (0.3 if examples < 100 else 1.0)


def assert_done_or_refused(command):
    """No internal error, a line that says why for each mistake where it fails, and no number that a proof refutes."""
    code, out, err = call(*command.split(), seconds=3600)
    assert code in (0, 1, 2), (command, err)
    assert "should not have happened" not in err, (command, err)
    assert "Traceback" not in err, (command, err)
    assert '"refuted"' not in out, (command, out)
    is_open = code == 1 and command.startswith("certify") and out
    if code and not is_open:
        problems = [line for line in err.splitlines() if line.startswith("error: ")]
        assert problems, (command, err)
        assert len(problems) <= 21, (command, err)
    return code == 0 or is_open
