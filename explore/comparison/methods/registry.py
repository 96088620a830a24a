"""All methods with the settings at which they are compared."""

from explore.base.errors import RequestError
from explore.base.suggest import suggestion
from explore.comparison.methods.circle_intersection import CircleIntersection
from explore.comparison.methods.closed_form import ClosedForm
from explore.comparison.methods.contract import Capability, Method, method_label
from explore.comparison.methods.dyads import PylinkageDyads, is_pylinkage_installed
from explore.comparison.methods.fsolve import Fsolve
from explore.comparison.methods.loop import Loop
from explore.comparison.methods.newton import Newton
from explore.comparison.methods.newton_compiled import CompiledNewton
from explore.comparison.methods.ode import VelocityIntegration
from explore.comparison.methods.runge_kutta import RungeKutta4
from explore.comparison.methods.textbook import TextbookArccos

_NEWTON_TOLERANCES = (1e-2, 1e-4, 1e-8, 1e-12)
#: Settings of methods of other packages, which may not be installed, by name.
_PEERS: dict[str, tuple[Method, ...]] = {"pylinkage": (PylinkageDyads(),)}
#: Settings of every method from coarse to fine, by name; empty for a peer that is not installed.
METHODS: dict[str, tuple[Method, ...]] = {
    "closed-form": (ClosedForm(),),
    "textbook": (TextbookArccos(),),
    "circles": (CircleIntersection(),),
    "newton": tuple(map(Newton, _NEWTON_TOLERANCES)),
    "newton-unchecked": tuple(Newton(tolerance, check_branch=False) for tolerance in _NEWTON_TOLERANCES),
    "newton-compiled": tuple(map(CompiledNewton, _NEWTON_TOLERANCES)),
    "pylinkage": _PEERS["pylinkage"] if is_pylinkage_installed() else (),
    "fsolve": tuple(map(Fsolve, (1e-4, 1e-6, 1.49012e-8, 1e-10))),
    "rk4": tuple(map(RungeKutta4, (36, 72, 180, 360, 1440))),
    "rk4-projected": tuple(RungeKutta4(steps, projected=True) for steps in (36, 360)),
    "rk45": tuple(VelocityIntegration("RK45", rtol) for rtol in (1e-3, 1e-6, 1e-9, 1e-12)),
    "dop853": tuple(VelocityIntegration("DOP853", rtol) for rtol in (1e-3, 1e-6, 1e-9, 1e-12)),
    "radau": tuple(VelocityIntegration("Radau", rtol) for rtol in (1e-3, 1e-6, 1e-9)),
    "rk45-projected": tuple(VelocityIntegration("RK45", rtol, projected=True) for rtol in (1e-3, 1e-6)),
    "dop853-projected": tuple(VelocityIntegration("DOP853", rtol, projected=True) for rtol in (1e-3, 1e-6)),
    "radau-projected": (VelocityIntegration("Radau", 1e-3, projected=True),),
}


def solves(method: Method, loop: Loop) -> bool:
    """Whether a method solves a loop."""
    if Capability.TWO_ANGLES in method.capabilities:
        return loop.is_triangle and loop.turns and loop.n_angles == 2
    return loop.is_triangle or Capability.TRIANGLE not in method.capabilities


def methods_for(loop: Loop) -> dict[str, tuple[Method, ...]]:
    """The methods that solve a loop, by name; without settings if they are not installed."""
    return {
        name: settings
        for name, settings in METHODS.items()
        if all(solves(method, loop) for method in settings or _PEERS[name])
    }


def find_method(name: str) -> Method:
    """The method of a name at its finest setting, or of a name and a setting such as ``rk45(rtol=0.001)``.

    Raises `RequestError` if there is no such method, or its package is not installed.
    """
    if METHODS.get(name):
        return METHODS[name][-1]
    if name in METHODS:
        raise RequestError(f"method {name!r} is not installed; pip install 'linkage-explore[peers]'")
    base = name.partition("(")[0]
    if base not in METHODS:
        raise RequestError(f"unknown method {name!r}; {suggestion(base, METHODS)}")
    by_label = {method_label(method): method for method in METHODS[base]}
    if name not in by_label:
        raise RequestError(f"unknown setting {name!r}; available: {', '.join(by_label)}")
    return by_label[name]


def check_method(method: Method, loop: Loop) -> None:
    """Raise `RequestError` if a method does not solve a loop."""
    if not solves(method, loop):
        kind = "two unknown angles" if Capability.TWO_ANGLES in method.capabilities else "two unknowns"
        others = ", ".join(methods_for(loop))
        raise RequestError(f"method {method.name!r} solves one loop with {kind}; available here: {others}")
