"""Work spaces of the compiled loop that later calls take over: no number of an earlier call is left in a result."""

import numpy as np
import pytest
from linkage_cases import CASES, linkage_of, scattered

import explore
from explore.evaluation.quadrature import work_space
from explore.evaluation.quadrature.work_space import Sizes, leave_work_space, take_work_space

SIZES = Sizes(0, 0, 0, 0, 1, -1, -1, 0)
#: Designs of which some are sampled adaptively, in pieces, with equal steps or on graded panels.
REQUESTS = {
    "beside limits": ("crank-rocker", {"metrics": ["cv", "rocker_acceleration_max"]}, (
        {"crank": [100.0, 199.9999999], "coupler": [950.0, 950.0], "rocker": [550.0, 550.0], "ground": [750.0, 600.0]},
        {"crank": [40.0, 120.0], "coupler": [300.0, 800.0], "rocker": [250.0, 700.0], "ground": [290.0, 1370.0]},
    )),
    "with corners": ("slider-crank", {"metrics": ["drive_torque_rms", "positive_work"]}, (
        {"crank": [30.0, 20.0], "rod": [100.0, 90.0], "mass": [2.0, 0.0], "friction": [0.1, 0.0], "speed": [20.0, 9.0]},
        {"crank": [9.0, 50.0], "rod": [70.0, 51.0], "mass": [0.0, 3.0], "friction": [0.2, 0.3], "speed": [3.0, 40.0]},
    )),
}  # fmt: skip


@pytest.fixture(autouse=True)
def _no_earlier_calls(monkeypatch):
    monkeypatch.setattr(work_space, "_SPARE", [])


def test_a_call_takes_what_an_earlier_one_of_its_tables_has_left():
    first, other = object(), object()
    space = take_work_space(SIZES, first, 0)

    assert take_work_space(SIZES, first, 0)[0] is not space[0], "two calls at once share nothing"
    leave_work_space(first, space)
    assert take_work_space(SIZES, other, 0)[0] is not space[0]
    assert take_work_space(SIZES, first, 0)[0] is space[0]
    for k in range(9):
        leave_work_space(k, space)
    assert len(work_space._SPARE) == 8


def columns_of(mechanism, designs, question):
    return explore.evaluate(mechanism, designs, **question, table=False)


@pytest.mark.parametrize("name", REQUESTS)
def test_results_are_those_of_a_first_call(name):
    mechanism, question, parts = REQUESTS[name]
    assert_independent(mechanism, question, [{k: np.array(v) for k, v in part.items()} for part in parts])


@pytest.mark.parametrize("window", ["cycle", "forward"])
def test_results_of_a_table_are_those_of_a_first_call(window):
    rng, case = np.random.default_rng(3), CASES["crank-shaper"]
    parts = [scattered(case, 40, rng, 0.2) for _ in range(2)]
    metrics = ["ram_velocity_variance", "ram_acceleration_max"]
    assert_independent(linkage_of(case), {"window": window, "metrics": metrics}, parts)


def assert_independent(mechanism, question, parts):
    fresh = []
    for part in parts:
        work_space._SPARE.clear()
        fresh.append(columns_of(mechanism, part, question))
    again = [columns_of(mechanism, part, question) for part in (*parts, parts[0])]
    for one, other in zip((*fresh, fresh[0]), again, strict=True):
        for name, column in one.items():
            assert column.tobytes() == other[name].tobytes(), name
