"""Certificates of rows with friction at pins: against free bodies with 45 digits, and false rows that must be found."""

import mpmath
import pytest
from flint import acb, arb, arb_series, ctx
from linkage_cases import CASES, values_of, with_loads
from test_certify_linkages import proofs_of, rows_of
from test_pin_friction import DESIGN, PIN, ROUGH

from explore.analysis.certifying.analytic import TERMS
from explore.analysis.certifying.balls import UnprovedError
from explore.analysis.certifying.designs import Design
from explore.analysis.certifying.fixed_points import lengths
from explore.analysis.certifying.motion import Motion
from explore.analysis.certifying.rows import certify_row
from explore.mechanisms.linkages.statuses import CANNOT_ASSEMBLE
from explore.model.status import Status
from explore.studies.request.requests import make_request

ROUGH_PINS = {"mu": 0.1, "radius": 8.0, "speed": 11.0}
WITH_ROD = {"masses": {"B": 1.3}, "forces": {"B": [-25, 0]}, "friction": dict.fromkeys("OAB", PIN)}
SIX_BAR = {
    "gravity": [1.0, -9.81],
    "masses": {link: {"mass": 0.7, "centroid": [20, 5]} for link in ("coupler", "rocker", "rod", "output")},
    "forces": {"E": [-30, 10]},
    "friction": {"E": PIN},
}  # fmt: skip
#: Linkages, designs and a pin of which the force is certified.
CASES_OF_PINS = {
    "four-bar": (ROUGH, DESIGN, "B_force_on_rocker"),
    "slider-crank": (with_loads(CASES["slider-crank"], WITH_ROD), values_of(CASES["slider-crank"]), "B_force_on_rod"),
    "six-bar": (with_loads(CASES["watt-2"], SIX_BAR), values_of(CASES["watt-2"]), "B_force_on_coupler"),
}
METRICS = (
    "drive_torque_rms", "drive_torque_max", "drive_torque_min", "drive_power_mean", "friction_power_mean",
    "lock_ratio_max", "positive_work", "net_work", "pin_force_peak",
)  # fmt: skip


#: Metrics whose proofs take seconds for a six-bar too.
FEW = ("drive_torque_max", "friction_power_mean", "lock_ratio_max")


@pytest.mark.parametrize(
    ("name", "statistics"),
    [
        ("slider-crank", METRICS), ("four-bar", FEW), ("six-bar", FEW),
        *(pytest.param(name, METRICS, marks=pytest.mark.slow) for name in ("four-bar", "six-bar")),
    ],
)  # fmt: skip
def test_rows_with_friction_at_pins_are_proved(name, statistics):
    """All statistics; each that is wrong by 1.5 times its error bound is named, and a wrong status is."""
    linkage, values, force = CASES_OF_PINS[name]
    metrics = [*statistics, *([f"{force}_rms"] if statistics == METRICS else [])]
    (row,) = rows_of(linkage, {**ROUGH_PINS, **values}, metrics, window="cycle")
    request = make_request(linkage.mechanism, metrics=metrics, window="cycle")
    design = Design.of_row(row, request)
    proved = certify_row(design, row)
    assert (proved.verdict, proved.reason) == ("proved", "")
    scales = {metric.name: float(design.enclose(metric).scale) for metric in request.metrics}
    false = row | {metric: row[metric] + 1.5 * (row["error"] + 2e-15) * scales[metric] for metric in metrics}
    refuted = certify_row(design, false)
    assert refuted.verdict == "refuted"
    assert [metric for metric in metrics if f"{metric} " not in refuted.reason] == []
    other = certify_row(design, row | {"status": float(CANNOT_ASSEMBLE)})
    assert other.verdict == "refuted"
    assert "status is ok" in other.reason


def test_forces_through_0_are_proved():
    """Of the guide, with friction too: sizes have corners there, and no bound of a box that holds one."""
    linkage = with_loads(CASES["slider-crank"], WITH_ROD | {"friction": {"guide": 0.1, "B": PIN}})
    metrics = ["drive_torque_rms", "drive_torque_max"]
    (row,) = rows_of(linkage, values_of(CASES["slider-crank"]) | ROUGH_PINS, metrics, window="cycle")
    assert proofs_of(linkage.mechanism, [row], metrics, window="cycle") == [("proved", "")]


class FreeBodies:
    """The links of `ROUGH` as free bodies at a crank angle, with friction of the forces before put in again and again.

    Accelerations are differences of positions, with twice the digits.
    """

    def __init__(self, values):
        self.values = {name: mpmath.mpf(value) for name, value in values.items()}

    def places(self, theta):
        """O, A, B, C, and the angles of crank, coupler and rocker."""
        r1, r2, r3, r4 = (self.values[f"r{k}"] for k in (1, 2, 3, 4))
        a, c = mpmath.mpc(r1 * mpmath.cos(theta), r1 * mpmath.sin(theta)), mpmath.mpc(r4, 0)
        d = c - a
        reach = abs(d)
        along = (r2**2 - r3**2 + reach**2) / (2 * reach)
        b = a + d / reach * mpmath.mpc(along, mpmath.sqrt(r2**2 - along**2))
        return a, b, c, theta, mpmath.arg(b - a), mpmath.arg(b - c)

    def derivatives(self, theta):
        """Places, first and second derivatives by the crank angle."""
        step = mpmath.mpf(10) ** -24
        low, here, high = (self.places(theta + k * step) for k in (-1, 0, 1))
        first = [(y - x) / (2 * step) for x, y in zip(low, high, strict=True)]
        second = [(y + x - 2 * z) / step**2 for x, y, z in zip(low, high, here, strict=True)]
        return here, first, second

    def balanced(self, theta):
        """Drive torque, N m, and the size of the force of pin B, N."""
        v, metre = self.values, mpmath.mpf(1) / 1000
        (a, b, c, *_), rates, changes = self.derivatives(theta)
        turns, bends = rates[3:], [change * v["speed"] ** 2 for change in changes[3:]]
        accelerations = [change * v["speed"] ** 2 for change in changes[:3]]
        down = mpmath.mpc(0, mpmath.mpf(-9.80665))
        pushes = [
            v["coupler_mass"] * (down - (accelerations[0] + accelerations[1]) / 2 * metre),
            v["rocker_mass"] * (down - accelerations[1] / 2 * metre),
        ]
        moments = [-v["coupler_inertia"] * bends[1], v["constant_torque"] - v["own_inertia"] * bends[2]]
        arm, sizes = v["mu"] * v["radius"] * metre, [mpmath.mpf(0)] * 4
        senses = [1, *(mpmath.sign(turns[k] - turns[k + 1]) for k in (0, 1)), mpmath.sign(turns[2])]
        for _ in range(80):
            rubs = [arm * sense * size for sense, size in zip(senses, sizes, strict=True)]
            on_coupler = moments[0] + rubs[1] - rubs[2] + cross((b - a) / 2 * metre, pushes[0])
            on_rocker = moments[1] + rubs[2] - rubs[3] + cross((b - c) / 2 * metre, pushes[1])
            # the force x, y at B on the rocker balances the moments of both links about A and C
            p, q = (b - a) * metre, (b - c) * metre
            matrix = mpmath.matrix([[p.imag, -p.real], [-q.imag, q.real]])
            x, y = mpmath.lu_solve(matrix, mpmath.matrix([-on_coupler, -on_rocker]))
            at_b = mpmath.mpc(x, y)
            at_a, at_c = at_b - pushes[0], -at_b - pushes[1]
            sizes = [abs(at_a), abs(at_a), abs(at_b), abs(at_c)]
        rubs = [arm * sense * size for sense, size in zip(senses, sizes, strict=True)]
        return rubs[0] + rubs[1] + cross(a * metre, at_a), abs(at_b)


def cross(a, b):
    return a.real * b.imag - a.imag * b.real


def enclosed(request, row, name, angles):
    """Balls of a signal at crank angles, rad, from the piece of the turn that holds each."""
    motion = Motion({parameter.name: row[parameter.name] for parameter in request.mechanism.parameters}, request)
    signal = request.mechanism.signal(name)
    pieces = motion._pieces(motion.quantity(signal), request.mechanism.whole_motion)
    for angle in angles:
        (piece,) = [each for each in pieces if not each.is_tiny and each.start < angle < each.stop]
        yield piece.function.value(arb(angle))


def test_forces_are_those_of_free_bodies_with_30_digits():
    (row,) = rows_of(ROUGH, DESIGN, ["drive_torque_max"], window="cycle")
    request = make_request(ROUGH.mechanism, metrics=["drive_torque_max"], window="cycle")
    angles = (0.3, 1.7, 2.9, 4.4, 5.8)
    with mpmath.workdps(100), ctx.workprec(256):
        found = [FreeBodies(DESIGN).balanced(mpmath.mpf(angle)) for angle in angles]
        torques = list(enclosed(request, row, "drive_torque", angles))
        squares = list(enclosed(request, row, "B_force_on_rocker", angles))
        for (torque, size), ball, square in zip(found, torques, squares, strict=True):
            assert abs(ball - arb(mpmath.nstr(torque, 45))) < 1e-30 * abs(ball)
            assert abs(square.sqrt() - arb(mpmath.nstr(size, 45))) < 1e-30 * square.sqrt()


def test_friction_that_locks_in_the_turn_is_not_proved():
    """With the numbers of a design that does not lock; next to locking, those of the design itself are proved."""
    metrics = ["drive_torque_max", "lock_ratio_max"]
    (row,) = rows_of(ROUGH, DESIGN, metrics, window="cycle")
    limit = DESIGN["mu"] / row["lock_ratio_max"]
    (near,) = rows_of(ROUGH, DESIGN | {"mu": 0.9 * limit}, metrics, window="cycle")
    ((verdict, reason),) = proofs_of(ROUGH.mechanism, [near], metrics, window="cycle")
    assert (verdict, reason) == ("proved", "")
    false = [near | {"mu": share * limit} for share in (1.0 + 1e-6, 1.3)]
    for verdict, reason in proofs_of(ROUGH.mechanism, false, ["drive_torque_max"], window="cycle"):
        assert verdict == "open"
        assert "may lock" in reason
    (locked,) = rows_of(ROUGH, DESIGN | {"mu": 1.3 * limit}, metrics[:1], window="cycle")
    assert locked["status"] == Status.NOT_FINITE
    ((verdict, _),) = proofs_of(ROUGH.mechanism, [locked], metrics[:1], window="cycle")
    assert verdict == "open"


def example(theta, cosine, sine, number):
    """Parts of two vectors and four gains, as functions of an angle."""
    c, s = cosine(theta), sine(theta)
    numbers = [(2, 1, 0), (0, 1, -1), (1, 0, 1), (-1, 1, 2), (2, 1, 0), (0, 1, 1), (1, 1, 0), (3, 0, 1), (0, -1, 1),
               (1, 2, 0), (0, 1, 0), (2, 0, -1)]  # fmt: skip
    scales = [1] * 4 + [number(1) / 16] * 8
    return [scale * (number(k) + m * c + n * s) for scale, (k, m, n) in zip(scales, numbers, strict=True)]


def substituted(parts, count=120):
    """Lengths of `example` by substitution."""
    vectors = list(zip(parts[::2], parts[1::2], strict=True))
    found = [mpmath.mpf(0)] * 2
    for _ in range(count):
        found = [
            mpmath.sqrt(
                sum((own[part] + sum(g[part] * z for g, z in zip(gains, found, strict=True))) ** 2 for part in (0, 1))
            )
            for own, gains in zip(vectors[:2], (vectors[2:4], vectors[4:]), strict=True)
        ]
    return found


@pytest.mark.parametrize("theta", [0.4, 2.2, 4.9])
def test_lengths_hold_those_of_substitution(theta):
    """At an angle, in an interval, in a box of complex angles, and as power series."""
    with mpmath.workdps(40), ctx.workprec(128):
        true = [
            substituted(example(mpmath.mpf(theta) + k * mpmath.mpf("1e-3"), mpmath.cos, mpmath.sin, mpmath.mpf))
            for k in (-1, 0, 1)
        ]
        true = [[arb(mpmath.nstr(value, 38)) for value in values] for values in true]
        exact = lengths(*example(arb(theta), arb.cos, arb.sin, arb))
        wide = lengths(*example(arb(theta, 1e-3), arb.cos, arb.sin, arb))
        box = lengths(*example(acb(arb(theta, 1e-3), arb(0, 1e-3)), acb.cos, acb.sin, acb))
        s, c = arb(theta).sin_cos()
        series = [arb_series([p, q, -p / 2, -q / 6, p / 24], TERMS) for p, q in ((c, -s), (s, c))]
        about = lengths(*example(0, lambda _: series[0], lambda _: series[1], arb))
        for i in (0, 1):
            low, here, high = (values[i] for values in true)
            assert abs(exact[i] - here) < 1e-35
            assert all(wide[i].overlaps(value) for value in (low, here, high))
            assert all(box[i].real.overlaps(value) for value in (low, here, high))
            assert box[i].rad() < 0.1
            assert abs((high - low) / arb("2e-3") - about[i][1]) < 1e-5
            assert abs((high + low - 2 * here) / arb("2e-6") - about[i][2]) < 1e-5


def test_lengths_that_are_not_known_to_be_unique_are_none():
    with pytest.raises(UnprovedError, match="may lock"):
        lengths(arb(1), arb(0), arb(1), arb("0.1"))
    assert not lengths(arb(1), arb(0), arb(1, 0.1), arb(0))[0].is_finite()
    # (1 + i)^2 + (1 - i)^2 is 0
    assert not lengths(acb(1, 1), acb(1, -1), acb(0.1), acb(0))[0].is_finite()
