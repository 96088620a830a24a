"""Wasteful ends of swept ranges: counts against brute force, and the lines that a sweep prints."""

import json
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from command_line import call, succeed
from hypothesis import example, given, settings
from hypothesis import strategies as st

import explore
from explore.model.columns import Column
from explore.model.status import Status
from explore.results.ranking.wasteful_ranges import find_wasteful_ranges

STUDIES = {
    "drawn": """mechanism = "crank-rocker"
[parameters]
crank = { solve = "swing_angle", value = 60 }
coupler = { min = 50, max = 1000 }
rocker = { min = 50, max = 500 }
ground = { min = 0.05, max = 1000, log = true }
[sampling]
method = "sobol"
count = 2000
""",
    "grid": """mechanism = "crank-rocker"
[parameters]
coupler = { solve = "transmission_angle_min", value = "40 deg", max = "80 cm" }
crank = { start = 10, stop = 130, num = 13 }
rocker = [300, 500, 900]
ground = { start = 0.7, stop = 1000.3, num = 14 }
speed = [1, 2]
""",
    "rig": """mechanism = "test-rig"
[parameters]
rocker = { solve = "swing_angle", value = 20, min = 200, max = 400 }
crank = { start = 1, stop = 301, num = 301 }
coupler = 600
ground = { start = 900, stop = 901, num = 11 }
[evaluate]
metrics = ["time_ratio"]
[rank]
metrics = ["time_ratio:min"]
""",
}


@dataclass
class Blocks:
    """Results in memory, in blocks of a few designs."""

    frame: pd.DataFrame

    @property
    def columns(self):
        return tuple(Column(name, "mm", name, "parameter") for name in self.frame.columns if name != "status")

    def blocks(self, columns):
        for start in range(0, len(self.frame), 7):
            part = self.frame[columns].iloc[start : start + 7]
            yield {name: part[name].to_numpy() for name in columns}


def count_designs(frame, part):
    """Numbers of designs and of reachable designs, from the printed bound."""
    chosen = frame.query(f"{part.parameter} {part.side} {part.value:.12g}")
    return len(chosen), int((chosen["status"] != Status.UNREACHABLE).sum())


def longest_wasteful_ranges(values, reachable):
    """By the definition: parts of round width from each end, as long as all are poorer than half."""
    width = values.max() - values.min()
    steps = [float(f"{factor}e{power}") for power in range(-9, 9) for factor in (1, 2, 5)]
    step = next(step for step in steps if step * (1 + 1e-12) >= width / 20)
    part = np.array([round(value / step, 9) for value in values]) // 1
    share = reachable.mean()
    expected = {}
    for side, parts in (("<", sorted(set(part))), (">=", sorted(set(part), reverse=True))):
        poor = []
        for number in parts:
            if not reachable[part == number].mean() < share / 2:
                break
            poor.append(number)
        if poor and len(poor) < len(parts):
            expected[side] = (int(np.isin(part, poor).sum()), int(reachable[np.isin(part, poor)].sum()))
    return expected


@settings(derandomize=True, deadline=None, max_examples=150)
@given(st.lists(st.tuples(st.integers(-40, 40), st.integers(0, 3), st.booleans()), min_size=1, max_size=60))
@example([(k, 0, k < 35) for k in range(40)])
@example([(k, 0, False) for k in range(9)])
def test_wasteful_ranges_are_those_of_the_definition(rows):
    places, lists, reachable = (np.array(each) for each in zip(*rows, strict=True))
    codes = np.where(reachable, int(Status.OK), int(Status.UNREACHABLE)).astype(np.int8)
    frame = pd.DataFrame({"even": places / 10, "listed": np.array([1.0, 2.0, 500.0, 501.0])[lists], "status": codes})
    frame["solved"] = np.where(reachable, 1.0, np.nan)

    ranges = find_wasteful_ranges(Blocks(frame))

    for name in ("even", "listed"):
        found = {each.side: (each.n_designs, each.n_reachable) for each in ranges if each.parameter == name}
        assert found == (
            longest_wasteful_ranges(frame[name].to_numpy(), reachable) if frame[name].nunique() > 1 else {}
        )
    for each in ranges:
        assert (each.n_designs, each.n_reachable) == count_designs(frame, each)
    wasted = [each.n_designs - each.n_reachable for each in ranges]
    assert wasted == sorted(wasted, reverse=True)


@pytest.mark.parametrize("values", [[0.0, 5e-324], [-1e308, 1e308], [1e300, np.nextafter(1e300, 2e300)], [np.nan, 1.0]])
def test_no_values_of_a_foreign_file_are_too_much(values):
    frame = pd.DataFrame({"length": values, "status": np.array([1, Status.UNREACHABLE], np.int8)})
    assert len(find_wasteful_ranges(Blocks(frame))) <= 1


def after_the_summary(err):
    """The lines after that of the sweep as a whole; before it a slow machine says how far it is."""
    return re.split(r"-> results/\w+\.h5\n", err)[1].splitlines()


@pytest.mark.parametrize("name", STUDIES)
def test_a_sweep_says_which_bounds_waste_most_of_its_designs(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("study.toml").write_text(STUDIES[name])
    _, err = succeed("sweep", "study.toml")
    results = explore.open_results("results/study.h5")
    frame = explore.read_results(results.path)
    total, missing = len(frame), int((frame["status"] == Status.UNREACHABLE).sum())
    reason = {"drawn": "no crank gives swing_angle = 60 deg",
              "grid": "no coupler up to 800 mm gives transmission_angle_min = 40 deg",
              "rig": "no rocker from 200 mm up to 400 mm gives swing_angle = 20 deg"}[name]  # fmt: skip
    first, *others = after_the_summary(err)
    assert first == f"{missing:,} of {total:,} designs are unreachable: {reason}"
    assert 1 <= len(others) <= 3
    for line in others:
        match = re.fullmatch(r"  wasteful: (\w+) (<|>=) (\S+) mm, where ([\d,]+) of ([\d,]+) are reachable", line)
        parameter, side, value, reachable, designs = match.groups()
        chosen = frame.query(f"{parameter} {side} {value}")
        assert int(designs.replace(",", "")) == len(chosen)
        assert int(reachable.replace(",", "")) == (chosen["status"] != Status.UNREACHABLE).sum()
    err = call("rank", "--where", "crank > 0")[2]
    assert "".join(f"{line}\n" for line in others) in err


def test_a_sweep_that_keeps_the_front_counts_what_is_unreachable(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("study.toml").write_text(STUDIES["drawn"])
    _, err = succeed("sweep", "study.toml", "--keep", "front")
    counts = json.loads(str(explore.open_results("results/study.h5").attributes["studied_counts"]))
    assert after_the_summary(err) == [
        f"{counts['unreachable']:,} of 2,000 designs are unreachable: no crank gives swing_angle = 60 deg",
        "  a smaller sweep that keeps all designs shows which bounds waste them",
    ]


def test_where_no_bound_wastes_designs_none_is_named(tmp_path, monkeypatch):
    """Few are unreachable, or all, or those in the middle of all ranges: links that cannot be assembled."""
    monkeypatch.chdir(tmp_path)
    few = STUDIES["drawn"].replace("60 }", "1 }").replace("min = 50", "min = 400").replace("0.05", "500")
    Path("few.toml").write_text(few)
    Path("none.toml").write_text(STUDIES["drawn"].replace("60 }", "60, max = 1e-3 }"))
    rows = ["1000,450,620", "1300,900,830", "1200,500,650", "1210,510,660", "1220,505,640"]
    Path("middle.csv").write_text("\n".join(["coupler,rocker,ground", *rows]))
    Path("middle.toml").write_text(
        'mechanism = "crank-rocker"\n[parameters]\ncrank = { solve = "swing_angle", value = 5 }\n'
        '[sampling]\nmethod = "table"\nfile = "middle.csv"\n'
    )
    expected = {
        "few": [],
        "none": ["2,000 of 2,000 designs are unreachable: no crank up to 0.001 mm gives swing_angle = 60 deg"],
        "middle": [
            "3 of 5 designs are unreachable: no crank gives swing_angle = 5 deg",
            "  no end of a swept range is much worse than the rest of it, so no single bound wastes them",
        ],
    }
    for name, lines in expected.items():
        _, err = succeed("sweep", f"{name}.toml")
        assert after_the_summary(err) == lines, name
