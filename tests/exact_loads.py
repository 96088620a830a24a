"""Four-bars and slider-cranks under load with 256 bits, which the caller sets: statistics by composite Gauss rules.

Positions from intersecting circles, forces from the equilibrium of free bodies, the drive torque by the balance of
power; no formula is shared with the package. Panels end at dead centres, at zeros of the power and of the guide's
force, and are graded geometrically towards dead centres and towards the angles that singularities stand above.
"""

from functools import cache
from itertools import pairwise

import numpy as np
from flint import arb, ctx

_NODES, _FINEST = 12, 24


@cache
def _rule():
    """Ascending nodes between -1 and 1, and weights."""
    return [arb.legendre_p_root(_NODES, k, weight=True) for k in reversed(range(_NODES))]


def _cross(a, b):
    return a[0] * b[1] - a[1] * b[0]


def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1]


def _length(a):
    """Of a vector, which may be 0 up to its last digits, where the ball of its square is not all positive."""
    return abs(_dot(a, a).mid()).sqrt()


def _plus(a, b, factor=1):
    return a[0] + factor * b[0], a[1] + factor * b[1]


def _turned(a):
    return -a[1], a[0]


class Loaded:
    """What all mechanisms share: a design's values, and statistics of signals that `at` gives for an angle.

    `at` has squares as products: a power of a number whose ball has 0 in it is not a number.
    """

    cornering = ("drive_torque",)

    def __init__(self, design, defaults):
        self.values = {name: arb(value) for name, value in (defaults | design).items()}
        self._known = {}

    def __getitem__(self, name):
        return self.values.get(name, arb(0))

    def _at(self, theta, sense):
        key = (theta.str(60, radius=False), sense)
        if key not in self._known:
            self._known[key] = self.at(theta, sense)
        return self._known[key]

    def statistics(self, window, signals):
        """Mean, mean square, minimum and maximum of each signal over a window, by name."""
        pieces, length, samples = [], arb(0), {}
        for first, last, sense in self.strokes(window) if isinstance(window, str) else self._interval(**window):
            length += last - first
            edges = self._edges(first, last)
            for name in self.cornering:
                edges = sorted([*edges, *self._zeros(edges, sense, name)], key=float_key(first))
            pieces.append((edges, sense))
        totals = {name: [arb(0), arb(0)] for name in signals}
        for edges, sense in pieces:
            for start, stop in pairwise(edges):
                for theta, weight in _nodes(start, stop):
                    values = self._at(theta, sense)
                    for name in signals:
                        totals[name][0] += weight * values[name]
                        totals[name][1] += weight * values[name] * values[name]
        for name in signals:
            samples[name] = [float(total / length) for total in totals[name]] + [
                self._extreme(pieces, name, sign) for sign in (1, -1)
            ]
        return samples

    def _interval(self, start, stop):
        """The parts of the strokes, as of `strokes`, between two crank angles in degrees."""
        first, last, turn = arb(start) * arb.pi() / 180, arb(stop) * arb.pi() / 180, 2 * arb.pi()
        for begin, end, sense in self.strokes("cycle"):
            for shift in (k * turn for k in range(-3, 4)):
                low, high = max(begin + shift, first), min(end + shift, last)
                if bool(low < high):
                    yield low.mid(), high.mid(), sense

    def _edges(self, first, last):
        """Ends of the panels between two angles, graded towards both and towards the anchors between them."""
        edges, turn = [first, last], 2 * arb.pi()
        anchors = [first, last]
        for anchor in self.anchors:
            anchors += [(anchor + k * turn).mid() for k in range(-2, 3) if first < anchor + k * turn < last]
        for centre in anchors:
            edges.append(centre)
            for k in range(_FINEST):
                edges += [(centre + side * arb(2) ** -k).mid() for side in (-1, 1)]
        edges = [edge.mid() for edge in edges if bool(edge >= first) and bool(edge <= last)]
        return sorted({edge.str(70, radius=False): edge for edge in edges}.values(), key=float_key(first))

    def _zeros(self, edges, sense, name):
        """Zeros of a signal between the ends of panels: changes of its sign, and dips that reach below 0."""
        angles = [edges[0]]
        for start, stop in pairwise(edges):
            angles += [*(theta for theta, _ in _nodes(start, stop)), stop]
        values = [self._at(angle, sense)[name] for angle in angles]
        found = []
        for k in range(1, len(angles)):
            if bool(values[k - 1] > 0) != bool(values[k] > 0):
                found.append(self._bisect(angles[k - 1], angles[k], sense, name))
        for k in range(len(angles)):
            sign = 1 if bool(values[k] > 0) else -1
            before, after = max(k - 1, 0), min(k + 1, len(angles) - 1)
            dip = sign * values[k]
            if bool(dip <= sign * values[before]) and bool(dip <= sign * values[after]):
                if bool(dip > 4 * (abs(values[before] - values[k]) + abs(values[after] - values[k]))):
                    continue
                lowest = self._lowest(angles[before], angles[after], sense, name, sign)
                if bool(sign * self._at(lowest, sense)[name] < 0):
                    found.append(self._bisect(angles[before], lowest, sense, name))
                    found.append(self._bisect(lowest, angles[after], sense, name))
        return found

    def _bisect(self, low, high, sense, name):
        positive = bool(self._at(low, sense)[name] > 0)
        for _ in range(120):
            middle = ((low + high) / 2).mid()
            if bool(self.at(middle, sense)[name] > 0) == positive:
                low = middle
            else:
                high = middle
        return low

    def _lowest(self, low, high, sense, name, sign):
        """Place of the minimum of ``sign * signal`` by thirds, to half of the digits of a double and more."""
        for _ in range(90):
            first, second = ((2 * low + high) / 3).mid(), ((low + 2 * high) / 3).mid()
            if bool(sign * self.at(first, sense)[name] <= sign * self.at(second, sense)[name]):
                high = second
            else:
                low = first
        return low

    def _extreme(self, pieces, name, sign):
        """Smallest value, or largest with a sign of -1: of the best three samples of each stroke, refined."""
        best = None
        for edges, sense in pieces:
            angles = [edges[0]]
            for start, stop in pairwise(edges):
                angles += [*(theta for theta, _ in _nodes(start, stop)), stop]
            values = [sign * self._at(angle, sense)[name] for angle in angles]
            order = sorted(range(len(angles)), key=lambda k: float(values[k]))[:1]
            for k in order:
                low, high = angles[max(k - 1, 0)], angles[min(k + 1, len(angles) - 1)]
                refined = sign * self.at(self._lowest(low, high, sense, name, sign), sense)[name]
                for value in (values[k], refined):
                    best = value if best is None or bool(value < best) else best
        return float(sign * best)


def float_key(origin):
    """A key that sorts angles by their distance from the first one, which doubles resolve near it."""
    return lambda angle: float(angle - origin)


def _nodes(start, stop):
    half, centre = (stop - start) / 2, (stop + start) / 2
    return [((centre + half * x).mid(), half * weight) for x, weight in _rule()]


class ExactFourBar(Loaded):
    """A crank-rocker under load, by the names of its parameters; lengths in mm, all else in SI units."""

    def __init__(self, design):
        super().__init__(design, {"speed": 1.0, "branch": 1.0, "gravity": 9.80665} | {
            f"{link}_centroid": 0.5 for link in ("crank", "coupler", "rocker")
        })  # fmt: skip
        r1, r2, r3, r4 = (self[name] for name in ("crank", "coupler", "rocker", "ground"))
        cosines = [(reach**2 + r4**2 - r3**2) / (2 * reach * r4) for reach in (r2 + r1, r2 - r1)]
        self.extended = self["branch"] * cosines[0].acos()
        self.overlapped = self["branch"] * (cosines[1].acos() - arb.pi())
        angles = [((r4**2 + r3**2 - reach**2) / (2 * r3 * r4)).acos() for reach in (r2 + r1, r2 - r1)]
        self.middle = self["branch"] * (arb.pi() - (angles[0] + angles[1]) / 2)
        self.anchors = (arb(0), arb.pi())

    def strokes(self, window):
        """Ends of the strokes of a window and the sense in which the rocker turns."""
        turn = 2 * arb.pi()
        first, last = self.overlapped.mid(), self.extended.mid()
        last = last if bool(last > first) else (last + turn).mid()
        # on branch 1 the rocker turns clockwise on the way to the extended position
        sense = 1 if bool(self["branch"] < 0) else -1
        there, back = (first, last, sense), (last, (first + turn).mid(), -sense)
        return {"overlapped_to_extended": [there], "extended_to_overlapped": [back], "cycle": [there, back]}[window]

    def at(self, theta, sense):
        """Signals at a crank angle, the rocker turning in a sense."""
        return self.balanced(theta, sense)[0]

    def balanced(self, theta, sense, turned_by=(0, 0, 0)):
        """The signals, the forces in the pins on crank, coupler, rocker and rocker, and the velocities of these links.

        `turned_by` are torques on crank, coupler and rocker besides the load.
        """
        r2, r3, w = self["coupler"] / 1000, self["rocker"] / 1000, self["speed"]
        ab = self["crank"] / 1000 * theta.cos(), self["crank"] / 1000 * theta.sin()
        pivot = (self["ground"] / 1000, arb(0))
        diagonal = _plus(pivot, ab, -1)
        square = _dot(diagonal, diagonal)
        along = (square + r2**2 - r3**2) / (2 * square)
        across = self["branch"] * (r2**2 / square - along * along).sqrt()
        bc = _plus((along * diagonal[0], along * diagonal[1]), _turned(diagonal), across)
        dc = _plus(bc, diagonal, -1)
        # velocities: w T(ab) + w2 T(bc) = w3 T(dc), T a quarter turn
        area = _cross(bc, dc)
        w2, w3 = -w * _cross(ab, dc) / area, -w * _cross(ab, bc) / area
        right = _plus((w**2 * ab[0], w**2 * ab[1]), bc, w2 * w2)
        right = _plus(right, dc, -w3 * w3)  # = a2 T(bc) - a3 T(dc)
        a2, minus_a3 = self._solve(_turned(bc), _turned(dc), right)
        a3 = -minus_a3
        gravity = (arb(0), self["gravity"])

        def inertial(mass, base, vector, rate, acceleration):
            """Mass times the acceleration of a centroid, less that of gravity."""
            total = _plus(_plus(base, _turned(vector), acceleration), vector, -rate * rate)
            return mass * (total[0] + gravity[0]), mass * (total[1] + gravity[1])

        zero = (arb(0), arb(0))
        arms = [
            (self[f"{link}_centroid"] * vector[0], self[f"{link}_centroid"] * vector[1])
            for link, vector in (("crank", ab), ("coupler", bc), ("rocker", dc))
        ]
        at_b = (-(w**2) * ab[0], -(w**2) * ab[1])
        f1 = inertial(self["crank_mass"], zero, arms[0], w, arb(0))
        f2 = inertial(self["coupler_mass"], at_b, arms[1], w2, a2)
        f3 = inertial(self["rocker_mass"], zero, arms[2], w3, a3)
        angle = arb.atan2(dc[1], dc[0])
        spring = self["stiffness"] * (angle - self.middle)
        load = self["constant_torque"] - self["opposing_torque"] * sense - spring - self["damping"] * w3
        about_d = self["inertia"] + self["rocker_inertia"]
        # dc x fc + load + arm x weight = about_d a3;  -(bc x fc) = I2 a2 + arm x f2
        load += turned_by[2]
        of_rocker = about_d * a3 - load + arms[2][0] * self["rocker_mass"] * self["gravity"]
        of_coupler = turned_by[1] - self["coupler_inertia"] * a2 - _cross(arms[1], f2)
        fc = self._solve((-dc[1], -bc[1]), (dc[0], bc[0]), (of_rocker, of_coupler))
        fb, fd = _plus(fc, f2), _plus(f3, fc, -1)
        fa = _plus(fb, f1)
        velocity = _plus((-ab[1] * w, ab[0] * w), _turned(arms[1]), w2)
        power = (
            _dot(f2, velocity) + self["coupler_inertia"] * a2 * w2 + about_d * a3 * w3
            + self["rocker_mass"] * self["gravity"] * arms[2][0] * w3 - load * w3
            + self["crank_mass"] * self["gravity"] * arms[0][0] * w - turned_by[0] * w - turned_by[1] * w2
        )  # fmt: skip
        torque = power / w
        return {
            "coupler_force": _dot(fc, bc) / r2, "rocker_axial_force": _dot(fc, dc) / r3,
            "rocker_moment": _cross(dc, fc),
            "drive_torque": torque, "power": power, "positive_power": power if bool(power > 0) else arb(0),
            "friction_power": self["opposing_torque"] * abs(w3) + self["damping"] * w3 * w3,
            **{f"pin_force_{pin}": _length(f) for pin, f in zip("abcd", (fa, fb, fc, fd), strict=True)},
        }, (fa, fb, fc, fd), (w, w2, w3)  # fmt: skip

    @staticmethod
    def _solve(first, second, right):
        """Factors x, y with x first + y second = right."""
        determinant = _cross(first, second)
        return _cross(right, second) / determinant, _cross(first, right) / determinant


def assert_signals(motion, exact, design, velocity, tolerance=1e-12):
    """Every signal under load of a motion is that of free bodies, relative to its peak, or to that of the power."""
    with ctx.workprec(256):
        bodies, senses = exact(design), np.sign(motion[velocity].to_numpy()).astype(int).tolist()
        angles = [arb(degrees) * arb.pi() / 180 for degrees in motion.index]
        rows = [bodies.at(angle, sense) for angle, sense in zip(angles, senses, strict=True)]
    powers = {name for name in rows[0] if name.endswith("power")}
    true = {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}
    of_powers = max(np.abs(true[name]).max() for name in powers)
    for name, values in true.items():
        size = of_powers if name in powers else np.abs(values).max()
        assert np.abs(motion[name] - values).max() <= tolerance * size, name


class ExactSliderCrank(Loaded):
    """A slider-crank under load, by the names of its parameters; lengths in mm, all else in SI units."""

    cornering = ("guide_force", "drive_torque")

    def __init__(self, design):
        super().__init__(
            design,
            {"offset": 0.0, "speed": 1.0, "gravity": 9.80665, "crank_centroid": 0.5, "rod_centroid": 0.5},
        )
        r, rod, offset = self["crank"], self["rod"], self["offset"]
        self.outer, self.inner = (offset / (rod + r)).asin(), arb.pi() + (offset / (rod - r)).asin()
        self.middle = ((((rod + r) ** 2 - offset**2).sqrt() + ((rod - r) ** 2 - offset**2).sqrt()) / 2000).mid()
        self.anchors = (arb.pi() / 2, -arb.pi() / 2)

    def strokes(self, window):
        """Ends of the strokes of a window and the sense of the slider's velocity."""
        outer, inner = self.outer.mid(), self.inner.mid()
        there, back = (outer, inner, -1), (inner, (outer + 2 * arb.pi()).mid(), 1)
        return {"outer_to_inner": [there], "inner_to_outer": [back], "cycle": [there, back]}[window]

    def at(self, theta, sense):
        """Signals at a crank angle, the slider moving in a sense."""
        r, rod, offset, w = self["crank"] / 1000, self["rod"] / 1000, self["offset"] / 1000, self["speed"]
        pin = r * theta.cos(), r * theta.sin()
        h = pin[1] - offset
        y = (rod**2 - h * h).sqrt()
        span = y, -h
        turning = -w * pin[0] / y
        pin_velocity, pin_acceleration = (-w * pin[1], w * pin[0]), (-(w**2) * pin[0], -(w**2) * pin[1])
        velocity = pin_velocity[0] + turning * h
        # the slider stays on its line
        spinning = (-pin_acceleration[1] - turning * turning * h) / y
        acceleration = pin_acceleration[0] + spinning * h - turning * turning * y
        gravity, mass, rod_mass = self["gravity"], self["mass"], self["rod_mass"]
        arm = self["rod_centroid"] * span[0], self["rod_centroid"] * span[1]
        centroid_velocity = _plus(pin_velocity, _turned(arm), turning)
        centroid = _plus(_plus(pin_acceleration, _turned(arm), spinning), arm, -turning * turning)
        f2 = rod_mass * centroid[0], rod_mass * (centroid[1] + gravity)
        crank_arm = self["crank_centroid"] * pin[0], self["crank_centroid"] * pin[1]
        f1 = (
            -(w**2) * self["crank_mass"] * crank_arm[0],
            self["crank_mass"] * (gravity - w**2 * crank_arm[1]),
        )
        applied = self["constant_force"] - sense * self["opposing_force"] - self["damping"] * velocity
        applied -= self["stiffness"] * (pin[0] + y - self.middle)
        needed = mass * acceleration - applied
        moment = self["rod_inertia"] * spinning + _cross(arm, f2)
        # V = -(h P + moment)/y on the slider, N = m g - V, P = needed + mu sense |N|
        numerator = mass * gravity + (moment + h * needed) / y
        side = 1 if bool(numerator >= 0) else -1
        guide = numerator / (1 - h / y * self["friction"] * sense * side)
        friction = self["friction"] * abs(guide)
        thrust = needed + sense * friction
        fc = thrust, mass * gravity - guide
        fb = _plus(fc, f2)
        fa = _plus(fb, f1)
        power = (
            thrust * velocity + _dot(f2, centroid_velocity) + self["rod_inertia"] * spinning * turning
            + self["crank_mass"] * gravity * w * crank_arm[0]
        )  # fmt: skip
        return {
            "thrust": thrust, "guide_force": guide, "drive_torque": power / w, "drive_power": power,
            "positive_power": power if bool(power > 0) else arb(0),
            "friction_power": (friction + self["opposing_force"]) * abs(velocity)
            + self["damping"] * velocity * velocity,
            "crank_pivot_force": _length(fa), "crank_pin_force": _length(fb),
            "slider_pin_force": _length(fc),
        }  # fmt: skip
