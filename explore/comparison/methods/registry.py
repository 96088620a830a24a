"""All methods with the settings at which they are compared, and the loops that they solve."""

from explore.base.errors import RequestError
from explore.base.suggest import suggestion
from explore.comparison.methods.circle_intersection import CircleIntersection
from explore.comparison.methods.closed_form import ClosedForm
from explore.comparison.methods.contract import Capability, Method, method_label
from explore.comparison.methods.dyads import PylinkageDyads, is_pylinkage_installed
from explore.comparison.methods.four_bar_loop import FOUR_BAR
from explore.comparison.methods.fsolve import Fsolve
from explore.comparison.methods.newton import Newton
from explore.comparison.methods.newton_compiled import CompiledNewton
from explore.comparison.methods.ode import VelocityIntegration
from explore.comparison.methods.runge_kutta import RungeKutta4
from explore.comparison.methods.slider_crank_loop import SLIDER_CRANK
from explore.comparison.methods.textbook import TextbookArccos
from explore.comparison.methods.variable_crank_loop import VARIABLE_CRANK
from explore.comparison.methods.vector_loop import VectorLoop

_NEWTON_TOLERANCES = (1e-2, 1e-4, 1e-8, 1e-12)
#: Settings of every method from coarse to fine, by name; empty for a peer that is not installed.
METHODS: dict[str, tuple[Method, ...]] = {
    "closed-form": (ClosedForm(),),
    "textbook": (TextbookArccos(),),
    "circles": (CircleIntersection(),),
    "newton": tuple(map(Newton, _NEWTON_TOLERANCES)),
    "newton-unchecked": tuple(Newton(tolerance, check_branch=False) for tolerance in _NEWTON_TOLERANCES),
    "newton-compiled": tuple(map(CompiledNewton, _NEWTON_TOLERANCES)),
    "pylinkage": (PylinkageDyads(),) if is_pylinkage_installed() else (),
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


#: Loops that the methods solve, by the name of their mechanism.
LOOPS = {loop.name: loop for loop in (FOUR_BAR, SLIDER_CRANK, VARIABLE_CRANK)}


def methods_for(loop: VectorLoop) -> dict[str, tuple[Method, ...]]:
    """The methods that solve a loop, by name."""
    return {
        name: settings
        for name, settings in METHODS.items()
        if loop is FOUR_BAR or (settings and Capability.FOUR_BAR_ONLY not in settings[0].capabilities)
    }


def find_loop(mechanism: str) -> VectorLoop:
    """The loop of a mechanism; `RequestError` if the methods know none."""
    if mechanism not in LOOPS:
        raise RequestError(f"{mechanism} has only the closed form; other methods solve {', '.join(LOOPS)}")
    return LOOPS[mechanism]


def find_method(name: str) -> Method:
    """The method of a name at its finest setting, or of a name and a setting such as ``rk45(rtol=0.001)``.

    Raises `RequestError` if there is no such method, or its package is not installed.
    """
    if METHODS.get(name):
        return METHODS[name][-1]
    if name in METHODS:
        raise RequestError(f"method {name!r} is not installed; pip install 'linkage-explore[peers]'")
    by_label = {method_label(method): method for settings in METHODS.values() for method in settings}
    if name not in by_label:
        raise RequestError(f"unknown method {name!r}; {suggestion(name, [*METHODS, *by_label])}")
    return by_label[name]


def check_method(method: Method, loop: VectorLoop) -> None:
    """Raise `RequestError` if a method solves four-bar linkages only, and the loop is another."""
    if Capability.FOUR_BAR_ONLY in method.capabilities and loop is not FOUR_BAR:
        others = ", ".join(methods_for(loop))
        raise RequestError(f"method {method.name!r} solves four-bar linkages only; {loop.name} is solved by {others}")
