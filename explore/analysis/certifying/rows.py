"""What a row of results says, checked against enclosures: each number, the status, and feasibility."""

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Literal

from flint import arb

from explore.analysis.certifying.balls import UndecidedError, UnprovedError, bounds, exact, sure_sign, with_more_bits
from explore.analysis.certifying.designs import Design
from explore.evaluation.kinematics import may_screen
from explore.model.quantities import AnyMetric, GivenMetric, Metric
from explore.model.request import Constraint
from explore.model.status import Status

Verdict = Literal["proved", "open", "refuted"]
#: Rounding of a number in closed form and of the change to other units and speeds, relative to its scale.
ROUNDING = 2e-15
#: Least distance from a bound that is kept for certain, in units of its last place.
_ROOM = 2.0
#: Statuses of designs that have no numbers to certify.
_NOT_COMPUTED = (Status.PENDING, Status.NOT_FINITE, Status.FAILED, Status.NOT_GIVEN, Status.UNREACHABLE)


@dataclass
class Proof:
    """Sentences on what is open and what is refuted of a design, and the doubles next to each metric's enclosure."""

    open: list[str] = field(default_factory=list)
    refuted: list[str] = field(default_factory=list)
    intervals: dict[str, tuple[float, float]] = field(default_factory=dict)

    @property
    def verdict(self) -> Verdict:
        """Refuted if a statement is false, else open if one is not proved."""
        if self.refuted:
            return "refuted"
        return "open" if self.open else "proved"

    @property
    def reason(self) -> str:
        """Sentences on refuted numbers, then on open ones; empty if all is proved."""
        return "; ".join((*self.refuted, *self.open))

    def expect(self, holds: bool, sentence: str) -> None:
        """Note that a statement is refuted unless it holds."""
        if not holds:
            self.refuted.append(sentence)


def certify_row(design: Design, row: Mapping[str, float]) -> Proof:
    """Check all numbers of a row, its status and its feasibility."""
    proof = Proof()
    status = int(row["status"])
    if not design.is_usable:
        proof.expect(status == Status.NOT_FINITE, "a parameter is not a usable number, but the status does not say so")
        _check_nothing_is_told(design, row, proof)
        _expect_ok_if_feasible(row, proof)
        return proof
    own = design.request.mechanism.statuses.get(status)
    if status in _NOT_COMPUTED or (own and own.is_undecided):
        proof.open.append(f"nothing was computed: {own.label if own else Status(status).label}")
        _expect_ok_if_feasible(row, proof)
        return proof
    with _open_if_unproved(proof):
        _check_status(design, row, proof)
    for metric in design.request.metrics:
        with _open_if_unproved(proof):
            _check_metric(design, metric, row, proof)
    signs = _check_constraints(design, row, proof) | _signs_of_given(design, row)
    if status == Status.SCREENED:
        metrics = [constraint.metric for constraint in design.request.constraints]
        signs = {metric.name: signs[metric.name] for metric in metrics if may_screen(design.request, metric)}
    _check_feasibility(row, signs, proof)
    return proof


def _expect_ok_if_feasible(row: Mapping[str, float], proof: Proof) -> None:
    proof.expect(row["status"] == Status.OK or not row["feasible"], "it is not feasible: its status is not ok")


def _check_nothing_is_told(design: Design, row: Mapping[str, float], proof: Proof) -> None:
    """Check that what is computed of a design has no number."""
    blank = {metric.name: metric for metric in design.request.metrics if not isinstance(metric, GivenMetric)}
    margins = [f"{constraint.metric.name}_margin" for constraint in design.request.constraints]
    for name in [*blank, *(margin for margin in margins if margin.removesuffix("_margin") in blank)]:
        is_label = isinstance(metric := blank.get(name), Metric) and bool(metric.labels)
        is_blank = row[name] == -1 if is_label else math.isnan(row[name])
        proof.expect(is_blank, f"{name} is undefined, not {row[name]:.6g}")


@contextmanager
def _open_if_unproved(proof: Proof) -> Iterator[None]:
    """Note what has no proof as open, once."""
    try:
        yield
    except UnprovedError as reason:
        if str(reason) not in proof.open:
            proof.open.append(str(reason))


def _check_status(design: Design, row: Mapping[str, float], proof: Proof) -> None:
    labels = design.request.mechanism.status_labels
    stored, true, tolerance, error = int(row["status"]), design.status, design.request.tolerance, row["error"]
    possible = {Status.OK, Status.SCREENED, Status.TOLERANCE_NOT_MET} if true == Status.OK else {true}
    names = [labels.get(code, str(code)) for code in (true, stored)]
    proof.expect(stored in possible, f"status is {names[0]} by exact signs, not {names[1]}")
    if stored == Status.OK:
        proof.expect(error <= tolerance, f"error {error:g} misses the tolerance {tolerance:g}")
    elif stored == Status.TOLERANCE_NOT_MET:
        proof.expect(not error <= tolerance, f"error {error:g} meets the tolerance {tolerance:g}")


def _check_metric(design: Design, metric: AnyMetric, row: Mapping[str, float], proof: Proof) -> None:
    """Check a metric and note its interval."""
    stored = float(row[metric.name])
    proof.intervals[metric.name] = math.nan, math.nan
    enclosure = design.enclose(metric)
    if enclosure is not None:
        proof.intervals[metric.name] = bounds(enclosure.ball)
    if isinstance(metric, Metric) and metric.labels:
        code = -1 if enclosure is None else int(enclosure.ball.unique_fmpz())
        names = [dict(enumerate(metric.labels)).get(number, "undefined") for number in (code, int(stored))]
        proof.expect(stored == code, f"{metric.name} is {names[0]}, not {names[1]}")
        return
    if _is_number(metric.name, metric, design, row, proof):
        _check_number(metric.name, stored, design, _Claim(metric, _error(metric, design, row)), proof)


def _error(metric: AnyMetric, design: Design, row: Mapping[str, float]) -> float:
    """The error bound of a metric: that of the row, but 0 of closed forms without anything that is solved for."""
    is_exact = isinstance(metric, Metric) and design.request.mechanism.closed_error_row < 0
    return 0.0 if is_exact else float(row["error"])


def _is_number(name: str, metric: AnyMetric, design: Design, row: Mapping[str, float], proof: Proof) -> bool:
    """Whether a column and the metric that it depends on are numbers; one that is not must not be one."""
    stored = float(row[name])
    is_defined = design.enclose(metric) is not None
    if math.isnan(stored):
        is_left_out = row["status"] == Status.SCREENED and not isinstance(metric, Metric)
        proof.expect(is_left_out or not is_defined, f"{name} is missing")
        return False
    proof.expect(math.isfinite(stored), f"{name} is {stored}")
    proof.expect(is_defined, f"{name} is undefined, not {stored:.6g}")
    return math.isfinite(stored) and is_defined


@dataclass(frozen=True)
class _Claim:
    """A number of a row, a metric or the margin of its constraint, and its relative error bound."""

    metric: AnyMetric
    error: float
    constraint: Constraint | None = None

    def enclose(self, design: Design, bits: int) -> tuple[arb, arb]:
        """The true number, and the largest error that the row allows."""
        enclosure = design.enclosure(self.metric, bits)
        if enclosure is None:
            raise UndecidedError
        allowed = enclosure.scale * (arb(self.error) + arb(ROUNDING))
        if self.constraint is None:
            return enclosure.ball, allowed
        margin = design.margin(self.constraint, bits)
        return margin, allowed + _largest_bound(self.constraint) * arb(2.0**-53)


def _largest_bound(constraint: Constraint) -> float:
    return max(abs(bound) for bound in (constraint.minimum, constraint.maximum) if bound is not None)


def _check_number(name: str, stored: float, design: Design, claim: _Claim, proof: Proof) -> None:
    """Check that a number is within its error bound of the true one."""
    number = arb(exact(stored))

    def find(bits: int) -> tuple[bool, float, float] | None:
        true, allowed = claim.enclose(design, bits)
        difference = abs(number - true)
        is_within = bool(difference <= allowed)
        return (is_within, float(difference), float(allowed)) if is_within or difference > allowed else None

    is_within, off, allowed = with_more_bits(find, f"whether {name} is within its error bound")
    proof.expect(is_within, f"{name} {stored!r} is off by {off:.2g}, its error bound is {allowed:.2g}")


def _check_constraints(design: Design, row: Mapping[str, float], proof: Proof) -> dict[str, int | str]:
    """Check the margins; return by metric whether its constraint holds (1) or fails (-1), or why that is open."""
    signs: dict[str, int | str] = {}
    for constraint in design.request.constraints:
        metric = constraint.metric
        name = f"{metric.name}_margin"
        with _open_if_unproved(proof):
            if _is_number(name, metric, design, row, proof):
                _check_number(
                    name, float(row[name]), design, _Claim(metric, _error(metric, design, row), constraint), proof
                )
        try:
            signs[metric.name] = _sign_of_margin(design, constraint)
        except UnprovedError as reason:
            signs[metric.name] = str(reason)
    return signs


def _signs_of_given(design: Design, row: Mapping[str, float]) -> dict[str, int | str]:
    """The signs of the margins of metrics that come with the designs, as they are in the row."""
    request = design.request
    computed = {f"{constraint.metric.name}_margin" for constraint in request.constraints}
    others = row.keys() - computed - {metric.name for metric in request.metrics}
    margins = [name for name in sorted(others) if name.endswith("_margin")]
    return {name.removesuffix("_margin"): 1 if row[name] >= 0.0 else -1 for name in margins}


def _sign_of_margin(design: Design, constraint: Constraint) -> int:
    """1 if a constraint holds strictly, -1 if it fails; UnprovedError if neither is certain beyond rounding."""
    room, name = _ROOM * math.ulp(_largest_bound(constraint)), constraint.metric.name

    def find(bits: int) -> tuple[int, bool] | None:
        margin = design.margin(constraint, bits)
        return (-1, True) if margin is None else (sure_sign(margin), bool(margin > room))

    sign, is_clear = with_more_bits(find, f"whether {name} keeps its bound")
    if sign >= 0 and not is_clear:
        raise UnprovedError(f"{name} keeps its bound by no more than the rounding of a double")
    return sign


def _check_feasibility(row: Mapping[str, float], signs: Mapping[str, int | str], proof: Proof) -> None:
    """Check the column `feasible`, and that a screened design fails a constraint of those that screen."""
    failing = [name for name, sign in signs.items() if sign == -1]
    unknown = [reason for reason in dict.fromkeys(signs.values()) if isinstance(reason, str)]
    is_screened, is_ok = row["status"] == Status.SCREENED, row["status"] == Status.OK
    if row["feasible"]:
        _expect_ok_if_feasible(row, proof)
        proof.expect(not failing, f"it is not feasible: {', '.join(failing)}")
    elif is_ok or is_screened:
        false = "it is feasible" if is_ok else "it is screened, but no constraint fails that is known without samples"
        proof.expect(bool(failing or unknown), false)
    if not failing and (is_ok or is_screened):
        proof.open += [reason for reason in unknown if reason not in proof.open]
