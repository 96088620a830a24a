"""What a mechanism with functions of its own declares of its loop, so that other methods solve it too."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from explore.mechanisms.linkages.table import LinkageTable
from explore.model.quantities import FloatArray

#: Parameters of designs by name.
Columns = Mapping[str, Any]
#: A given length, and its derivatives by the input angle.
Given = tuple[Any, Any, Any]


@dataclass(frozen=True, kw_only=True)
class LoopDeclaration:
    """The loop of a mechanism.

    Attributes
    ----------
    table
        The linkage; its last slot is the one of `law`.
    signals
        The signals that are the unknowns in the order of the table, angles first, then their derivatives; or what
        `motion` takes.
    design
        Parameters of a design with a full turn.
    smooth
        Parameters of a design far from all singular positions, on which orders of convergence are measured; empty for
        no measurement.
    limited
        The parameter that is changed until it has none; empty where a singular position is passed in each turn.
    law
        ``law(columns, angle, functions)``: the length that is given beside the angle of the driver.
    singular_angle
        ``singular_angle(columns, functions)``: where between 0 and pi, and at its mirror image, the
        matrix of the loop is singular.
    motion
        ``motion(columns, angle, values)``: the unknowns and their derivatives, (3 m, n, t), from the values of
        `signals`; None where they are that.
    derived
        ``derived(columns, values)``: further signals by name, from the unknowns and their derivatives, (3 m, t).
    """

    table: LinkageTable
    signals: tuple[str, ...]
    design: Mapping[str, float]
    smooth: Mapping[str, float] = field(default_factory=dict)
    limited: str = ""
    law: Callable[[Columns, Any, Any], Given] | None = None
    singular_angle: Callable[[Columns, Any], Any] | None = None
    motion: Callable[[Columns, FloatArray, FloatArray], FloatArray] | None = None
    derived: Callable[[Columns, FloatArray], Mapping[str, FloatArray]] | None = None
