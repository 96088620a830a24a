"""A declaration that contradicts itself or its kernel fails when the mechanism is made."""

import pickle
from dataclasses import replace
from enum import IntEnum

import numpy as np
import pytest
from simple_slider import SIMPLE_SLIDER

from explore.base.compiling import LANES
from explore.mechanisms.registry import MECHANISMS
from explore.model.quadrature import Graded
from explore.model.quantities import Metric
from explore.model.status import OwnStatus, Status
from explore.model.window import Window
from explore.studies.config.study_file import starter
from explore.testing.contract import draw_designs

MECHANISM = MECHANISMS["crank-rocker"]
RIG = MECHANISMS["test-rig"]
SIGNAL_ROWS = RIG.signal_rows


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


def test_drives_differ_and_choose_a_stroke():
    assert problem(MECHANISM, drives=("slow", "fast", "slow")) == "the drive 'slow' is declared twice"
    assert problem(MECHANISM, drives=("slow", "cycle")) == "the drive 'cycle' is neither slow nor fast nor a stroke"


def test_at_most_one_parameter_scales_the_speed():
    parameters = changed(MECHANISM.parameters, "phases", scales_speed=True)
    assert problem(MECHANISM, parameters=parameters) == (
        "2 parameters scale the speed, speed and phases; at most one does"
    )


def test_nothing_depends_on_a_speed_that_is_not_there():
    parameters = tuple(replace(p, scales_speed=False, is_dynamic=False) for p in MECHANISM.parameters)
    assert problem(MECHANISM, parameters=parameters) == (
        "the signal 'coupler_velocity' has a power of the speed, but no parameter scales the speed"
    )
    assert problem(RIG, parameters=changed(RIG.parameters, "speed", scales_speed=False)) == (
        "'damping' makes loads depend on the speed, but no parameter scales the speed"
    )


@pytest.mark.parametrize("code", [*Status, 12, 19, 128, -1])
def test_own_statuses_have_codes_of_their_own(code):
    assert problem(MECHANISM, statuses={int(code): OwnStatus("stuck", "it is stuck")}) == (
        f"the status 'stuck' has the code {int(code)}; a mechanism's own are 2 to 5 and 20 to 127"
    )


def test_own_statuses_have_labels_of_their_own():
    stuck = OwnStatus("stuck", "it is stuck")
    assert problem(MECHANISM, statuses={20: stuck, 21: stuck}) == "two statuses have the label 'stuck'"
    assert problem(MECHANISM, statuses={20: replace(stuck, label="screened")}) == (
        "two statuses have the label 'screened'"
    )


def test_a_mechanism_has_a_parameter_and_a_metric_or_a_signal():
    sentence = "a mechanism has at least one parameter, and a closed-form metric or a signal"
    assert problem(MECHANISM, parameters=()) == problem(MECHANISM, metrics=(), signals=()) == sentence


@pytest.mark.parametrize("default", [0.0, 13.0, 2.5, np.nan])
def test_defaults_are_in_range(default):
    parameters = changed(MECHANISM.parameters, "phases", default=default)
    assert problem(MECHANISM, parameters=parameters) == f"the default {default:g} of 'phases' is outside its own range"


def test_a_loop_has_lengths():
    assert (
        problem(MECHANISM, loop_lengths=("crank",)) == "loop_lengths has only 'crank'; a loop has at least two lengths"
    )
    for name in ("speed", "phases"):
        assert problem(MECHANISM, loop_lengths=("crank", name)) == f"loop_lengths names '{name}', which is not a length"
    assert problem(RIG, loop_lengths=("crank", "inertia")) == "loop_lengths names 'inertia', which is not a length"


def test_columns_of_results_differ():
    metrics = changed(MECHANISM.metrics, "swing_angle", name="crank")
    assert problem(MECHANISM, metrics=metrics) == "'crank' is a parameter and a metric"
    metrics = changed(MECHANISM.metrics, "swing_angle", name="error")
    assert problem(MECHANISM, metrics=metrics) == "'error' is the name of a column of all results"


def test_ranges_hold_something():
    assert problem(MECHANISM, parameters=changed(MECHANISM.parameters, "crank", upper=0.0)) == (
        "the range of 'crank' is empty: above 0, up to 0"
    )
    assert problem(MECHANISM, parameters=changed(MECHANISM.parameters, "branch", lower=-1.0)) == (
        "the choice -1 of 'branch' is outside its own range"
    )


def test_functions_are_compiled():
    for name in ("close", "fill"):
        assert problem(MECHANISM, **{name: getattr(MECHANISM, name).py_func}) == (
            f"{name} is not compiled; decorate it with explore.base.compiling.compiled"
        )


def test_precise_functions_are_given_together():
    for name in ("precise_fill", "disturbed_precise_fill"):
        sentence = "precise_fill and disturbed_precise_fill are given together"
        assert problem(MECHANISM, **{name: MECHANISM.fill}) == sentence


def test_one_window_is_the_whole_motion():
    cycle, *others = RIG.windows
    sentence = "windows are the full turn or the range of input angles; exactly one is"
    assert problem(RIG, windows=tuple(others)) == f"0 {sentence}"
    assert problem(RIG, windows=(*RIG.windows, replace(cycle, name="turn"))) == f"2 {sentence}"


def test_the_name_interval_is_of_explicit_angles_and_a_range_needs_a_kernel_that_takes_it():
    assert problem(RIG, windows=(*RIG.windows[1:], Window("range", "a range", "interval"))) == (
        "the window 'range' limits the input angle, which needs takes_interval"
    )
    assert problem(RIG, windows=changed(RIG.windows, "cycle", name="interval")) == (
        "the window 'interval' is of kind 'turn'; that name is of explicit angles"
    )


def test_strokes_make_up_the_turn():
    arc, other = RIG.strokes
    assert problem(RIG, windows=changed(RIG.windows, arc, ends=("extended", "extended"))) == (
        f"the window '{arc}' ends where it begins, at the mark 'extended'"
    )
    assert problem(RIG, windows=changed(RIG.windows, arc, ends=("extended", "overlapped"))) == (
        f"the strokes '{arc}' and '{other}' do not make up the turn"
    )


def test_pole_orders_are_known():
    signals = changed(MECHANISM.signals, "coupler_velocity", pole_order=3)
    assert problem(MECHANISM, signals=signals) == "pole_order of the signal 'coupler_velocity' is 3; it is 2, 4 or 6"


def test_metrics_have_the_kernels_order():
    first, second, *others = MECHANISM.metrics
    row, last = MECHANISM.first_metric, max(MECHANISM.rows)
    assert problem(MECHANISM, metrics=(second, first, *others)) == (
        f"rows has 'grashof_margin' at {row + 1}, the declaration at {row}"
    )
    assert problem(MECHANISM, metrics=(first, second, *others, Metric("area", "mm^2", "area"))) == (
        f"rows has 'area' at absent, the declaration at {last + 1}"
    )
    assert problem(MECHANISM, metrics=(first, second, *others[:-1])) == (
        f"rows has 'transmission_angle_max' at {last}, the declaration at absent"
    )


def test_parameters_have_the_kernels_order():
    first, second, *others = MECHANISM.parameters
    row = MECHANISM.first_parameter
    assert problem(MECHANISM, parameters=(second, first, *others)) == (
        f"rows has 'coupler' at {row + 1}, the declaration at {row}"
    )
    shifted = IntEnum("Shifted", {row.name: row.value + (row > RIG.status_row) for row in RIG.rows})
    row = RIG.first_parameter
    assert problem(RIG, rows=shifted) == f"rows has 'crank' at {row + 1}, the declaration at {row}"


def test_the_status_follows_the_constants():
    count = MECHANISM.n_constants
    assert problem(MECHANISM, n_constants=count + 1) == (
        f"the row of the status is {count}; it follows the {count + 1} constants"
    )
    without = IntEnum("Without", {row.name: row.value for row in MECHANISM.rows if row.name != "STATUS"})
    assert problem(MECHANISM, rows=without) == f"the row of the status is absent; it follows the {count} constants"


@pytest.mark.parametrize("row", [-2, RIG.n_constants])
@pytest.mark.parametrize("field", ["noise_row", "phases_row", "variant_row"])
def test_optional_constants_exist(field, row):
    assert problem(RIG, **{field: row}) == (
        f"{field} names the row {row}, which is not one of the {RIG.n_constants} constants"
    )


def test_fill_reads_constants():
    count = RIG.n_constants
    assert problem(RIG, n_fill_constants=count + 1) == f"fill reads {count + 1} constants of {count}"


@pytest.mark.parametrize("row", [-1, RIG.n_constants])
def test_constants_of_marks_and_singularities_exist(row):
    sentence = f"names the row {row}, which is not one of the {RIG.n_constants} constants"
    assert problem(RIG, marks={**RIG.marks, "extended": row}) == f"marks {sentence}"
    assert problem(RIG, quadrature=Graded(((row, 0),))) == f"singularities {sentence}"


def test_breaks_fit_into_the_buffers_of_panels():
    assert problem(RIG, breaks=("overlapped", "extended") * 4) == "breaks has 8 marks; at most 6 are used"


def test_jumps_are_at_breaks():
    assert problem(RIG, breaks=()) == "'opposing_torque' adds jumps, but no breaks say where"
    crank, *others = RIG.parameters
    others = [replace(crank, adds_jumps=True), *others]
    assert problem(RIG, parameters=tuple(others)) == "'crank' adds jumps, but is no load"


def test_laws_tell_breaks_or_senses():
    """Break 1 and a positive first sense are the same law."""
    both = "it has both breaks and senses; the law of a panel says only one of them"
    assert problem(RIG, senses=("rocker_velocity",)) == both
    names = (SIMPLE_SLIDER.signals[0].name,) * 17
    assert problem(SIMPLE_SLIDER, senses=names) == "senses has 17 signals; at most 16 are told"
    assert replace(SIMPLE_SLIDER, senses=names[:16]).senses == names[:16]


def test_a_graded_quadrature_has_singularities():
    assert problem(RIG, quadrature=Graded(())) == (
        "the quadrature is graded, but names no singularities; without them it is adaptive"
    )


def test_singularities_stand_at_an_anchor():
    row, _ = RIG.singularities[0]
    assert problem(RIG, quadrature=Graded(((row, 2),))) == (
        "singularities names the anchor 2; it is 0 or, for its opposite, 1"
    )


def test_windows_end_at_marks():
    arc = RIG.strokes[0]
    assert problem(RIG, windows=changed(RIG.windows, arc, ends=("overlapped", "stretched"))) == (
        f"the window '{arc}' names the mark 'stretched', which does not exist"
    )
    for name, ends in ((arc, ("extended",)), ("cycle", ("extended", "overlapped"))):
        assert problem(RIG, windows=changed(RIG.windows, name, ends=ends)) == (
            f"the window '{name}' has {len(ends)} ends; an arc has two marks, no other kind has any"
        )


def test_a_drive_needs_two_strokes():
    assert problem(MECHANISM, strokes=()) == "the window 'drive' needs two strokes"
    assert problem(RIG, strokes=("cycle", RIG.strokes[0])) == "the stroke 'cycle' is not an arc"
    assert problem(MECHANISM, drives=()) == "the window 'drive' needs drives"


def test_a_clutch_needs_the_number_of_linkages_and_the_derivative_of_its_output():
    assert problem(MECHANISM, phases_row=-1) == "the window 'clutch' needs a phases_row"
    signals = changed(MECHANISM.signals, "rocker_acceleration", derivative_of="")
    assert problem(MECHANISM, signals=signals) == (
        "the window 'clutch' needs a signal that is the derivative of 'output_velocity'"
    )


@pytest.mark.parametrize(
    ("field", "row"), [("row", -1), ("row", SIGNAL_ROWS), ("terms_row", -2), ("terms_row", SIGNAL_ROWS)]
)
def test_rows_exist(field, row):
    signals = changed(RIG.signals, "coupler_force", **{field: row})
    assert problem(RIG, signals=signals) == (
        f"{field} {row} of the signal 'coupler_force' is not one of the {SIGNAL_ROWS} rows"
    )


def test_lengths_say_what_they_are_relative_to():
    position, velocity = SIMPLE_SLIDER.signals
    assert SIMPLE_SLIDER.reference(replace(velocity, relative_to="")).name == "rod"
    assert problem(SIMPLE_SLIDER, signals=(replace(position, relative_to=""), velocity)) == (
        "the signal 'position' is in mm; relative_to names the length that it grows with"
    )
    assert problem(SIMPLE_SLIDER, signals=(replace(position, relative_to="road"), velocity)) == (
        "relative_to of 'position' names the length 'road', which does not exist"
    )
    assert problem(RIG, signals=changed(RIG.signals, "rocker_angle", relative_to="bearing_rating")) == (
        "relative_to of 'rocker_angle' names the length 'bearing_rating', which does not exist"
    )
    shared = changed(MECHANISM.signals, "output_velocity", relative_to="crank")
    assert problem(MECHANISM, signals=shared) == (
        "the signals 'output_velocity' and 'rocker_velocity' share a row, but differ in relative_to"
    )


def test_corners_are_at_the_zeros_of_a_signal():
    assert problem(RIG, signals=changed(RIG.signals, "positive_power", corners_at=("torque",))) == (
        "corners_at of 'positive_power' names the signal 'torque', which does not exist"
    )
    assert problem(RIG, signals=changed(RIG.signals, "positive_power", has_corners=False)) == (
        "corners_at of 'positive_power' names a signal, but 'positive_power' is not declared to have corners"
    )


def test_no_signal_is_its_own_derivative():
    position, velocity = SIMPLE_SLIDER.signals
    assert problem(SIMPLE_SLIDER, signals=(replace(position, derivative_of="velocity"), velocity)) == (
        "the signal 'position' is, by derivative_of, a derivative of itself"
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
        ({"strokes": ("drive", "stroke")}, "strokes names the window 'stroke'"),
        ({"breaks": ("extended", "top")}, "breaks names the mark 'top'"),
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
    signals = changed(MECHANISM.signals, "rocker_angle", extremes_at=("overlap",))
    assert problem(MECHANISM, signals=signals).startswith("extremes_at of 'rocker_angle' names the mark 'overlap'")
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


@pytest.mark.parametrize("mechanism", MECHANISMS.values(), ids=MECHANISMS)
def test_no_closed_form_depends_on_the_neighbours_of_a_design(mechanism, load):
    """Designs alone, and in tiles with others that cannot turn or are no numbers, which are filled up at the end."""
    count = 2 * LANES + 3
    drawn = draw_designs(load(starter(mechanism)), count, 0)
    designs = np.array([drawn.get(p.name, np.full(count, p.default)) for p in mechanism.kernel_parameters])
    designs[1, 5], designs[0, 20], designs[:, 30] = np.nan, 1e5, 0.0
    together, constants = mechanism.evaluate_closed_form(designs), mechanism.constants(designs)
    alone = [mechanism.evaluate_closed_form(designs[:, [k]]) for k in range(count)]
    assert len(set(together.status.tolist())) > 1
    assert np.array_equal(together.status, np.concatenate([one.status for one in alone]))
    assert np.array_equal(together.metrics, np.concatenate([one.metrics for one in alone], axis=1), equal_nan=True)
    alone = np.concatenate([mechanism.constants(designs[:, [k]]) for k in range(count)], axis=1)
    assert np.array_equal(constants, alone, equal_nan=True)


def test_the_closed_form_takes_any_real_array():
    design = [[100], [300], [250], [350], [3], [1]]
    result = MECHANISM.evaluate_closed_form(np.array(design))
    ordered = np.asfortranarray(np.repeat(np.array(design, dtype=float), 2, axis=1))
    twice = MECHANISM.evaluate_closed_form(ordered)
    assert result.metrics.shape == (len(MECHANISM.metrics), 1)
    for field in ("metrics", "status"):
        one, two = getattr(result, field), getattr(twice, field)
        assert np.array_equal(np.take(two, [0], axis=int(field == "metrics")), one)
    assert np.array_equal(MECHANISM.constants(ordered)[:, :1], MECHANISM.constants(np.array(design)))
    assert MECHANISM.constants(ordered).shape == (MECHANISM.n_constants, 2)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({}, "its extended mechanism has no more signal rows"),
        ({"summary": "another"}, "its extended mechanism differs in summary"),
        ({"signal_rows": 40, "kernel_version": "9"}, "its extended mechanism differs in kernel_version"),
    ],
)
def test_an_extended_mechanism_is_the_same_with_more_signals(changes, sentence):
    assert problem(SIMPLE_SLIDER, extended=replace(SIMPLE_SLIDER, **changes)) == sentence


def test_a_mechanism_with_an_extended_one_takes_all_that_the_motion_depends_on():
    mechanism = MECHANISMS["crank-rocker"]
    others = [row for row in mechanism.rows if row.name != "ROCKER"]
    rows = IntEnum("Rows", {row.name: row.value - (row > mechanism.rows["ROCKER"]) for row in others})
    assert problem(mechanism, rows=rows) == "rows has no 'rocker', on which the motion depends"


@pytest.mark.parametrize("name", MECHANISMS)
def test_formulas_can_be_pickled(name):
    """Requests are sent to workers; pickle takes functions by their names."""
    mechanism = MECHANISMS[name].extended or MECHANISMS[name]
    sent = pickle.loads(pickle.dumps(mechanism.formulas))
    assert [formula.name for formula in sent] == [formula.name for formula in mechanism.formulas]
