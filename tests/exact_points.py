"""Points of floating links with 40 digits and more: complex numbers, and derivatives by mpmath's differences.

They share no formula with the package: a point is B + (s + i t) e^{i gamma}, its rates are differences of places.
"""

import mpmath
from exact_linkage import ExactLinkage
from exact_slider_crank import ExactSliderCrank
from exact_variable_crank import DIGITS, ExactVariableCrank


def path_of(mechanism, design, along, across):
    """The place of a point as a complex function of the input angle, rad."""
    return {"crank-rocker": _four_bar, "test-rig": _four_bar, "slider-crank": _slider_crank,
            "variable-crank": _variable_crank}[mechanism](design, mpmath.mpc(along, across))  # fmt: skip


def _four_bar(design, place):
    exact = ExactLinkage(*(design[name] for name in ("crank", "coupler", "rocker", "ground")),
                         branch=int(design.get("branch", 1)))  # fmt: skip
    return lambda theta: exact.r1 * mpmath.expj(theta) + place * mpmath.expj(exact.angles(theta)[0])


def _slider_crank(design, place):
    exact = ExactSliderCrank(design["crank"], design["rod"], design.get("offset", 0.0))
    return lambda theta: exact.r * mpmath.expj(theta) + place * mpmath.expj(exact.motion(theta)[3])


def _variable_crank(design, place):
    mpmath.mp.dps = DIGITS
    exact = ExactVariableCrank(**design)

    def point(phi):
        pin = exact.crank(phi) * mpmath.expj(phi)
        return pin + place * (exact.position(phi) - pin) / exact.rod

    return point


def signals(path, degrees, speed):
    """All signals of a point by the ends of their names, at an input angle in deg."""
    theta = mpmath.mpf(degrees) * mpmath.pi / 180
    place, first, second = path(theta), mpmath.diff(path, theta), mpmath.diff(path, theta, 2)
    velocity, acceleration = first * speed, second * speed**2
    return {
        "x": place.real, "y": place.imag, "velocity_x": velocity.real, "velocity_y": velocity.imag,
        "velocity": abs(velocity), "acceleration_x": acceleration.real, "acceleration_y": acceleration.imag,
        "acceleration": abs(acceleration), "curvature": (mpmath.conj(first) * second).imag / abs(first) ** 3,
    }  # fmt: skip
