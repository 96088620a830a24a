"""Metrics that come with the designs: named, bounded and ranked as any other, but not computed."""

import pickle

import numpy as np
import pytest

from explore.base.errors import RequestError
from explore.evaluation.evaluate import evaluate_columns, output_columns
from explore.mechanisms.registry import MECHANISMS
from explore.model.columns import Column
from explore.model.quantities import GivenMetric
from explore.studies.request.requests import make_objective, make_request

COST = GivenMetric(Column("cost", "1", "price of the design", "metric"), "min")
GRADE = GivenMetric(Column("grade", "", "how it was made", "bookkeeping", "|i1", {0: "ground", 1: "milled"}))
MECHANISM = MECHANISMS["slider-crank"].with_given((COST, GRADE))
DESIGNS = {
    "crank": np.array([20.0, 20.0, 20.0, -1.0, 200.0]),
    "rod": np.full(5, 100.0),
    "cost": np.array([3.0, 5.0, np.nan, 3.0, 3.0]),
    "grade": np.array([0, 0, 0, 0, 0], dtype=np.int8),
}


def evaluate(**arguments):
    return evaluate_columns(make_request(MECHANISM, **arguments), DESIGNS).columns


def test_a_bound_on_what_is_given_decides_whether_a_design_is_feasible():
    columns = evaluate(metrics=["stroke"], constraints={"cost": {"max": 4}, "grade": {"max": 0}})
    assert columns["feasible"].tolist() == [1, 0, 0, 0, 0]
    # of a design outside the ranges of the parameters nothing is known
    np.testing.assert_array_equal(columns["cost_margin"], [1.0, -1.0, np.nan, np.nan, 1.0])
    assert "cost" not in columns
    np.testing.assert_array_equal(columns["stroke"], evaluate(metrics=["stroke"])["stroke"])
    assert columns["status"][1] == columns["status"][0]  # what is given screens nothing


def test_it_is_a_column_where_it_is_listed():
    request = make_request(MECHANISM, metrics=["grade", "stroke", "cost"])
    columns = evaluate_columns(request, DESIGNS).columns
    assert columns["grade"] is DESIGNS["grade"]
    np.testing.assert_array_equal(columns["cost"], DESIGNS["cost"])
    assert [column for column in output_columns(request, ["crank"]) if column.name in ("grade", "cost")] == [
        GRADE.column,
        COST.column,
    ]


def test_a_metric_that_is_given_has_to_be_there():
    with pytest.raises(KeyError, match="grade"):
        evaluate_columns(
            make_request(MECHANISM, metrics=["stroke"]), {name: DESIGNS[name] for name in ("crank", "rod", "cost")}
        )


def test_it_is_ranked_if_it_is_a_metric():
    request = make_request(MECHANISM, metrics=["stroke"])
    assert make_objective(request, "cost").sense == "min"
    with pytest.raises(RequestError, match="grade can be bounded, but not ranked"):
        make_objective(request, "grade:max")
    with pytest.raises(RequestError, match="unknown metric 'csot'; did you mean 'cost'"):
        make_objective(request, "csot")


def test_formulas_neither_use_it_nor_take_its_name():
    def problem(name, formula):
        with pytest.raises(RequestError) as caught:
            make_request(MECHANISM, formulas={name: {"formula": formula, "unit": "1"}})
        return str(caught.value)

    assert problem("twice", "2 * cost").endswith("cost comes with the designs, so a formula cannot use it")
    assert "this is the name of a metric or signal" in problem("cost", "crank")


def test_a_worker_that_unpickles_the_mechanism_has_it_too():
    for mechanism in (MECHANISM, MECHANISM.extended):
        assert pickle.loads(pickle.dumps(mechanism)).given == (COST, GRADE)


def test_the_extended_mechanism_has_it_too():
    assert MECHANISM.extended is None or MECHANISM.extended.given == MECHANISM.given
    rocker = MECHANISMS["crank-rocker"].with_given((COST,))
    assert rocker.extended.given == (COST,)
    assert MECHANISMS["crank-rocker"].with_given(()) is MECHANISMS["crank-rocker"]
