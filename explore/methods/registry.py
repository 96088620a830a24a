"""All methods, each with the settings at which it is compared."""

from __future__ import annotations

from functools import partial
from typing import Any

from explore.methods.closed_form import ClosedForm
from explore.methods.contract import Method
from explore.methods.dyads import PylinkageDyads, available
from explore.methods.fsolve import Fsolve
from explore.methods.newton import Newton
from explore.methods.ode import VelocityIntegration
from explore.methods.runge_kutta import RungeKutta4
from explore.methods.textbook import TextbookArccos


def _settings(kind: Any, name: str, values: tuple[float, ...], **fixed: Any) -> tuple[Method, ...]:
    """One method at several settings, from coarse to fine; the others fixed."""
    return tuple(kind(**{name: value}, **fixed) for value in values)


#: From coarse to fine settings, by name; none of a peer that is not installed.
METHODS: dict[str, tuple[Method, ...]] = {
    "closed-form": (ClosedForm(),),
    "textbook": (TextbookArccos(),),
    "newton": _settings(Newton, "tolerance", (1e-2, 1e-4, 1e-8, 1e-12)),
    "newton-unchecked": _settings(Newton, "tolerance", (1e-2, 1e-4, 1e-8, 1e-12), check_branch=False),
    "pylinkage": (PylinkageDyads(),) if available() else (),
    "fsolve": _settings(Fsolve, "tolerance", (1e-4, 1e-6, 1.49012e-8, 1e-10)),
    "rk4": _settings(RungeKutta4, "steps", (36, 72, 180, 360, 1440)),
    "rk4-projected": _settings(partial(RungeKutta4, projected=True), "steps", (36, 360)),
    "rk45": _settings(partial(VelocityIntegration, "RK45"), "rtol", (1e-3, 1e-6, 1e-9, 1e-12)),
    "dop853": _settings(partial(VelocityIntegration, "DOP853"), "rtol", (1e-3, 1e-6, 1e-9, 1e-12)),
    "radau": _settings(partial(VelocityIntegration, "Radau"), "rtol", (1e-3, 1e-6, 1e-9)),
    "rk45-projected": _settings(partial(VelocityIntegration, "RK45", projected=True), "rtol", (1e-3, 1e-6)),
    "dop853-projected": _settings(partial(VelocityIntegration, "DOP853", projected=True), "rtol", (1e-3, 1e-6)),
    "radau-projected": _settings(partial(VelocityIntegration, "Radau", projected=True), "rtol", (1e-3,)),
}
