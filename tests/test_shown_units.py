"""Units in which values are shown: which a column gets, exact conversions, results in them, wrong entries."""

from fractions import Fraction

import numpy as np
import pandas as pd
import pytest
from studies import FEW, crank_rockers, sweep_text, swept

import explore
from explore.base.units.quantities import quantity, unit_factor
from explore.base.units.shown import QUANTITIES, Scale, ShownUnits, read_shown_units
from explore.results.ranking.rankings import RankRequest, rank_source
from explore.studies.request.names import find_mechanism

INCHES = read_shown_units({"length": "in", "speed": "rpm"})


@pytest.mark.parametrize(
    ("chosen", "declared", "shown"),
    [
        ({"length": "in"}, "mm", "in"),
        ({"length": "in"}, "mm/s", "in/s"),
        ({"length": "in", "velocity": "m/s"}, "mm/s", "m/s"),
        ({"length": "in"}, "mm/s^2", "in/s^2"),
        ({"length": "in"}, "m/s^2", "in/s^2"),
        ({"length": "in"}, "mm^2", "in^2"),
        ({"length": "in"}, "mm^2/s^2", "in^2/s^2"),
        ({"length": "in", "velocity": "m/s"}, "mm^2/s^2", "m^2/s^2"),
        ({"length": "in"}, "1/mm", "1/in"),
        ({"length": "in", "angle": "rad"}, "deg/mm", "rad/in"),
        ({"length": "in"}, "N m", "N m"),
        ({"length": "in", "force": "lbf"}, "N m", "N m"),
        ({"torque": "lbf in"}, "N m", "lbf in"),
        ({"torque": "lbf in"}, "J", "J"),
        ({"energy": "kWh"}, "J", "kWh"),
        ({"energy": "kWh"}, "N m", "N m"),
        ({"torque": "lbf in"}, "N^2 m^2", "lbf^2 in^2"),
        ({"length": "in"}, "N/m", "N/m"),
        ({"length": "in"}, "MPa", "MPa"),
        ({"stress": "psi"}, "MPa", "psi"),
        ({"speed": "rpm"}, "rad/s", "rpm"),
        ({"speed": "rpm"}, "rad^2/s^2", "rpm^2"),
        ({"speed": "rpm"}, "rad/s^2", "rad/s^2"),
        ({"angle": "deg"}, "rad/s", "deg/s"),
        ({"angle": "deg"}, "rad^2/s^4", "deg^2/s^4"),
        ({"angle": "rad"}, "rad", "rad"),
        ({"time": "ms"}, "s", "ms"),
        ({"time": "ms"}, "mm/s", "mm/s"),
        ({"length": "in", "speed": "rpm"}, "1", "1"),
        ({"length": "in", "speed": "rpm"}, "", ""),
        ({}, "mm", "mm"),
    ],
)
def test_the_unit_of_a_column_follows_the_chosen_ones(chosen, declared, shown):
    scale = read_shown_units(chosen).scale(declared)
    assert (scale.declared, scale.shown) == (declared, shown)
    # The second road: pint reads both texts as a whole, the scale is made of the factors.
    if declared not in ("", "1"):
        assert scale.factor == pytest.approx(unit_factor(declared, shown), rel=1e-45), "50 digits of pi"


def test_a_hertz_of_a_rotating_part_is_a_turn_per_second():
    scale = read_shown_units({"speed": "Hz"}).scale("rad^2/s^2")
    assert (scale.shown, float(scale.factor)) == ("Hz^2", float(unit_factor("rad^2/s^2", "turn^2/s^2")))


@pytest.mark.parametrize("mechanism", explore.list_mechanisms())
def test_every_column_of_every_mechanism_has_a_quantity(mechanism):
    """With another unit for every quantity, no value but plain numbers keeps the declared unit."""
    others = {
        "length": "in", "angle": "turn", "time": "min", "mass": "lb", "speed": "rpm", "velocity": "ft/min",
        "angular_acceleration": "deg/s^2", "acceleration": "ft/s^2", "force": "lbf", "torque": "lbf in", "energy": "Wh",
        "power": "hp", "stress": "psi", "inertia": "lb ft^2", "stiffness": "lbf/in", "rotational_stiffness": "N m/deg",
        "damping": "lbf s/in", "rotational_damping": "N m s/deg",
    }  # fmt: skip
    assert others.keys() == QUANTITIES.keys()
    units = read_shown_units(others)
    declared = find_mechanism(mechanism)
    columns = [*declared.parameters, *declared.metrics, *declared.formulas, *declared.signals]
    squares = [f"{signal.unit}".replace("rad/s", "rad^2/s^2") for signal in declared.signals if signal.unit == "rad/s"]
    kept = {unit for unit in (*(column.unit for column in columns), *squares) if units.scale(unit).is_declared}
    assert kept <= {"", "1"}


@pytest.mark.parametrize("unit", ["mm", "rad/s", "rad^2/s^2"])
def test_values_are_converted_by_exact_factors_and_come_back(unit):
    scale = INCHES.scale(unit)
    rng = np.random.default_rng(3)
    values = rng.standard_normal(5000) * 10.0 ** rng.integers(-150, 150, 5000)
    shown = scale.show_all(values)
    # Two roundings, each by half a unit in the last place, which is at most 1.12e-16 of the value.
    np.testing.assert_allclose(
        shown, [float(Fraction(x) * scale.factor) for x in values.tolist()], rtol=3.4e-16, atol=0
    )
    assert [scale.show(value) for value in values.tolist()] == shown.tolist()
    # Reading rounds once more.
    np.testing.assert_allclose([scale.read(repr(value)) for value in shown.tolist()], values, rtol=3.4e-16, atol=0.0)


def test_decimal_inches_are_shown_as_they_were_written():
    """To 15 digits, as many as a float keeps of a decimal number."""
    scale = INCHES.scale("mm")
    written = [f"{number / 8:g}" for number in range(1, 999)] + [f"{number / 10:g}" for number in range(1, 999)]
    assert [f"{scale.show(scale.read(text)):.15g}" for text in written] == written


@pytest.mark.parametrize(
    ("chosen", "declared"),
    [({"length": "in"}, "mm"), ({"angle": "rad"}, "deg"), ({"speed": "rpm"}, "rad/s"), ({"force": "lbf"}, "N")],
)
def test_declared_decimals_come_back_from_how_they_are_shown(chosen, declared):
    """So that what is copied from JSON means the designs that it was copied from."""
    scale = read_shown_units(chosen).scale(declared)
    values = [k / 100 for k in range(1, 10_000)]
    shown = [repr(scale.show(value)) for value in values]
    assert [scale.read(text) for text in shown] == values
    assert [scale.read(f"{text} {scale.shown}") for text in shown] == values
    assert scale.read(f"60.00000000000001 {declared}") == 60.00000000000001  # as it is written


def test_values_that_are_no_numbers_stay_so():
    values = np.array([np.nan, np.inf, -np.inf, 0.0])
    for unit in ("mm", "rad/s"):
        np.testing.assert_array_equal(INCHES.scale(unit).show_all(values), values)
        assert np.isnan(INCHES.scale(unit).show(np.nan))


def test_whole_numbers_of_a_unit_come_back_as_they_were_written():
    """Of 6,000 rpm and as many thousandths of an inch all, which are off in the last digit by the factor alone."""
    for unit, declared, scale in (
        ("rpm", "rad/s", read_shown_units({"speed": "rpm"}).scale("rad/s")),
        ("in", "mm", INCHES.scale("mm")),
    ):
        texts = [f"{k} {unit}" if unit == "rpm" else f"{k / 1000!r} {unit}" for k in range(1, 6001)]
        values = np.array([quantity(text, declared) for text in texts])
        assert scale.show_all(values).tolist() == [float(text.split()[0]) for text in texts]


@pytest.mark.parametrize(
    ("entries", "message"),
    [
        ({"lenght": "in"}, "lenght: no such quantity; did you mean 'length'?"),
        ({"length": "inn"}, "length: unknown unit 'inn'; did you mean 'in'?"),
        ({"length": "rpm"}, "length: 'rpm' cannot be converted to 'mm'; use mm, cm, m or in"),
        ({"length": 3}, 'length: must be a unit in quotes, such as "mm", got 3'),
        ({"length": "2 in"}, "length: '2 in' is not a unit"),
        ({"length": "10**10**10"}, "is not a unit"),
        ({"length": ""}, "length: '' is not a unit"),
        ({"length": "x" * 100_000}, f"length: '{'x' * 37}...' is not a unit; use mm"),
        ({"length": "mm " * 1_000 + "mm"}, f"length: '{'mm ' * 12}m...' cannot be converted to 'mm'"),
    ],
)
def test_wrong_entries_get_one_line(entries, message):
    with pytest.raises(explore.RequestError) as caught:
        read_shown_units(entries)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_numbers_are_read_in_the_shown_unit():
    scale = INCHES.scale("mm")
    assert [scale.read(text) for text in ("4", "4 cm", "101.6mm", "-4e0", "0e-99999999")] == [
        101.6,
        40,
        101.6,
        -101.6,
        0,
    ]
    assert Scale("mm", "mm").read("1e-5000") == 0.0
    with pytest.raises(explore.RequestError, match="'four' is not a number"):
        scale.read("four")
    assert scale.read("-1e300") == -2.54e301
    for text in ("1e308", "-1e308", "1e400", "1e999999999"):  # the first two are too large in millimetres only
        with pytest.raises(explore.RequestError, match="too large"):
            scale.read(text)


results = swept(FEW, "few")


def test_results_are_shown_in_the_chosen_units(results):
    shown = results.in_units(INCHES)
    assert shown.units["crank"] == "in"
    assert shown.units["cv"] == "1"
    frame, declared = shown.to_pandas(), results.to_pandas()
    np.testing.assert_array_equal(frame["crank"], declared["crank"] * 5 / 127)
    np.testing.assert_array_equal(frame["cv"], declared["cv"])
    assert frame.attrs["units"]["crank"] == "in"
    assert shown.designs([2])["crank"].item() == frame["crank"].iloc[2] == shown.design(2)["crank"]
    assert next(shown.blocks(["crank"]))["crank"].tolist() == frame["crank"].tolist()
    for metric, sides in shown.constraints.items():
        scale = shown.scales.get(metric) or shown.scales[f"{metric}_margin"]
        bounds = results.constraints[metric]
        assert sides == {side: None if bound is None else scale.show(bound) for side, bound in bounds.items()}


def test_results_without_chosen_units_are_the_same_object(results):
    assert results.in_units(ShownUnits()) is results
    assert results.in_units({"length": "in", "speed": "rpm"}).units == results.in_units(INCHES).units != results.units
    with pytest.raises(explore.RequestError, match="^length: "):
        results.in_units({"length": "rpm"})


def test_a_ranking_compares_declared_values_and_returns_shown_ones(results):
    shown = results.in_units(INCHES)
    crank = float(results.to_pandas()["crank"].iloc[3])
    conditions = (f"crank <= {INCHES.scale('mm').show(crank)!r}", f"crank <= {crank!r} mm")
    for where, source in zip(conditions, (shown, results), strict=True):
        ranking = rank_source(source, RankRequest(["cv:min", "crank:max"], where=where))
        plain = rank_source(results, RankRequest(["cv:min", "crank:max"], where=f"crank <= {crank!r}"))
        assert ranking.frame.index.tolist() == plain.frame.index.tolist()
        expected = plain.frame["crank"] * 5 / 127 if source is shown else plain.frame["crank"]
        np.testing.assert_array_equal(ranking.frame["crank"], expected)


def test_commands_take_results_in_other_units_as_declared_ones(tmp_path):
    pytest.importorskip("flint")
    text = crank_rockers((80, 120), 1083, (500, 560), 700)
    ends = '[sampling]\nmethod = "sobol"\ncount = 64\n[rank]\nmetrics = ["cv", "swing_angle:max"]\n'
    ranges = sweep_text(tmp_path, text + ends, workers=1)
    given = {
        kind: [
            explore.certify(results, 3),
            explore.tolerance(results, {"crank": 0.1}, 3, draws=1000).metrics,
            explore.polish(results, 3),
            explore.read_results(explore.refine(results, tmp_path / f"{kind}.h5", evaluations=100).path),
        ]
        for kind, results in {"declared": ranges, "shown": ranges.in_units(INCHES)}.items()
    }
    for declared, shown in zip(*given.values(), strict=True):
        pd.testing.assert_frame_equal(shown, declared, check_exact=True)
