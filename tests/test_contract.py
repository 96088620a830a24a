"""Every registered mechanism keeps its promises, and a mechanism that breaks one is told so."""

import re
from dataclasses import replace

import numpy as np
import pytest
from distributed import Client, LocalCluster
from linkage_cases import FOUR_BAR
from pandas.testing import assert_frame_equal
from simple_slider import SIMPLE_SLIDER
from toy_mechanism import PEAK, STUDY, WRONG_PEAK

import explore
from explore import Linkage
from explore.base.compiling import FILL_SIGNATURE, LANES, compiled
from explore.evaluation import sampled
from explore.mechanisms.registry import MECHANISMS
from explore.mechanisms.rocking import CANNOT_ASSEMBLE
from explore.model.mechanism import Mechanism
from explore.model.status import Status
from explore.studies.config.study_file import starter
from explore.testing import check_mechanism, dense_statistics
from explore.testing.commands import failing_commands
from explore.testing.contract import draw_designs
from explore.testing.derivatives import wrong_derivatives
from explore.testing.extremes import wrong_extremes
from explore.testing.invariance import changes_with_the_anchor, changes_with_the_block, changes_with_units
from explore.testing.statistics import wrong_statistics
from explore.testing.statuses import wrong_statuses
from explore.testing.subject import Subject

CRANK_ROCKER = MECHANISMS["crank-rocker"]
PLAIN = {"crank": [100.0, 90.0], "coupler": 1083.4236, "rocker": 541.7118, "ground": [691.7118, 700.0]}
#: All loads that a four-bar has, with jumps between the strokes.
LOADED_FOUR_BAR = """
[parameters]
crank = { start = 60, stop = 110, num = 3 }
coupler = { start = 460, stop = 900, num = 3 }
rocker = [400, 595]
ground = 751
speed = "12 Hz"
constant_torque = [-20e3, 25e3]
opposing_torque = 5e3
stiffness = 143e3
damping = 100
inertia = 8
crank_mass = 40
coupler_mass = 25
rocker_mass = 60
crank_centroid = [-0.2, 0.6]
coupler_inertia = 2
rocker_inertia = 5
"""
#: Points of a link, with a metric of their own.
POINTS = """
[points]
knife = { along = [100, 420], across = { start = -60, stop = 60, num = 2 } }
[constraints]
knife_y_peak_to_peak = { max = 2000 }
[metrics]
span = { formula = "knife_x_peak_to_peak / knife_along", unit = "1" }
[rank]
metrics = ["pin_force_peak", "knife_curvature_mean:min", "span:max"]
"""
#: Mechanisms under all their loads; four-bars of both branches, and a drag link, whose rocker does not swing.
LOADED = {
    "test-rig": f"""{LOADED_FOUR_BAR}
allowed_stress = 116.7
allowed_shear = 80
bearing_rating = "44.6 kN"
[evaluate]
metrics = ["swing_angle", "drive_torque_peak", "pin_force_peak", "knife_x_max", "knife_curvature_mean"]
""",
    "crank-rocker": f"""{LOADED_FOUR_BAR}
branch = [1, -1]
[evaluate]
window = "cycle"
metrics = ["swing_angle", "drive_torque_peak", "pin_force_peak", "positive_work", "knife_x_max", "knife_curvature_mean"]
""",
    "slider-crank": """
[parameters]
crank = { start = 40, stop = 80, num = 3 }
rod = { start = 150, stop = 300, num = 3 }
offset = [-30, 0, 40]
speed = "90 rpm"
constant_force = [-200, 300]
opposing_force = 150
stiffness = 2000
damping = 40
mass = 8
friction = [0, 0.15]
crank_mass = 3
crank_centroid = [-0.2, 0.6]
rod_mass = 2
rod_centroid = 0.3
rod_inertia = 0.01
[evaluate]
metrics = ["stroke", "drive_torque_peak", "pin_force_peak", "net_work", "knife_x_max", "knife_curvature_mean"]
""",
}


def loaded_study(name):
    """The study of a mechanism under loads with points."""
    return f'mechanism = "{name}"{LOADED[name]}{POINTS}'


def broken_promises(mechanism, **options):
    """The lines that `check_mechanism` raises with."""
    try:
        check_mechanism(mechanism, **options)
    except AssertionError as error:
        return str(error).splitlines()
    return []


def plain(mechanism, **changes):
    """Two ordinary designs of a crank-rocker with changes."""
    columns = {name: np.broadcast_to(np.array(values, dtype=float), 2).copy() for name, values in PLAIN.items()}
    extended = mechanism.extended and replace(mechanism.extended, **changes)
    return Subject(replace(mechanism, extended=extended, **changes), columns)


def with_closed_form(monkeypatch, change):
    """Two ordinary designs of a crank-rocker whose closed form is changed by a function of its arrays."""
    subject = plain(CRANK_ROCKER)
    evaluate_closed_form = Mechanism.evaluate_closed_form

    def changed(mechanism, parameters, **options):
        result = evaluate_closed_form(mechanism, parameters, **options)
        change(metrics=result.metrics, status=result.status)
        return result

    monkeypatch.setattr(Mechanism, "evaluate_closed_form", changed)
    return subject


@pytest.mark.parametrize("designs", [8, pytest.param(24, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", sorted(MECHANISMS))
def test_registered_mechanisms_keep_their_promises(name, designs):
    check_mechanism(MECHANISMS[name], designs=designs)


@pytest.fixture(scope="module")
def client():
    """A client of a cluster with one worker, a process."""
    settings = {"n_workers": 1, "threads_per_worker": 1, "processes": True, "dashboard_address": "127.0.0.1:0"}
    with LocalCluster(**settings) as cluster, Client(cluster, set_as_default=False) as client:
        yield client


@pytest.mark.parametrize("name", sorted(MECHANISMS))
def test_every_mechanism_sweeps_in_processes(name, client, tmp_path):
    """The study of `explore init`, on a process that loads the mechanism by its name, gives the same columns."""
    (tmp_path / "study.toml").write_text(starter(MECHANISMS[name]))
    study = explore.load_study(tmp_path / "study.toml")
    there = explore.sweep(study, tmp_path / "process.h5", client=client)
    here = explore.sweep(study, tmp_path / "threads.h5")
    assert_frame_equal(there.to_pandas(), here.to_pandas(), check_exact=True)


@pytest.mark.parametrize("name", LOADED)
def test_mechanisms_with_points_keep_their_promises_under_loads(name):
    check_mechanism(MECHANISMS[name], study=loaded_study(name), designs=3)


@pytest.mark.parametrize("mechanism", [PEAK, WRONG_PEAK], ids=["adaptive", "wrongly graded"])
def test_a_mechanism_with_nothing_known_of_its_singularities_keeps_its_promises(mechanism):
    check_mechanism(mechanism, study=STUDY)
    assert "peak" not in MECHANISMS


def test_a_mechanism_of_lengths_without_a_speed_keeps_its_promises():
    """Signals in mm, an offset of either sign, statuses of its own, and a starter that is no file of the package."""
    check_mechanism(SIMPLE_SLIDER, designs=12)


def test_a_singularity_where_none_is_expected(monkeypatch):
    """Without the check of the samples, so that values are wrong."""
    monkeypatch.setattr(sampled, "LARGEST_EXCESS", np.inf)
    broken = broken_promises(WRONG_PEAK, study=STUDY, designs=4)
    sentence = (
        r"peak: height_\w+_cycle over 'cycle' is [\d.e-]+, by dense sampling [\d.e-]+: relative error .*distance = "
    )
    assert any(re.match(sentence, line) for line in broken), broken


def test_dense_sampling_agrees_with_the_exact_moments_of_a_peak():
    # of 1/(a - cos x) over a turn: mean 1/sqrt(a^2 - 1), mean square a/sqrt(a^2 - 1)^3
    for distance in (1e-8, 1e-4, 3.0):
        a = 1.0 + distance
        root = np.sqrt(distance * (2.0 + distance))
        subject = Subject(PEAK, {"distance": np.array([distance])})
        panels = dense_statistics.sample(lambda angle, subject=subject: subject.motion(0, angle), 0.0, 360.0)
        values, errors = dense_statistics.measure(lambda angle, subject=subject: subject.motion(0, angle), panels)
        # beside the promised bound: cancellation in the signal itself, half an ulp of 1 over the distance
        rounding = 1e-15 + 3e-16 / distance
        assert abs(values.mean[0] - 1.0 / root) <= errors.mean[0] + rounding / root
        variance = a / root**3 - 1.0 / root**2
        assert abs(values.variance[0] - variance) <= errors.variance[0] + 2.0 * rounding * variance
        assert abs(values.max[0] * distance - 1.0) <= errors.max[0] * distance + rounding
        assert abs(values.min[0] * (1.0 + a) - 1.0) <= errors.min[0] * (1.0 + a) + 1e-15
        assert errors.mean[0] * root <= 1e-11 + 10.0 * rounding


def test_dense_sampling_knows_the_rounding_of_its_samples():
    """Of a mean of 0, which has none itself: samples may be off by some units in the last place, all alike."""
    error = 8.0 * np.spacing(1.0)

    def motion(angle):
        return (np.sin(np.deg2rad(angle)) + error)[None]

    values, errors = dense_statistics.measure(motion, dense_statistics.sample(motion, 0.0, 360.0))
    assert abs(values.mean[0]) <= errors.mean[0] <= 1e-14


def test_dense_sampling_finds_jumps():
    """Wherever they are: of 300 places some are beyond the last node of a panel."""
    for place in np.random.default_rng(0).uniform(1.0, 359.0, 300):

        def motion(angle, place=place):
            return np.where(angle < place, 0.0, 1.0)[None]

        values, _ = dense_statistics.measure(motion, dense_statistics.sample(motion, 0.0, 360.0))
        # the smallest panels are 1e-11 deg long
        assert values.mean[0] == pytest.approx(1.0 - place / 360.0, abs=1e-12)
        assert values.min[0] == pytest.approx(0.0, abs=1e-12)
        assert values.max[0] == pytest.approx(1.0, abs=1e-12)


def test_dense_sampling_knows_what_it_misses_beside_a_jump():
    """An extreme at a jump, on a slope: it is on a panel where none is looked for."""
    for place in np.random.default_rng(0).uniform(1.0, 359.0, 100):

        def motion(angle, place=place):
            return np.where(angle < place, 1.0, np.exp(0.02 * (place - angle)) + 1.0)[None]

        values, errors = dense_statistics.measure(motion, dense_statistics.sample(motion, 0.0, 360.0))
        assert abs(values.max[0] - 2.0) <= errors.max[0] <= 1e-11  # some panels of 1e-11 deg


def test_designs_are_drawn_around_those_of_the_study(load):
    study = load(starter(CRANK_ROCKER))
    drawn = draw_designs(study, 2_000, 0)
    assert set(drawn) == {"crank", "coupler", "rocker", "ground", "speed", "phases", "branch"}
    assert drawn["crank"].min() == pytest.approx(60.0 / 3.0, rel=0.01)
    assert drawn["crank"].max() == pytest.approx(140.0 * 3.0, rel=0.01)
    assert np.median(drawn["crank"]) == pytest.approx(np.sqrt(60.0 * 140.0), rel=0.1)
    assert set(drawn["branch"]) == {-1.0, 1.0}
    assert set(drawn["phases"]) == set(map(float, range(1, 13)))
    assert not np.array_equal(drawn["crank"], draw_designs(study, 2_000, 1)["crank"])
    loaded = draw_designs(load(loaded_study("test-rig")), 500, 0)
    assert -20e3 <= loaded["constant_torque"].min() < 0.0 < loaded["constant_torque"].max() <= 25e3


@pytest.mark.parametrize(
    "check",
    [
        wrong_derivatives, changes_with_units, changes_with_the_block, changes_with_the_anchor,
        wrong_statuses,
    ],
)  # fmt: skip
def test_no_promise_of_ordinary_designs_is_broken(check):
    assert list(check(plain(CRANK_ROCKER))) == []


def test_a_metric_that_designs_may_lack_is_declared_so():
    """A crank that turns has one interval in which all joints assemble, of the four that a linkage may have."""
    lengths = {"r1": [30.0, 200.0], "r2": [90.0, 90.0], "r3": [70.0, 70.0], "r4": [100.0, 100.0]}
    designs = {name: np.array(column) for name, column in lengths.items()}
    mechanism = Linkage(FOUR_BAR).mechanism
    assert list(wrong_statuses(Subject(mechanism, designs))) == []
    complete = [replace(metric, is_partial=False) for metric in mechanism.metrics]
    broken = list(wrong_statuses(Subject(replace(mechanism, metrics=tuple(complete)), designs)))
    assert broken
    assert all(
        re.match("assembles_(from|to)_[234] over .* is undefined in spite of the status 'ok'", b) for b in broken
    )


#: A four-bar as a table whose loads are parameters, with jumps where two links turn back.
LOADED_TABLE = FOUR_BAR | {
    "output": "rocker",
    "loads": {
        "gravity": [0, "g"],
        "masses": {"B": "m", "coupler": {"mass": "q", "centroid": ["r2 / 2", 0], "inertia": "j"}},
        "forces": {"B": ["f", 0]},
        "torques": {"rocker": {"torque": "t", "against": "coupler"}},
        "opposing": {"rocker": "u", "coupler": "u"},
        "springs": {"pull": {"between": ["O", "B"], "rate": "k", "rest": "l"}},
        "dampers": {"hinge": {"between": "rocker", "rate": "d"}},
    },
}
LOADED_DESIGNS = {
    "r1": [20.0, 28.0], "r2": [85.0, 90.0], "r3": [70.0, 75.0], "r4": [100.0, 104.0], "g": [-9.81, -9.0],
    "m": [0.5, 0.4], "q": [0.8, 0.2], "j": [0.001, 0.002], "f": [12.0, -3.0], "t": [0.4, -0.2], "u": [0.7, 0.1],
    "k": [300.0, 200.0], "l": [90.0, 30.0], "d": [0.05, 0.1], "speed": [6.0, 9.0],
}  # fmt: skip


@pytest.mark.parametrize("check", [wrong_derivatives, wrong_statuses, changes_with_the_block, changes_with_units])
def test_a_table_under_load_keeps_promises(check):
    """The joint of coupler and rocker rests at the ends of strokes, where its curvature and its status are rounding."""
    designs = {name: np.array(column) for name, column in LOADED_DESIGNS.items()}
    broken = check(Subject(Linkage(LOADED_TABLE).mechanism, designs))
    assert [line for line in broken if "curvature" not in line and not line.startswith("status over 'return'")] == []


def test_a_wrong_derivative():
    signals = tuple(
        replace(signal, derivative_of="coupler_angle") if signal.name == "rocker_velocity" else signal
        for signal in CRANK_ROCKER.signals
    )
    (sentence,) = wrong_derivatives(plain(CRANK_ROCKER, signals=signals))
    assert sentence.startswith("rocker_velocity is not the derivative of coupler_angle: ")


def test_a_signal_about_one_anchor_only():
    @compiled(FILL_SIGNATURE)
    def fill(_constants, tangents, _anchor, _law, _variant, count, _needs, out):
        for k in range(count * LANES):
            out[k] = 1.0 / (1.0 + tangents[k] * tangents[k])

    subject = Subject(replace(WRONG_PEAK, fill=fill), {"distance": np.array([1.0])})
    (sentence,) = changes_with_the_anchor(subject)
    assert sentence.startswith("height at the half-tangent -1e-09 from anchor 0 is 1, and about the other anchor 1e-18")
    assert list(changes_with_the_anchor(Subject(WRONG_PEAK, {"distance": np.array([1.0])}))) == []


def test_a_mean_that_is_not_0():
    zero_mean = CRANK_ROCKER.zero_mean | {("transmission_angle", "cycle")}
    (sentence,) = wrong_statistics(plain(CRANK_ROCKER, zero_mean=zero_mean))
    assert sentence.startswith("transmission_angle_mean_cycle over 'cycle' (drive slow) is 0.0, by dense sampling ")


def test_a_wrong_unit():
    metrics = tuple(replace(m, unit="deg") if m.name == "grashof_margin" else m for m in CRANK_ROCKER.metrics)
    (sentence,) = changes_with_units(plain(CRANK_ROCKER, metrics=metrics))
    assert re.match("grashof_margin over 'cycle' is .* in a unit of length that is 1024 times smaller, for", sentence)


def test_a_length_compared_with_a_number(monkeypatch):
    def change(metrics, **_):
        metrics[1] = np.where(metrics[1] > 1000.0, np.nan, metrics[1])

    (sentence,) = changes_with_units(with_closed_form(monkeypatch, change))
    assert sentence.startswith("grashof_margin over 'cycle' is nan and not ")


def test_a_value_that_depends_on_the_block(monkeypatch):
    def change(metrics, **_):
        metrics[2] += np.spacing(metrics[2]) * np.arange(metrics.shape[1])

    (sentence,) = changes_with_the_block(with_closed_form(monkeypatch, change))
    assert sentence == "swing_angle over 'cycle' changes with the order of the designs"


def simple_sliders(offsets, monkeypatch=None, factor=1.0, **changes):
    """Simple sliders of three offsets with changes of the declaration of their position, and a factor on the stroke."""
    position = replace(SIMPLE_SLIDER.signals[0], **changes)
    if monkeypatch is not None:
        evaluate_closed_form = Mechanism.evaluate_closed_form

        def changed(mechanism, parameters, **options):
            result = evaluate_closed_form(mechanism, parameters, **options)
            result.metrics[0] *= factor
            return result

        monkeypatch.setattr(Mechanism, "evaluate_closed_form", changed)
    mechanism = replace(SIMPLE_SLIDER, signals=(position, *SIMPLE_SLIDER.signals[1:]))
    crank = np.linspace(40.0, 60.0, len(offsets))
    return Subject(mechanism, {"crank": crank, "rod": 3.0 * crank, "offset": np.array(offsets)})


def test_a_closed_form_that_is_not_the_statistic(monkeypatch):
    assert list(wrong_statistics(simple_sliders([0.0, 10.0]))) == []
    sentences = list(wrong_statistics(simple_sliders([0.0, 10.0], monkeypatch, 0.95)))
    assert [sentence.split(" is ")[0] for sentence in sentences] == ["stroke over 'cycle'"]


def test_a_worst_angle_that_is_not_the_worst():
    rig = MECHANISMS["test-rig"]
    worst = next(metric for metric in rig.metrics if metric.worst_of)
    subject = plain(rig)
    (found,) = (metric for name, metric in subject.closed_forms("cycle") if name == worst.name)
    assert (found.signal.name, found.statistic) == ("transmission_angle", "worst")


def test_a_closed_form_of_nothing():
    stroke, margin = SIMPLE_SLIDER.metrics
    for name in ("position_range_cycle", "margin"):
        with pytest.raises(ValueError, match=f"'stroke' is the closed form of '{name}', which is no statistic"):
            replace(SIMPLE_SLIDER, metrics=(replace(stroke, closed_form_of=name), margin))


def test_extremes_elsewhere_are_found_in_designs_that_are_drawn():
    """Of slider-cranks without an offset the dead centres are the anchor and its opposite."""
    centred = simple_sliders([0.0] * 4, extremes_at=("anchor", "opposite"))
    assert list(wrong_extremes(centred, None)) == []
    assert list(wrong_extremes(centred, lambda _: centred.designs)) == []
    (sentence,) = wrong_extremes(centred, lambda number: centred.designs | {"offset": np.full(4, 5.0 * number)})
    assert sentence.startswith("position has an extreme at none of its extremes_at, anchor, opposite, for crank = ")


def test_a_mark_that_is_no_extreme():
    signals = tuple(
        replace(signal, extremes_at=(*signal.extremes_at, "anchor")) if signal.name == "rocker_angle" else signal
        for signal in CRANK_ROCKER.signals
    )
    subject = plain(CRANK_ROCKER, signals=signals)
    assert list(wrong_extremes(subject, None)) == []
    (sentence,) = wrong_extremes(subject, lambda _: subject.designs)
    beginning = (
        "'anchor' in extremes_at of rocker_angle is where an extreme is for 0 of the 80 designs that were drawn; "
    )
    assert sentence.startswith(beginning)


@pytest.mark.parametrize(
    ("code", "beginning"),
    [
        (Status.PENDING, "a design over 'cycle' is still pending after its evaluation, for crank = "),
        (15, "a status over 'cycle' has a code that means nothing, for crank = "),
        (
            CANNOT_ASSEMBLE,
            "only 0 of 2 designs are computed; narrow the ranges of the study to designs that move, or give such",
        ),
    ],
)
def test_a_wrong_status(monkeypatch, code, beginning):
    def change(status, **_):
        status[:] = code

    assert any(sentence.startswith(beginning) for sentence in wrong_statuses(with_closed_form(monkeypatch, change)))


def test_a_command_that_fails(tmp_path):
    file = tmp_path / "study.toml"
    (sentence,) = failing_commands("crank-rocker", file)
    assert sentence.startswith("`explore sweep study.toml -o study.h5 --quiet` fails: ")
    file.write_text(
        starter(CRANK_ROCKER).replace("start = 60, stop = 140, num = 9", "start = 600, stop = 601, num = 2")
    )
    sentences = list(failing_commands("crank-rocker", file))
    assert any(sentence.startswith("`explore simulate study.toml --design 0 ") for sentence in sentences)
