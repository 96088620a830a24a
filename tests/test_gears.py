"""Gear pairs by second roads: mpmath, closure, dense samples, limits, and what is refused."""

import mpmath as mp
import numpy as np
import pytest
from gear_pair import DIGITS, GearPair

import explore
from explore.base.lanes.designs import fill_motion_of_design
from explore.mechanisms.gears import columns
from explore.mechanisms.registry import MECHANISMS

GEARS = MECHANISMS["gears"]
OK = 1
#: All signals but the ratio of the trains together.
ALL = columns.RATIOS | columns.ANGLES | columns.PITCH_CURVES | columns.TRAIN
LANES = 16
TURN = 2.0 * np.pi


def random_designs(count, seed, **fixed):
    random = np.random.default_rng(seed)
    return {
        "growth": np.exp(random.uniform(0.02, 1.8, count)),
        "sector": random.uniform(0.6, 5.8, count),
        "centre_distance": random.uniform(50.0, 300.0, count),
        **{name: np.full(count, float(value)) for name, value in fixed.items()},
    }


def one_of(designs, k):
    return {name: float(values[k]) for name, values in designs.items()}


def signals_of(design, angles, is_return, needs=ALL):
    """The signals of one design at angles in rad, all taken to be in one sector, shape (rows, t); in rad."""
    defaults = {parameter.name: parameter.default for parameter in GEARS.parameters}
    parameters = np.array([[(defaults | design)[p.name]] for p in GEARS.kernel_parameters])
    constants = np.ascontiguousarray(GEARS.constants(parameters)[:, 0])
    half_turns = np.round(np.asarray(angles) / np.pi)
    tangents = np.tan(0.5 * (np.asarray(angles) - half_turns * np.pi))
    anchors, laws = (half_turns % 2).astype(np.int64), np.full(len(tangents), int(is_return))
    rows = np.zeros((columns.SIGNAL_ROWS, len(tangents)))
    fill_motion_of_design(GEARS.fill, constants, anchors, laws, tangents, 0, needs, columns.SIGNAL_ROWS, rows)
    return rows


def both_sectors(design, count=400):
    """Signals at angles of both sectors, joints included: each joint is in both."""
    working = np.linspace(0.0, design["sector"], count)
    returning = np.linspace(design["sector"], TURN, count)
    return np.concatenate([working, returning]), np.concatenate(
        [signals_of(design, working, False), signals_of(design, returning, True)], axis=1
    )


@pytest.mark.parametrize("order", [0, 1, 2, 3])
def test_random_pairs_agree_with_mpmath(order):
    designs = random_designs(3, order, return_order=order)
    names = ["law_constant", "ratio_start", "return_amplitude", "return_frequency", "return_shift", "return_mean"]
    table = explore.evaluate("gears", designs, metrics=names)
    for k in range(3):
        design = one_of(designs, k)
        constant, _, amplitude, frequency, shift, mean = table.loc[k, names]
        # three digits of the kernel's solution, of which there is one on each branch
        start = [constant * amplitude, frequency, frequency * (design["sector"] - shift), constant * mean]
        with mp.workdps(DIGITS):
            start = [mp.mpf(f"{value:.3g}") for value in start]
            pair = GearPair(design["growth"], design["sector"], order, start)
            assert table["law_constant"][k] == pytest.approx(float(pair.constant), rel=1e-14)
            assert table["ratio_start"][k] == pytest.approx(float(pair.start), rel=1e-14)
            if order == 0:
                assert table["return_amplitude"][k] == pytest.approx(float(pair.sine[0]), rel=1e-13)
            for share in (0.0, 0.3, 0.8):
                angle = design["sector"] + share * (TURN - design["sector"])
                exact = [float(value) for value in pair.derivatives(mp.mpf(angle), True)]
                rows = signals_of(design, [angle], True)[:, 0]
                # one rounding of the angle, times the rates of the law
                assert rows[columns.RATIO] == pytest.approx(exact[0], rel=1e-13)
                assert rows[columns.RATIO_RATE] == pytest.approx(exact[1], rel=1e-12, abs=1e-13 * abs(exact[2]))
                scale = exact[0] + abs(exact[1]) ** 2 / exact[0] + abs(exact[2])
                assert rows[columns.RATIO_ACCELERATION] == pytest.approx(exact[2], rel=1e-12, abs=1e-12 * scale)
                assert rows[columns.DRIVEN_ANGLE] == pytest.approx(float(pair.driven_angle(mp.mpf(angle))), rel=1e-13)


@pytest.mark.parametrize("order", [0, 1, 2, 3])
def test_closure_and_joints(order):
    """The driven gear turns once, and ratio and slope are the same on both sides of the joints."""
    designs = random_designs(40, 10 + order, return_order=order)
    for k in range(40):
        design = one_of(designs, k)
        before = signals_of(design, [0.0, design["sector"]], False)
        after = signals_of(design, [TURN, design["sector"]], True)
        assert after[columns.DRIVEN_ANGLE, 0] == pytest.approx(TURN, rel=1e-14)
        assert before[columns.DRIVEN_ANGLE, 0] == 0.0
        np.testing.assert_allclose(before[columns.DRIVEN_ANGLE, 1], after[columns.DRIVEN_ANGLE, 1], rtol=1e-14)
        # the rounding of the angle, times the logarithmic rate of the law inside the return
        np.testing.assert_allclose(before[columns.RATIO], after[columns.RATIO], rtol=1e-13)
        np.testing.assert_allclose(before[columns.RATIO_RATE], after[columns.RATIO_RATE], rtol=1e-11)
        jump = after[columns.DRIVER_CURVATURE] - before[columns.DRIVER_CURVATURE]
        expected = explore.evaluate("gears", design, metrics=["curvature_jump"])["curvature_jump"][0]
        scale = after[columns.DRIVER_TERMS].max()
        assert np.abs(jump).max() == pytest.approx(expected, rel=1e-11, abs=1e-11 * scale)
        assert (expected > 1e-3 * scale) == (order < 2)


@pytest.mark.parametrize("branch", [1, 2, 3, 7])
def test_the_arctangent_is_unwrapped(branch):
    """The driven angle of a return with many periods is the integral of 1/i, without steps."""
    design = {"growth": 1.6, "sector": 3.0, "branch": float(branch), "centre_distance": 100.0}
    nodes, weights = np.polynomial.legendre.leggauss(20)
    ends = np.linspace(design["sector"], TURN, 20 * branch + 1)
    half = 0.5 * np.diff(ends)[0]
    angles = (ends[:-1, None] + half * (1.0 + nodes)).ravel()
    integrals = half * (signals_of(design, angles, True)[columns.SPEED_RATIO].reshape(-1, 20) * weights).sum(axis=1)
    driven = signals_of(design, ends, True)[columns.DRIVEN_ANGLE]
    np.testing.assert_allclose(np.diff(driven), integrals, rtol=0, atol=1e-13)


@pytest.mark.parametrize("order", [0, 1, 2, 3])
def test_convexity_tilt_and_ratios_are_those_of_dense_samples_from_both_sides(order):
    designs = random_designs(30, 40 + order, return_order=order, branch=1 if order else 2)
    designs["branch"][::2] = 1.0
    names = ["convexity_driver", "convexity_driven", "tangent_tilt_max", "ratio_min", "ratio_max"]
    table = explore.evaluate("gears", designs, metrics=names)
    for k in range(30):
        _, rows = both_sectors(one_of(designs, k), 2_000)
        ratio, rate, acceleration = rows[[columns.RATIO, columns.RATIO_RATE, columns.RATIO_ACCELERATION]]
        dense = {
            "convexity_driver": (1.0 + ratio + acceleration).min(),
            "convexity_driven": (1.0 + ratio + rate**2 - ratio * acceleration).min(),
            "tangent_tilt_max": -np.degrees(np.arctan(np.abs(rate) / (1.0 + ratio)).max()),
            "ratio_min": ratio.min(),
            "ratio_max": -ratio.max(),
        }
        for name, least in dense.items():
            value = table[name][k] * (-1.0 if name in ("tangent_tilt_max", "ratio_max") else 1.0)
            # samples miss the extreme by at most the square of half their distance, 1e-6 of the curve's bend
            scale = np.abs(dense[name]) + np.abs(acceleration).max() * (1.0 + ratio.max())
            assert least - 1e-4 * scale <= value <= least + 1e-12 * scale, name


@pytest.mark.parametrize(
    ("growth", "sector", "order"),
    [
        pytest.param(1.0449209757690749, 1.64558833989742, 3, id="two-dips-nearly-as-low"),
        pytest.param(971645136.86374152, 0.0083212436321042881, 2, id="a-lower-dip-between-steps"),
        pytest.param(2.6704805548523459e18, 4.5675819504279218, 2, id="terms-that-cancel"),
        pytest.param(1.3140240104727432, 0.6781208638554458, 1, id="a-dip-within-a-step"),
    ],
)
def test_least_convexities_by_the_logarithm_of_the_ratio(growth, sector, order):
    """i'^2 - i i'' is -i^2 (ln i)'', whose terms do not cancel however large the ratio is."""
    names = ["convexity_driver", "convexity_driven", "ratio_start"]
    design = {"growth": growth, "sector": sector, "return_order": order}
    row = explore.evaluate("gears", design, metrics=names).iloc[0]
    width, log_growth = TURN - sector, np.log(growth)
    slope = np.polynomial.Polynomial([0.0, 1.0, -1.0]) ** order
    slope = slope / slope.integ()(1.0)
    step, bend = slope.integ(), slope.deriv()

    def convexities(sigma):
        ratio = row["ratio_start"] * np.exp(log_growth * (TURN * step(sigma) - sector - width * sigma))
        rate = log_growth * (TURN * slope(sigma) / width - 1.0)
        bent = TURN * log_growth * bend(sigma) / width**2
        return 1.0 + ratio * (1.0 + rate**2 + bent), 1.0 + ratio - ratio**2 * bent

    grid = np.linspace(0.0, 1.0, 10_001)
    for k, values in enumerate(convexities(grid)):
        middle = grid[np.argmin(values)]
        near = np.clip(np.linspace(middle - 1e-4, middle + 1e-4, 20_001), 0.0, 1.0)
        assert row[names[k]] == pytest.approx(convexities(near)[k].min(), rel=1e-9)


def test_extremes_of_curvature_are_found_at_joints():
    """One-sided values: the largest curvature of gear 1 is just after the working sector, the sine at its lowest."""
    designs = random_designs(6, 50)
    names = [f"{gear}_curvature_{extreme}" for gear in ("driver", "driven") for extreme in ("min", "max")]
    table = explore.evaluate("gears", designs, metrics=names)
    for k in range(6):
        _, rows = both_sectors(one_of(designs, k), 40_000)
        for gear, row in (("driver", columns.DRIVER_CURVATURE), ("driven", columns.DRIVEN_CURVATURE)):
            size = rows[row + 2].max()
            assert table[f"{gear}_curvature_max"][k] == pytest.approx(rows[row].max(), abs=1e-5 * size)
            assert table[f"{gear}_curvature_max"][k] >= rows[row].max() - 1e-13 * size
            assert table[f"{gear}_curvature_min"][k] == pytest.approx(rows[row].min(), abs=1e-5 * size)
            assert table[f"{gear}_curvature_min"][k] <= rows[row].min() + 1e-13 * size


def test_teeth():
    design = {"growth": 1.5, "centre_distance": 150.0, "module": 4.0}
    names = ["perimeter", "tooth_count", "fitting_centre_distance", "curvature_radius_min"]
    row = explore.evaluate("gears", design, metrics=names).iloc[0]
    assert row["tooth_count"] == pytest.approx(row["perimeter"] / (4.0 * np.pi), rel=1e-14)
    fitting = explore.evaluate(
        "gears", design | {"centre_distance": row["fitting_centre_distance"]}, metrics=["tooth_count"]
    )
    # the perimeter grows like the centre distance, and has an error of a few units in the last place
    assert fitting["tooth_count"][0] == pytest.approx(37.0, rel=1e-13)
    assert row["curvature_radius_min"] == pytest.approx(1.0 / 0.0335296642513503103, rel=1e-12)


def test_growth_near_1():
    """All gears become circles: k ln m and all ratios go to 1, convexities to 2, with errors of the order of ln m."""
    excess = 10.0 ** -np.arange(2.0, 15.0)
    growth = 1.0 + excess
    names = ["law_constant", "ratio_min", "ratio_max", "convexity_driver", "convexity_driven", "tangent_tilt_max",
             "return_frequency", "return_mean", "phase_shift_max"]  # fmt: skip
    table = explore.evaluate("gears", {"growth": growth, "centre_distance": 150.0, "trains": 3.0}, metrics=names)
    assert (table["status"] == OK).all()
    logarithm = np.log(growth)
    # a growth that is rounded has a logarithm that is exact
    assert (np.abs(table["law_constant"] * logarithm - 1.0) <= 3.0 * logarithm + 1e-15).all()
    for name in ("ratio_min", "ratio_max", "return_mean"):
        assert (np.abs(table[name] - 1.0) <= 3.0 * logarithm + 1e-15).all()
    for name in ("convexity_driver", "convexity_driven"):
        assert (np.abs(table[name] - 2.0) <= 12.0 * logarithm + 1e-14).all()
    assert (table["tangent_tilt_max"] <= 120.0 * logarithm).all()
    # circles of equal speed: a third of a turn of the input, so a shift of the sector less that
    assert np.abs(table["phase_shift_max"].to_numpy()[-1] - (4.2 - TURN / 3.0)) <= 1e-13
    # the scalar equation becomes tan x = -(b/w) x
    x = 0.5 * table["return_frequency"].to_numpy()[-1] * (TURN - 4.2)
    assert np.tan(x) == pytest.approx(-4.2 / (TURN - 4.2) * x, rel=1e-13)


@pytest.mark.parametrize("order", [0, 1, 2, 3])
def test_ratios_of_1e90_are_finite_and_closed(order):
    """Far beyond any gear: the scalar equation's root is next to 0, and e^(-L b) next to nothing."""
    for growth, sector in ((1e20, 4.5), (1e28, 3.5), (1e15, 6.0)):
        design = {"growth": growth, "sector": sector, "return_order": float(order), "centre_distance": 1.0}
        table = explore.evaluate("gears", design)
        assert table["status"][0] == OK
        assert np.isfinite(table.drop(columns="growth").iloc[0].to_numpy(dtype=float)).all()
        after = signals_of(design, [TURN], True)
        assert after[columns.DRIVEN_ANGLE, 0] == pytest.approx(TURN, rel=1e-12)
        # a rounding of the angle, times up to 100 units of the ratio's logarithm per radian
        assert after[columns.RATIO, 0] == pytest.approx(table["ratio_start"][0], rel=1e-12)


@pytest.mark.parametrize(
    ("changes", "label", "sentence"),
    [
        ({"growth": 1.0}, "no_growth", "the growth per radian is not above 1"),
        ({"growth": 0.7}, "no_growth", "the growth per radian is not above 1"),
        ({"sector": TURN}, "no_return", "no return is left"),
        ({"sector": 7.0}, "no_return", "no return is left"),
        ({"branch": 1.5}, "broken_branch", "the branch is not a whole number"),
        ({"growth": 1e30, "sector": 4.0}, "ratio_overflow", "more than a factor of 1e100"),
        ({"branch": 2, "return_order": 1}, "no_branch", "no branch but 1"),
    ],
)
def test_a_bad_design_is_a_row_with_a_status_and_one_line_alone(changes, label, sentence):
    good = {"growth": 1.5, "sector": 4.2, "centre_distance": 150.0}
    rows = {name: [good.get(name, 1.0 if name == "branch" else 0.0), float(value)] for name, value in changes.items()}
    table = explore.evaluate("gears", good | rows, metrics=["law_constant", "ratio_max", "driver_radius_max"])
    assert [GEARS.status_labels[code] for code in table["status"]] == ["ok", label]
    assert table.loc[1, ["law_constant", "ratio_max", "driver_radius_max"]].isna().all()
    with pytest.raises(explore.MotionError) as error:
        explore.simulate("gears", good | changes)
    assert sentence in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("changes", [{"growth": -1.0}, {"sector": 0.0}, {"branch": 0.0}, {"branch": 101.0},
                                     {"trains": 2.5}, {"return_order": 4.0}, {"phase_shift": -0.1}])  # fmt: skip
def test_a_value_outside_a_declared_range_is_refused(changes, problems):
    design = {"growth": 1.5, "centre_distance": 150.0, **changes}
    table = explore.evaluate("gears", design, metrics=["law_constant"])
    assert GEARS.status_labels[table["status"][0]] == "not_finite"
    (name,) = changes
    lines = [f"{key} = {value}" for key, value in design.items()]
    (problem,) = problems("\n".join(['mechanism = "gears"', "[parameters]", *lines]))
    assert name in problem


def test_a_tilt_beyond_that_of_a_radius_cannot_be_solved_for(problems):
    """A pitch curve may come near the direction of its radius, 90 deg from the circumferential one."""
    entry = '{ solve = "tangent_tilt_max", value = 90.5, min = 1.1, max = 2 }'
    (problem,) = problems(f'mechanism = "gears"\n[parameters]\ngrowth = {entry}\nsector = 4.2\ncentre_distance = 150\n')
    assert problem.endswith("tangent_tilt_max is at most 90 deg, got 90.5")


def test_a_repeated_design_has_what_the_one_before_it_has():
    """Not what a lane behind it has, which is not filled yet."""
    first, other = (np.array([[growth, 4.2, 150.0, 0.0, 1.0, 3.0, 1.0]]).T for growth in (1.5, 1.6))
    constants = GEARS.constants(np.hstack([first, first, other]))
    np.testing.assert_array_equal(constants, np.hstack([GEARS.constants(each) for each in (first, first, other)]))


def test_a_request_for_ratios_computes_no_pitch_curves():
    """Not in closed form, without nodes; and sampled ratios need a bit that leaves all other rows alone."""
    design = {"growth": 1.5, "sector": 4.2, "centre_distance": 150.0, "phase_shift": 1.0}
    assert explore.evaluate("gears", design, metrics=["ratio_min", "ratio_max"])["nodes"][0] == 0
    parameters = np.array([[1.5, 4.2, 150.0, 0.0, 1.0, 3.0, 1.0]]).T
    constants = np.repeat(GEARS.constants(parameters), LANES, axis=1).ravel()
    ratios = [signal.row for signal in GEARS.signals if signal.name.startswith(("ratio", "speed_ratio"))]
    for signal in GEARS.signals:
        out = np.full(columns.SIGNAL_ROWS * LANES, np.nan)
        GEARS.fill(constants, np.full(LANES, 0.5), 0, 0, 0, 1, signal.needs, out)
        written = np.flatnonzero(~np.isnan(out[::LANES]))
        assert signal.row in written
        if signal.row in ratios:
            assert list(written) == sorted(ratios)
        elif signal.needs == columns.PITCH_LENGTHS:
            assert list(written) == [columns.RATIO, columns.RATIO_RATE, columns.RATIO_ACCELERATION, signal.row]
        elif signal.needs != columns.PITCH_CURVES:
            assert not set(written) & set(range(columns.DRIVER_RADIUS, columns.DRIVEN_TERMS + 1))


def test_the_driven_angle_has_no_statistics_across_its_new_beginning():
    """Where it jumps by a turn; up to there, from there and over windows between it grows."""
    design, metric = {"growth": 2.0, "sector": 3.5, "centre_distance": 150.0}, "driven_angle_peak_to_peak"

    def travel(window):
        return explore.evaluate("gears", design, metrics=[metric], window=window)[metric][0]

    for start, stop in ((-40, 1), (359, 361), (700, 730), (-370, -340)):
        with pytest.raises(explore.RequestError, match="driven_angle begins again at whole turns of the driver angle"):
            travel({"from": start, "to": stop})
    parts = travel({"from": -40, "to": 0}) + travel({"from": 360, "to": 410}) + travel({"from": 50, "to": 320})
    assert parts == pytest.approx(360.0, rel=1e-14)
    assert travel("cycle") == pytest.approx(travel("working") + travel("return"), rel=1e-14)
