"""The infeasible designs nearest to feasible, and what excludes the others, against brute force with pandas."""

import json
from collections import Counter

import numpy as np
import pandas as pd
import pytest
from command_line import call, succeed
from studies import swept

import explore
from explore.results.ranking import violations
from explore.results.ranking.exclusions import Exclusions
from explore.results.ranking.nearest import find_nearest

#: A wiper: 90 deg of swing in equal times. No link lengths of these ranges meet all constraints at once.
WIPER = """mechanism = "crank-rocker"
[parameters]
crank = { min = 20, max = 60 }
coupler = { min = 100, max = 300 }
rocker = { min = 40, max = 120 }
ground = { min = 100, max = 300 }
[sampling]
method = "sobol"
count = 4096
seed = 1
[evaluate]
metrics = ["swing_angle", "time_ratio", "transmission_angle_min"]
[constraints]
swing_angle = { min = 89.5, max = 90.5 }
time_ratio = { max = 1.001 }
transmission_angle_min = { min = 45 }
transmission_angle_max = { max = 135 }
"""
CONSTRAINTS = ("swing_angle", "time_ratio", "transmission_angle_max", "transmission_angle_min")
MARGINS = [f"{metric}_margin" for metric in CONSTRAINTS]
wiper = swept(WIPER, "wiper", give=lambda results: results.path)


def brute_force(frame, margins=MARGINS):
    """Measured rows with their total violation, nearest first, and the constraints that each row misses."""
    measured = frame[frame["status"].isin([1, 6])]
    measured = measured[~((measured["status"] == 1) & measured[margins].isna().any(axis=1))]
    total = pd.Series(0.0, index=measured.index)
    scales = {}
    for name in margins:
        known = measured[name].dropna()
        scales[name] = known.quantile(0.75) - known.quantile(0.25)
        total += (-measured[name]).clip(lower=0.0).fillna(0.0) / scales[name]
    missed = measured[margins].lt(0.0)
    return total[total > 0.0].sort_values(kind="stable"), missed, scales


def test_the_nearest_designs_are_those_of_brute_force(wiper):
    frame = explore.read_results(wiper)
    total, missed, scales = brute_force(frame)

    found = explore.nearest(wiper, 25)

    assert not frame["feasible"].any()
    assert found.index.tolist() == total.index[:25].tolist()
    # four terms, each with a quotient and a sum
    np.testing.assert_allclose(found["violation"], total[:25], rtol=1e-15)
    expected = {metric: scales[f"{metric}_margin"] for metric in CONSTRAINTS}
    assert found.attrs["scales"] == pytest.approx(expected, rel=1e-14)  # pandas interpolates in another order
    names = [tuple(name.removesuffix("_margin") for name in MARGINS if row[name]) for _, row in missed.iterrows()]
    assert found.attrs["combinations"] == Counter(names)


def test_blocks_give_what_the_table_gives(wiper, monkeypatch):
    frame = explore.read_results(wiper)
    results = explore.open_results(wiper)

    def blocks(names):
        for start in range(0, len(frame), 333):
            part = frame.iloc[start : start + 333]
            yield {name: part.index.to_numpy() if name == "design" else part[name].to_numpy() for name in names}

    monkeypatch.setattr(results, "blocks", blocks)

    pd.testing.assert_frame_equal(explore.nearest(results, 7), explore.nearest(frame, 7), check_exact=True)


def test_scales_of_many_designs_come_from_a_sample(wiper, monkeypatch):
    exact = explore.nearest(wiper, 1).attrs["scales"]
    monkeypatch.setattr(violations, "_LARGEST_SAMPLE", 2048)

    sampled, again = (explore.nearest(wiper, 1).attrs["scales"] for _ in range(2))

    assert sampled == again != exact
    # The quartiles of about 700 values: standard error sqrt(3/16/700)/density, a twentieth of their distance.
    assert sampled == pytest.approx(exact, rel=0.2)


def test_relaxation_lets_in_just_so_many():
    margins = {"a": np.array([-3.0, -1.0, -2.0, -0.5, 1.0]), "b": np.array([0.0, 1.0, 2.0, -1.0, np.nan])}
    exclusions = Exclusions()
    for part in (slice(0, 2), slice(2, 5)):
        block = {name: margin[part] for name, margin in margins.items()}
        exclusions.count(block, np.ones(len(block["a"]), dtype=bool))

    assert [exclusions.relaxation("a", count) for count in (1, 2, 3, 4)] == [1.0, 2.0, 3.0, None]
    assert exclusions.relaxation("b", 1) is None
    assert (exclusions.missed("a"), exclusions.alone("a"), exclusions.together()) == (4, 3, [(("a", "b"), 1)])
    assert (exclusions.missed("b"), exclusions.alone("b"), exclusions.n_partly_known) == (1, 0, 1)


def test_more_constraints_than_a_number_has_bits():
    margins = {f"m{k}": np.array([-1.0 if k in (0, 69) else 1.0, 1.0]) for k in range(70)}
    exclusions = Exclusions()

    exclusions.count(margins, np.ones(2, dtype=bool))

    assert exclusions.combinations == {("m0", "m69"): 1, (): 1}


def test_screened_designs_have_unknown_margins_and_those_without_motion_none():
    rockers = [200.0, 541.0, 2000.0]  # the last cannot be assembled
    designs = {"crank": [50.0, 100.0, 50.0], "coupler": 900.0, "rocker": rockers, "ground": 800.0}
    frame = explore.evaluate(
        "crank-rocker", designs, metrics=["swing_angle", "cv"],
        constraints={"swing_angle": {"min": 25}, "rocker_acceleration_max": {"max": 0.01}},
    )  # fmt: skip
    found = explore.nearest(frame, 9)

    screened = found.index[found["rocker_acceleration_max_margin"].isna()].tolist()
    assert sorted(found.index) == [0, 1]
    assert screened == frame.index[frame["status"] == 6].tolist() != []


def test_a_scale_of_zero_becomes_the_largest_violation():
    frame = pd.DataFrame({"a_margin": [-2.0, *[1.0] * 10, -1.0]})

    found = explore.nearest(frame, 9)

    assert found["violation"].tolist() == [0.5, 1.0]
    assert found.attrs["scales"] == {"a": 2.0}


def test_of_equal_designs_the_first_are_named(wiper):
    frame = pd.DataFrame({"a_margin": [1.0, *[-1.0] * 5]})
    assert explore.nearest(frame, 2).index.tolist() == [1, 2]


def test_progress_counts_both_passes_up_to_all_of_them(wiper):
    told = []
    find_nearest(explore.open_results(wiper), 3, report_progress=lambda *counts: told.append(counts))
    assert {total for _, total in told} == {2 * 4096}
    done = [count for count, _ in told]
    assert done == sorted(set(done))
    assert (4096 in done, done[-1]) == (True, 2 * 4096)


def test_a_limit_moves_the_bound_and_a_condition_leaves_designs_out(wiper):
    frame = explore.read_results(wiper)
    selected = frame[frame["crank"] < 30].copy()
    selected["transmission_angle_min_margin"] = selected["transmission_angle_min"] - 60.0
    selected["coupler_margin"] = 150.0 - selected["coupler"]
    total, _, _ = brute_force(selected, [*MARGINS, "coupler_margin"])
    limits = {"transmission_angle_min": 60, "coupler": {"max": 150}}

    for source in (wiper, frame):
        found = explore.nearest(source, 5, where="crank < 30", limits=limits)

        assert found.index.tolist() == total.index[:5].tolist()
        np.testing.assert_allclose(found["violation"], total[:5], rtol=1e-15)  # five terms, each a quotient and a sum


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"count": 0}, "nearest = 0: must be at least 1"),
        ({"limits": {"transmission_angle_min": 30}}, "30 is below the min of 45 of the sweep"),
    ],
)
def test_wrong_arguments_are_refused(wiper, arguments, message):
    with pytest.raises(explore.RequestError, match=message):
        explore.nearest(wiper, **arguments)


def test_without_constraints_nothing_is_missed():
    with pytest.raises(explore.RequestError, match="no constraint"):
        explore.nearest(pd.DataFrame({"cv": [1.0]}))


def test_the_command_prints_both_tables_and_json(wiper, tmp_path, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    out, _ = succeed("rank", wiper, "--nearest", "3", "-o", tmp_path / "near.csv")
    nearest = explore.nearest(wiper, 3)
    designs = [int(line.split()[0]) for line in out.splitlines()[5:8]]
    assert designs == nearest.index.tolist()
    assert "what each constraint excludes" in out
    assert "swing_angle and time_ratio together" in out
    written = pd.read_csv(tmp_path / "near.csv")["violation"]
    np.testing.assert_array_max_ulp(written, nearest["violation"], 1)  # as far as pandas reads decimals

    out, _ = succeed("rank", wiper, "--nearest", "3", "--json")
    assert [record["design"] for record in json.loads(out)] == nearest.index.tolist()


@pytest.mark.parametrize("option", [("--metric", "swing_angle"), ("--top", "3"), ("--quality",), ("--fronts", "2")])
def test_the_command_refuses_options_of_the_pareto_set(wiper, option):
    code, _, err = call("rank", wiper, "--nearest", "3", *option)

    assert code == 2
    assert "--nearest takes one results file, and no --metric" in err


def test_rank_and_sweep_name_the_nearest_when_nothing_is_feasible(wiper, tmp_path):
    nearest = explore.nearest(wiper, 1).index[0]
    (tmp_path / "wiper.toml").write_text(WIPER)
    commands = [("rank", wiper), ("sweep", tmp_path / "wiper.toml", "-o", tmp_path / "again.h5")]
    for command in commands:
        out, err = succeed(*command)
        assert out == ""
        assert f"near: design {nearest:,} misses" in err
        assert "miss swing_angle and time_ratio together" in err
        assert "of them alone: relaxed by" in err


def test_a_file_of_the_front_alone_says_what_to_do(tmp_path):
    (tmp_path / "wiper.toml").write_text(WIPER)
    explore.sweep(explore.load_study(tmp_path / "wiper.toml"), tmp_path / "front.h5", keep="front")

    with pytest.raises(explore.RequestError, match="kept the Pareto set only"):
        explore.nearest(tmp_path / "front.h5")
    _, err = succeed("rank", tmp_path / "front.h5")
    assert "a sweep that keeps all designs shows which are nearest" in err
