"""Variable cranks under load with 256 bits, which the caller sets; see `exact_loads`, whose statistics these are.

The slider's law is the integral of its speed, the pin's rates follow from the loop, forces from the equilibrium of
slider, rod, pin and disc, the drive torque from the balance of power. No formula is shared with the package.
"""

from itertools import pairwise

from exact_loads import Loaded, _cross, _dot, _length, _plus, _turned
from flint import arb

#: Smoothsteps by order, as coefficients of powers from 0.
_STEPS = {1: (0, 0, 3, -2), 2: (0, 0, 0, 10, -15, 6), 3: (0, 0, 0, 0, 35, -84, 70, -20)}


class ExactGroove(Loaded):
    """A variable crank under load, by the names of its parameters; lengths in mm, all else in SI units."""

    cornering = ("guide_force", "drive_torque")

    def __init__(self, design):
        super().__init__(design, {"mass": 1.0, "gravity": 9.80665, "rod_centroid": 0.5, "blend_order": 2.0})
        self.rod, self.speed = self["rod"] / 1000, self["speed"]
        self.travel = self["slider_speed"] / 1000 / self.speed
        self.width, self.order = self.speed * self["reversal_time"], int(design.get("blend_order", 2))
        rod, travel = self.rod, self.travel
        regular = ((-(rod**2) + rod * (rod**2 + 4 * travel**2).sqrt()) / 2).sqrt()
        self.regular_angle = arb.atan2(rod, regular)
        self.start = (rod**2 + regular**2).sqrt() + travel * self._path(self.regular_angle)
        self.middle = self.start - travel * self._path(arb.pi()) / 2
        self.anchors = ()  # all is smooth through the regular angle, where quotients of zeros have no digits

    def strokes(self, window):
        """Ends of the parts of a window with one law, and the sense of the slider's velocity."""
        half, turn = self.width / 2, 2 * arb.pi()
        there = [arb(0), half.mid(), (arb.pi() - half).mid(), arb.pi().mid()]
        back = [turn.mid() - place for place in reversed(there)]
        steady = [(*there[1:3], -1)]
        there = [(*ends, -1) for ends in pairwise(there)]
        back = [(*ends, 1) for ends in pairwise(back)]
        return {
            "outer_to_inner": there, "inner_to_outer": back, "cycle": [*there, *back], "steady": steady,
        }[window]  # fmt: skip

    def _edges(self, first, last):
        """Panels of at most an eighth of a radian too, which resolve what crosses 0 within a part."""
        edges = super()._edges(first, last)
        fine = []
        for start, stop in pairwise(edges):
            count = int(float(8 * (stop - start))) + 1
            fine += [(start + (stop - start) * k / count).mid() for k in range(count)]
        return [*fine, edges[-1]]

    def _near(self, folded):
        """The angle from the nearer dead centre, and whether that is in its reversal."""
        near = folded if bool(folded < arb.pi() / 2) else arb.pi() - folded
        return near, bool(near < self.width / 2)

    def _law(self, folded):
        """The share of the wanted speed on the way to the inner dead centre, and its slope."""
        near, is_reversal = self._near(folded)
        if not is_reversal:
            return arb(1), arb(0)
        x = near / self.width + arb(1) / 2
        step = sum((c * x**k for k, c in enumerate(_STEPS[self.order])), arb(0))
        slope = sum((k * c * x ** (k - 1) for k, c in enumerate(_STEPS[self.order]) if k), arb(0)) / self.width
        return 2 * step - 1, (2 if bool(folded < arb.pi() / 2) else -2) * slope

    def _blended(self, near):
        """The integral of the share from a dead centre to an angle in its reversal."""

        def whole(x):
            return sum((c * x ** (k + 1) / (k + 1) for k, c in enumerate(_STEPS[self.order])), arb(0))

        return 2 * self.width * (whole(near / self.width + arb(1) / 2) - whole(arb(1) / 2)) - near

    def _path(self, folded):
        """The integral of the share from the outer dead centre."""
        half = self.width / 2
        near, is_reversal = self._near(folded)
        if bool(folded < arb.pi() / 2) and is_reversal:
            return self._blended(near)
        if not is_reversal:
            return self._blended(half) + folded - half
        return 2 * self._blended(half) + arb.pi() - self.width - self._blended(near)

    def at(self, theta, sense):
        """Signals at an angle of the disc, the slider moving in a sense."""
        turn, w = 2 * arb.pi(), self.speed
        # from -pi/2 to 3 pi/2 on the way in, from pi/2 to 5 pi/2 on the way out: dead centres belong to both
        angle = theta - turn * ((theta - sense * arb.pi() / 2) / turn).mid().floor()
        folded = angle if sense < 0 else turn - angle
        share, slope = self._law(folded)
        x = self.start - self.travel * self._path(folded)
        velocity = sense * self.travel * w * share
        acceleration = -self.travel * w**2 * slope
        out, around = (angle.cos(), angle.sin()), (-angle.sin(), angle.cos())
        height = x * angle.sin()
        root = (self.rod**2 - height * height).sqrt()
        crank = x * out[0] + (root if bool(folded > self.regular_angle) else -root)
        pin = crank * out[0], crank * out[1]
        span = x - pin[0], -pin[1]
        # the rod keeps its length: span . (slider' - pin') = 0, with pin' = rate out + w crank around
        along = _dot(span, out)
        rate = (span[0] * velocity - w * crank * _dot(span, around)) / along
        pin_velocity = _plus((rate * out[0], rate * out[1]), around, w * crank)
        change = velocity - pin_velocity[0], -pin_velocity[1]
        rest = span[0] * acceleration + _dot(change, change) + w**2 * crank * along
        second = (rest - 2 * w * rate * _dot(span, around)) / along
        pin_acceleration = _plus(
            ((second - w**2 * crank) * out[0], (second - w**2 * crank) * out[1]), around, 2 * w * rate
        )
        relative = acceleration - pin_acceleration[0], -pin_acceleration[1]
        turning, spinning = _cross(span, change) / self.rod**2, _cross(span, relative) / self.rod**2
        return self._loaded(
            sense, x, velocity, acceleration, span, turning, spinning, out, around, pin, pin_velocity, pin_acceleration
        )

    def _loaded(self, sense, x, velocity, acceleration, span, turning, spinning, out, around, pin, pin_velocity,
                pin_acceleration):  # fmt: skip
        gravity, w = self["gravity"], self.speed
        arm = self["rod_centroid"] * span[0], self["rod_centroid"] * span[1]
        centroid_velocity = _plus(pin_velocity, _turned(arm), turning)
        centroid = _plus(_plus(pin_acceleration, _turned(arm), spinning), arm, -turning * turning)
        of_rod = self["rod_mass"] * centroid[0], self["rod_mass"] * (centroid[1] + gravity)
        of_pin = self["pin_mass"] * pin_acceleration[0], self["pin_mass"] * (pin_acceleration[1] + gravity)
        centre = self["disc_centroid"] / 1000
        of_disc = (
            -self["disc_mass"] * w**2 * centre * out[0], self["disc_mass"] * (gravity - w**2 * centre * out[1])
        )  # fmt: skip
        applied = self["constant_force"] - sense * self["opposing_force"] - self["damping"] * velocity
        needed = self["mass"] * acceleration - applied + self["stiffness"] * (x - self.middle)
        # the rod about the pin: span x (-C) = moment, with C = (thrust, m g - N) and thrust = needed + sense mu |N|
        moment = self["rod_inertia"] * spinning + _cross(arm, of_rod)
        numerator = self["mass"] * gravity + (moment - span[1] * needed) / span[0]
        side = 1 if bool(numerator >= 0) else -1
        guide = numerator / (1 + span[1] / span[0] * self["friction"] * sense * side)
        friction = self["friction"] * abs(guide)
        at_slider = needed + sense * friction, self["mass"] * gravity - guide
        at_pin = _plus(at_slider, of_rod)
        carried = _plus(at_pin, of_pin)  # = slot around + groove normal
        normal = pin_velocity[1], -pin_velocity[0]
        length = _length(normal)
        normal = normal[0] / length, normal[1] / length
        determinant = _cross(around, normal)
        slot, groove = _cross(carried, normal) / determinant, _cross(around, carried) / determinant
        at_disc = _plus(of_disc, around, slot)
        power = (
            at_slider[0] * velocity + _dot(of_rod, centroid_velocity) + self["rod_inertia"] * spinning * turning
            + _dot(of_pin, pin_velocity) + self["disc_mass"] * gravity * w * centre * out[0]
        )  # fmt: skip
        return {
            "thrust": at_slider[0], "guide_force": guide, "groove_force": groove, "slot_force": slot,
            "crank_pin_force": _length(at_pin), "slider_pin_force": _length(at_slider),
            "disc_pivot_force": _length(at_disc), "drive_torque": power / w, "drive_power": power,
            "positive_power": power if bool(power > 0) else arb(0),
            # without abs(), which has no digits of a velocity of 0
            "friction_power": (friction + self["opposing_force"]) * sense * velocity
            + self["damping"] * velocity * velocity,
        }  # fmt: skip
