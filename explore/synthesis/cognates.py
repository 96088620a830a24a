"""The two other four-bar linkages that draw the same path: Roberts' cognates.

Source: S. Roberts, On three-bar motion in plane space, Proc. London Math. Soc. 7 (1875) 14-23; the construction by
parallelograms is Cayley's.
"""

import numpy as np

from explore.base.errors import RequestError
from explore.model.quantities import FloatArray
from explore.synthesis.linkages import FourBar


def third_pivot(linkage: FourBar) -> complex:
    """The pivot that only the cognates have; the three pivots form a triangle similar to that of the coupler."""
    return linkage.crank_pivot + linkage.point * (linkage.rocker_pivot - linkage.crank_pivot)


def find_cognates(linkage: FourBar, angle: float = 0.0) -> tuple[FourBar, FourBar]:
    """The cognates at the pivots of the crank and of the rocker.

    The first link of the one turns about the crank's pivot as the coupler of the linkage does, the first link of the
    other about the third pivot as its crank does; their coupler points draw the path of the linkage. The first link of
    the first need not turn fully, so that its branch may differ between positions: it is the one at an angle of the
    crank, rad. Raises `RequestError` if the linkage cannot be assembled there, or the coupler point is a pin, whose
    path is a circle: a cognate would have a link without length.
    """
    kappa = linkage.point
    if kappa in (0, 1):
        raise RequestError("the coupler point is a pin of the linkage, so that there are no cognates")
    third = third_pivot(linkage)
    crank = complex(linkage.crank_pins(np.array([angle]))[0]) - linkage.crank_pivot
    rocker = complex(linkage.rocker_pins(np.array([angle]))[0]) - linkage.rocker_pivot
    if np.isnan(rocker):
        raise RequestError(f"the linkage cannot be assembled at the crank angle {angle:g} rad")
    at_crank = FourBar(
        crank_pivot=linkage.crank_pivot,
        rocker_pivot=third,
        crank=abs(kappa) * linkage.coupler,
        coupler=abs(kappa) * linkage.crank,
        rocker=abs(kappa) * linkage.rocker,
        # Coupler EG with G = E + kappa (A - A0) and M = E + (A - A0): M - E is 1/kappa of the coupler.
        point=1.0 / kappa,
        # EK x EG = |kappa|^2 (rocker x crank), of the vectors from the pivots of the given linkage, negated.
        branch=1 if (rocker.conjugate() * crank).imag < 0.0 else -1,
    )
    at_third = FourBar(
        crank_pivot=third,
        rocker_pivot=linkage.rocker_pivot,
        crank=abs(1.0 - kappa) * linkage.crank,
        coupler=abs(1.0 - kappa) * linkage.rocker,
        rocker=abs(1.0 - kappa) * linkage.coupler,
        # Coupler HF, at all positions on the other side of its diagonal than AB of its own, with H = M - kappa (B - B0)
        # and F = M - (B - B0): M - H is kappa / (kappa - 1) of the coupler.
        point=kappa / (kappa - 1.0),
        branch=-linkage.branch,
    )
    return at_crank, at_third


def cognate_angles(linkage: FourBar, angles: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Angles of the first links of both cognates in the plane at angles of the crank there, rad; NaN where none are."""
    pins = linkage.crank_pins(angles)
    couplers = linkage.rocker_pins(angles) - pins
    # The first link of one is M - A, that of the other (1 - kappa)(A - A0).
    at_third = np.where(np.isnan(couplers), np.nan, (1.0 - linkage.point) * (pins - linkage.crank_pivot))
    return np.angle(linkage.point * couplers), np.angle(at_third)
