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
ROCKER_ROW = next(signal.row for signal in MECHANISM.signals if signal.name == "rocker_velocity")


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


@pytest.mark.parametrize("code", [*Status, 12, 19, 128, -1])
def test_own_statuses_have_codes_of_their_own(code):
    assert problem(MECHANISM, statuses={int(code): OwnStatus("stuck", "it is stuck")}) == (
        f"the status 'stuck' has the code {int(code)}; a mechanism's own are 2 to 5 and 20 to 127"
    )


@pytest.mark.parametrize("default", [0.0, 13.0, 2.5, np.nan])
def test_defaults_are_in_range(default):
    parameters = changed(MECHANISM.parameters, "phases", default=default)
    assert problem(MECHANISM, parameters=parameters) == f"the default {default:g} of 'phases' is outside its own range"


@pytest.mark.parametrize("row", [-2, RIG.n_constants])
@pytest.mark.parametrize("field", ["noise_row", "phases_row", "variant_row"])
def test_optional_constants_exist(field, row):
    assert problem(RIG, **{field: row}) == (
        f"{field} names the row {row}, which is not one of the {RIG.n_constants} constants"
    )


@pytest.mark.parametrize("row", [-1, RIG.n_constants])
def test_constants_of_marks_and_singularities_exist(row):
    sentence = f"names the row {row}, which is not one of the {RIG.n_constants} constants"
    assert problem(RIG, marks={**RIG.marks, "extended": row}) == f"marks {sentence}"
    assert problem(RIG, quadrature=Graded(((row, 0),))) == f"singularities {sentence}"


SLIDER = SIMPLE_SLIDER
STUCK = OwnStatus("stuck", "it is stuck")
NOTHING = "a mechanism has at least one parameter, and a closed-form metric or a signal"
WHOLE = "windows are the full turn or the range of input angles; exactly one is"
BOTH = "it has both breaks and senses; the law of a panel says only one of them"
CYCLE, *PARTS = RIG.windows
ARC, OTHER = RIG.strokes
POSITION, VELOCITY = SLIDER.signals
FIRST, SECOND, *METRICS = MECHANISM.metrics
LAST = max(MECHANISM.rows)
#: Changes of a mechanism, and what refuses them.
CONTRADICTIONS = [
    (RIG, {"formulas": changed(RIG.formulas, "pin_diameter", name="swing_angle")},
     "the metric 'swing_angle' is declared twice"),
    (MECHANISM, {"drives": ("slow", "fast", "slow")}, "the drive 'slow' is declared twice"),
    (MECHANISM, {"drives": ("slow", "cycle")}, "the drive 'cycle' is neither slow nor fast nor a stroke"),
    (MECHANISM, {"parameters": changed(MECHANISM.parameters, "phases", scales_speed=True)},
     "2 parameters scale the speed, speed and phases; at most one does"),
    (MECHANISM, {"parameters": tuple(replace(p, scales_speed=False, is_dynamic=False) for p in MECHANISM.parameters)},
     "the signal 'coupler_velocity' has a power of the speed, but no parameter scales the speed"),
    (RIG, {"parameters": changed(RIG.parameters, "speed", scales_speed=False)},
     "'damping' makes loads depend on the speed, but no parameter scales the speed"),
    (MECHANISM, {"statuses": {20: STUCK, 21: STUCK}}, "two statuses have the label 'stuck'"),
    (MECHANISM, {"statuses": {20: replace(STUCK, label="screened")}}, "two statuses have the label 'screened'"),
    (MECHANISM, {"parameters": ()}, NOTHING),
    (MECHANISM, {"metrics": (), "signals": ()}, NOTHING),
    (MECHANISM, {"loop_lengths": ("crank",)}, "loop_lengths has only 'crank'; a loop has at least two lengths"),
    (MECHANISM, {"loop_lengths": ("crank", "speed")}, "loop_lengths names 'speed', which is not a length"),
    (MECHANISM, {"loop_lengths": ("crank", "phases")}, "loop_lengths names 'phases', which is not a length"),
    (RIG, {"loop_lengths": ("crank", "inertia")}, "loop_lengths names 'inertia', which is not a length"),
    (MECHANISM, {"metrics": changed(MECHANISM.metrics, "swing_angle", name="crank")},
     "'crank' is a parameter and a metric"),
    (MECHANISM, {"metrics": changed(MECHANISM.metrics, "swing_angle", name="error")},
     "'error' is the name of a column of all results"),
    (MECHANISM, {"input_angle": "rocker angle"}, "the signal 'rocker_angle' has the name of the input angle"),
    (MECHANISM, {"parameters": changed(MECHANISM.parameters, "crank", upper=0.0)},
     "the range of 'crank' is empty: above 0, up to 0"),
    (MECHANISM, {"parameters": changed(MECHANISM.parameters, "branch", lower=-1.0)},
     "the choice -1 of 'branch' is outside its own range"),
    *((MECHANISM, {name: getattr(MECHANISM, name).py_func},
       f"{name} is not compiled; decorate it with explore.base.compiling.compiled") for name in ("close", "fill")),
    *((MECHANISM, {name: MECHANISM.fill}, "precise_fill and disturbed_precise_fill are given together")
      for name in ("precise_fill", "disturbed_precise_fill")),
    (RIG, {"windows": tuple(PARTS)}, f"0 {WHOLE}"),
    (RIG, {"windows": (*RIG.windows, replace(CYCLE, name="turn"))}, f"2 {WHOLE}"),
    (RIG, {"windows": (*PARTS, Window("range", "a range", "interval"))},
     "the window 'range' limits the input angle, which needs takes_interval"),
    (RIG, {"windows": changed(RIG.windows, "cycle", name="interval")},
     "the window 'interval' is of kind 'turn'; that name is of explicit angles"),
    (RIG, {"windows": changed(RIG.windows, ARC, ends=("extended", "extended"))},
     f"the window '{ARC}' ends where it begins, at the mark 'extended'"),
    (RIG, {"windows": changed(RIG.windows, ARC, ends=("extended", "overlapped"))},
     f"the strokes '{ARC}' and '{OTHER}' do not make up the turn"),
    (MECHANISM, {"signals": changed(MECHANISM.signals, "coupler_velocity", pole_order=3)},
     "pole_order of the signal 'coupler_velocity' is 3; it is 2, 4 or 6"),
    (MECHANISM, {"metrics": (SECOND, FIRST, *METRICS)},
     f"rows has 'grashof_margin' at {MECHANISM.first_metric + 1}, the declaration at {MECHANISM.first_metric}"),
    (MECHANISM, {"metrics": (FIRST, SECOND, *METRICS, Metric("area", "mm^2", "area"))},
     f"rows has 'area' at absent, the declaration at {LAST + 1}"),
    (MECHANISM, {"metrics": (FIRST, SECOND, *METRICS[:-1])},
     f"rows has 'transmission_angle_max' at {LAST}, the declaration at absent"),
    (MECHANISM, {"parameters": (MECHANISM.parameters[1], MECHANISM.parameters[0], *MECHANISM.parameters[2:])},
     f"rows has 'coupler' at {MECHANISM.first_parameter + 1}, the declaration at {MECHANISM.first_parameter}"),
    (RIG, {"rows": IntEnum("Shifted", {row.name: row.value + (row > RIG.status_row) for row in RIG.rows})},
     f"rows has 'crank' at {RIG.first_parameter + 1}, the declaration at {RIG.first_parameter}"),
    (MECHANISM, {"n_constants": MECHANISM.n_constants + 1},
     f"the row of the status is {MECHANISM.n_constants}; it follows the {MECHANISM.n_constants + 1} constants"),
    (MECHANISM, {"rows": IntEnum("Without", {row.name: row.value for row in MECHANISM.rows if row.name != "STATUS"})},
     f"the row of the status is absent; it follows the {MECHANISM.n_constants} constants"),
    (RIG, {"n_fill_constants": RIG.n_constants + 1},
     f"fill reads {RIG.n_constants + 1} constants of {RIG.n_constants}"),
    (RIG, {"breaks": ("overlapped", "extended") * 4}, "breaks has 8 marks; at most 6 are used"),
    (RIG, {"breaks": ()}, "'opposing_torque' adds jumps, but no breaks say where"),
    (RIG, {"parameters": changed(RIG.parameters, "crank", adds_jumps=True)}, "'crank' adds jumps, but is no load"),
    (RIG, {"senses": ("rocker_velocity",)}, BOTH),
    (SLIDER, {"senses": (POSITION.name,) * 17}, "senses has 17 signals; at most 16 are told"),
    (RIG, {"quadrature": Graded(())},
     "the quadrature is graded, but names no singularities; without them it is adaptive"),
    (RIG, {"quadrature": Graded(((RIG.singularities[0][0], 2),))},
     "singularities names the anchor 2; it is 0 or, for its opposite, 1"),
    (RIG, {"windows": changed(RIG.windows, ARC, ends=("overlapped", "stretched"))},
     f"the window '{ARC}' names the mark 'stretched', which does not exist"),
    *((RIG, {"windows": changed(RIG.windows, name, ends=ends)},
       f"the window '{name}' has {len(ends)} ends; an arc has two marks, no other kind has any")
      for name, ends in ((ARC, ("extended",)), ("cycle", ("extended", "overlapped")))),
    (MECHANISM, {"strokes": ()}, "the window 'drive' needs two strokes"),
    (RIG, {"strokes": ("cycle", ARC)}, "the stroke 'cycle' is not an arc"),
    (MECHANISM, {"drives": ()}, "the window 'drive' needs drives"),
    (MECHANISM, {"phases_row": -1}, "the window 'clutch' needs a phases_row"),
    (MECHANISM, {"signals": changed(MECHANISM.signals, "rocker_acceleration", derivative_of="")},
     "the window 'clutch' needs a signal that is the derivative of 'output_velocity'"),
    *((RIG, {"signals": changed(RIG.signals, "coupler_force", **{field: row})},
       f"{field} {row} of the signal 'coupler_force' is not one of the {SIGNAL_ROWS} rows")
      for field, row in (("row", -1), ("row", SIGNAL_ROWS), ("terms_row", -2), ("terms_row", SIGNAL_ROWS))),
    (SLIDER, {"signals": (replace(POSITION, relative_to=""), VELOCITY)},
     "the signal 'position' is in mm; relative_to names the length that it grows with"),
    (SLIDER, {"signals": (replace(POSITION, relative_to="road"), VELOCITY)},
     "relative_to of 'position' names the length 'road', which does not exist"),
    (RIG, {"signals": changed(RIG.signals, "rocker_angle", relative_to="bearing_rating")},
     "relative_to of 'rocker_angle' names the length 'bearing_rating', which does not exist"),
    (MECHANISM, {"signals": changed(MECHANISM.signals, "output_velocity", relative_to="crank")},
     "the signals 'output_velocity' and 'rocker_velocity' share a row, but differ in relative_to"),
    (RIG, {"signals": changed(RIG.signals, "positive_power", corners_at=("torque",))},
     "corners_at of 'positive_power' names the signal 'torque', which does not exist"),
    (RIG, {"signals": changed(RIG.signals, "positive_power", has_corners=False)},
     "corners_at of 'positive_power' names a signal, but 'positive_power' is not declared to have corners"),
    (SLIDER, {"signals": (replace(POSITION, derivative_of="velocity"), VELOCITY)},
     "the signal 'position' is, by derivative_of, a derivative of itself"),
    (MECHANISM, {"signals": changed(MECHANISM.signals, "coupler_velocity", row=ROCKER_ROW)},
     f"two signals have the row {ROCKER_ROW}; the second must say so in shares_row_with"),
    (RIG, {"signals": changed(RIG.signals, "power", pole_order=4)},
     "the signals 'power' and 'drive_torque' share a row, but differ in pole_order"),
    (RIG, {"signals": changed(RIG.signals, "power", shares_row_with="torque")},
     "the signal 'power' names the signal 'torque', which does not exist"),
    *((MECHANISM, changes, f"{sentence}, which does not exist") for changes, sentence in (
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
    )),
    *((MECHANISM, {field: {"cycle": getattr(MECHANISM, field)[""]}},
       f"{field} has no entry '' for the windows that it does not name")
      for field in ("output_signals", "default_metrics")),
    (MECHANISM, {"parameters": changed(MECHANISM.parameters, "phases", only_in=("turn",))},
     "only_in of 'phases' names the window 'turn', which does not exist"),
    (MECHANISM, {"signals": changed(MECHANISM.signals, "output_velocity", only_in=("turn",))},
     "only_in of 'output_velocity' names the window 'turn', which does not exist"),
    (MECHANISM, {"signals": changed(MECHANISM.signals, "rocker_velocity", derivative_of="rocker")},
     "derivative_of of 'rocker_velocity' names the signal 'rocker', which does not exist"),
    (MECHANISM, {"signals": changed(MECHANISM.signals, "rocker_angle", extremes_at=("overlap",))},
     "extremes_at of 'rocker_angle' names the mark 'overlap', which does not exist"),
    (RIG, {"signals": changed(RIG.signals, "coupler_force", required_loads=("torque",))},
     "the signal 'coupler_force' names the parameter 'torque', which does not exist"),
    *((RIG, {"formulas": changed(RIG.formulas, "buckling_factor", **{field: ("thickness",)})},
       f"the formula 'buckling_factor' names the {kind} 'thickness', which does not exist")
      for field, kind in (("inputs", "input"), ("alternatives", "parameter"), ("optional", "parameter"))),
    (MECHANISM, {"objectives": ("cv:least",)},
     "the objective 'cv:least' has no sense 'min' or 'max' after its colon"),
    (SLIDER, {"extended": SLIDER}, "its extended mechanism has no more signal rows"),
    (SLIDER, {"extended": replace(SLIDER, summary="another")}, "its extended mechanism differs in summary"),
    (SLIDER, {"extended": replace(SLIDER, signal_rows=40, kernel_version="9")},
     "its extended mechanism differs in kernel_version"),
]  # fmt: skip


@pytest.mark.parametrize(("mechanism", "changes", "sentence"), CONTRADICTIONS)
def test_a_contradiction_is_refused(mechanism, changes, sentence):
    assert problem(mechanism, **changes) == sentence


def test_as_many_senses_as_are_told():
    assert replace(SLIDER, senses=(POSITION.name,) * 16).senses == (POSITION.name,) * 16
    assert SLIDER.reference(replace(VELOCITY, relative_to="")).name == "rod"


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
