"""A declaration that contradicts itself or its kernel fails when the mechanism is made."""

from dataclasses import replace
from enum import IntEnum

import numpy as np
import pytest

from explore.mechanisms.registry import MECHANISMS
from explore.model.quantities import Metric

MECHANISM = MECHANISMS["crank-rocker"]
RIG = MECHANISMS["test-rig"]


def changed(items, name, /, **changes):
    """The items, with changes to the one of this name."""
    assert name in [item.name for item in items]
    return tuple(replace(item, **changes) if item.name == name else item for item in items)


def problem(mechanism, **changes):
    """The message that refuses the changed mechanism."""
    with pytest.raises(ValueError, match=f"^mechanism '{mechanism.name}': ") as refusal:
        replace(mechanism, **changes)
    return str(refusal.value).removeprefix(f"mechanism '{mechanism.name}': ")


@pytest.mark.parametrize("mechanism", MECHANISMS.values(), ids=MECHANISMS)
def test_registered_mechanisms_pass(mechanism):
    assert replace(mechanism) == mechanism


@pytest.mark.parametrize("field", ["parameters", "signals", "metrics", "windows"])
def test_names_are_unique(field):
    items = getattr(MECHANISM, field)
    assert problem(MECHANISM, **{field: (*items, items[0])}) == (
        f"the {field[:-1]} '{items[0].name}' is declared twice"
    )


def test_a_formula_has_no_metrics_name():
    formulas = changed(RIG.formulas, "pin_diameter", name="swing_angle")
    assert problem(RIG, formulas=formulas) == "the metric 'swing_angle' is declared twice"


def test_codes_are_unique():
    windows = changed(MECHANISM.windows, "return", code=MECHANISM.windows[1].code)
    assert problem(MECHANISM, windows=windows) == "two windows have the code 1"
    assert problem(MECHANISM, drives={"slow": 0, "fast": 0}) == "two drives have the code 0"


@pytest.mark.parametrize(("count", "name", "scales"), [(0, "speed", False), (2, "phases", True)])
def test_one_parameter_scales_the_speed(count, name, scales):
    parameters = changed(MECHANISM.parameters, name, scales_speed=scales)
    assert problem(MECHANISM, parameters=parameters) == f"{count} parameters scale the speed; exactly one must"


@pytest.mark.parametrize("default", [0.0, 13.0, 2.5, np.nan])
def test_defaults_are_in_range(default):
    parameters = changed(MECHANISM.parameters, "phases", default=default)
    assert problem(MECHANISM, parameters=parameters) == f"the default {default:g} of 'phases' is outside its own range"


def test_metrics_have_the_kernels_order():
    first, second, *others = MECHANISM.metrics
    assert problem(MECHANISM, metrics=(second, first, *others)) == (
        "metric_columns has 'grashof_margin' at 1, the declaration at 0"
    )
    assert problem(MECHANISM, metrics=(first, second, *others, Metric("area", "mm^2", "area"))) == (
        "metric_columns has 'area' at absent, the declaration at 8"
    )
    assert problem(MECHANISM, metrics=(first, second, *others[:-1])) == (
        "metric_columns has 'transmission_angle_max' at 7, the declaration at absent"
    )


def test_parameters_have_the_kernels_order():
    first, second, *others = MECHANISM.parameters
    assert problem(MECHANISM, parameters=(second, first, *others)) == (
        "parameter_columns has 'coupler' at 1, the declaration at 0"
    )
    columns = IntEnum("Columns", {column.name: column.value + 1 for column in RIG.parameter_columns})
    assert problem(RIG, parameter_columns=columns) == "parameter_columns has 'crank' at 1, the declaration at 0"


@pytest.mark.parametrize(("field", "row"), [("row", -1), ("row", 20), ("terms_row", -2), ("terms_row", 20)])
def test_rows_exist(field, row):
    signals = changed(RIG.signals, "coupler_force", **{field: row})
    assert problem(RIG, signals=signals) == (
        f"{field} {row} of the signal 'coupler_force' is not one of the {RIG.signal_rows} rows"
    )


def test_rows_are_shared_only_where_declared():
    row = next(signal.row for signal in MECHANISM.signals if signal.name == "rocker_velocity")
    assert problem(MECHANISM, signals=changed(MECHANISM.signals, "coupler_velocity", row=row)) == (
        f"two signals have the row {row}; the second must say so in shares_row_with"
    )
    assert problem(RIG, signals=changed(RIG.signals, "power", pole_order=4)) == (
        "the signals 'power' and 'drive_torque' share a row, but differ in pole_order"
    )
    assert problem(RIG, signals=changed(RIG.signals, "power", shares_row_with="torque")) == (
        "the signal 'power' names the signal 'torque', which does not exist"
    )


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"loop_lengths": ("crank", "rod")}, "loop_lengths names the parameter 'rod'"),
        ({"default_window": "stroke"}, "default_window names the window 'stroke'"),
        ({"default_drive": "quick"}, "default_drive names the drive 'quick'"),
        ({"zero_mean": frozenset([("velocity", "cycle")])}, "zero_mean names the signal 'velocity'"),
        ({"zero_mean": frozenset([("rocker_velocity", "turn")])}, "zero_mean names the window 'turn'"),
        ({"output_signals": {"": "output"}}, "output_signals names the signal 'output'"),
        ({"output_signals": dict.fromkeys(["", "turn"], "rocker_velocity")}, "output_signals names the window 'turn'"),
        ({"default_metrics": {"": ("cv", "area")}}, "default_metrics names the metric 'area'"),
        ({"default_metrics": {"": ("cv",), "turn": ("cv",)}}, "default_metrics names the window 'turn'"),
        ({"objectives": ("cv", "area:min")}, "objectives names the metric 'area'"),
    ],
)  # fmt: skip
def test_declared_names_exist(changes, sentence):
    assert problem(MECHANISM, **changes) == f"{sentence}, which does not exist"


@pytest.mark.parametrize("field", ["output_signals", "default_metrics"])
def test_every_window_has_an_entry(field):
    entries = {"cycle": getattr(MECHANISM, field)[""]}
    assert problem(MECHANISM, **{field: entries}) == (f"{field} has no entry '' for the windows that it does not name")


def test_names_in_parts_exist():
    parameters = changed(MECHANISM.parameters, "phases", only_in=("turn",))
    assert problem(MECHANISM, parameters=parameters).startswith("only_in of 'phases' names the window 'turn'")
    signals = changed(MECHANISM.signals, "output_velocity", only_in=("turn",))
    assert problem(MECHANISM, signals=signals).startswith("only_in of 'output_velocity' names the window 'turn'")
    signals = changed(MECHANISM.signals, "rocker_velocity", derivative_of="rocker")
    assert problem(MECHANISM, signals=signals).startswith(
        "derivative_of of 'rocker_velocity' names the signal 'rocker'"
    )
    signals = changed(RIG.signals, "coupler_force", required_loads=("torque",))
    assert problem(RIG, signals=signals).startswith("the signal 'coupler_force' names the parameter 'torque'")


@pytest.mark.parametrize(
    ("field", "kind"), [("inputs", "input"), *((field, "parameter") for field in ("alternatives", "optional"))]
)
def test_inputs_of_formulas_exist(field, kind):
    formulas = changed(RIG.formulas, "buckling_factor", **{field: ("thickness",)})
    assert problem(RIG, formulas=formulas).startswith(f"the formula 'buckling_factor' names the {kind} 'thickness'")


def test_senses_of_objectives():
    assert problem(MECHANISM, objectives=("cv:least",)) == (
        "the objective 'cv:least' has no sense 'min' or 'max' after its colon"
    )


def test_the_closed_form_takes_any_real_array():
    design = [[100, 300, 250, 350, 3, 1]]
    result = MECHANISM.evaluate_closed_form(np.array(design))
    ordered = np.asfortranarray(np.repeat(np.array(design, dtype=float), 2, axis=0))
    twice = MECHANISM.evaluate_closed_form(ordered)
    assert result.metrics.shape == (len(MECHANISM.metrics), 1)
    assert result.kernel.shape == (1, MECHANISM.kernel_size)
    for field in ("metrics", "status", "kernel", "singular", "noise"):
        one, two = getattr(result, field), getattr(twice, field)
        assert np.array_equal(np.take(two, [0], axis=int(field == "metrics")), one)
