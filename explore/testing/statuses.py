"""The status of every design: what it promises of the row, and that impossible values have one."""

from collections.abc import Iterator

import numpy as np

from explore.model.quantities import SampledMetric
from explore.model.status import Status
from explore.testing.subject import COMPUTED, Subject, WindowArgument, name_of

#: Least share of drawn designs that must be computed, so that the other checks see something.
_SHARE = 0.1
#: Tolerance of the evaluations.
_TOLERANCE = 1e-9


def wrong_statuses(subject: Subject) -> Iterator[str]:
    """A sentence for each promise of a status that some design breaks."""
    count = int(np.count_nonzero(subject.is_computed))
    if count < _SHARE * len(subject):
        yield (
            f"only {count} of {len(subject)} designs are computed; narrow the ranges of the study to designs that "
            "move, or give such designs with designs={...}, parameters by name"
        )
    for window, drive in subject.windows():
        yield from _wrong_rows(subject, window, drive)
    yield from _accepted_parameters(subject)


def _wrong_rows(subject: Subject, window: WindowArgument, drive: str) -> Iterator[str]:
    """Rows of a window whose numbers do not fit their status."""
    metrics = [metric for metric in subject.all_metrics(window) if isinstance(metric, SampledMetric)]
    result = subject.evaluate([metric.name for metric in metrics], window, drive, _TOLERANCE)
    status, error = result["status"], result["error"]
    is_ok, is_computed = status == Status.OK, np.isin(status, COMPUTED)
    over = name_of(window)
    rules = {
        f"a status over {over} has a code that means nothing": (
            ~np.isin(status, list(subject.mechanism.status_labels))
        ),
        f"a design over {over} is still pending after its evaluation": status == Status.PENDING,
        f"the bound over {over} misses the tolerance in spite of the status 'ok'": is_ok & ~(error <= _TOLERANCE),
        f"the bound over {over} meets the tolerance in spite of the status 'tolerance_not_met'": (
            (status == Status.TOLERANCE_NOT_MET) & (error <= _TOLERANCE)
        ),
        f"'feasible' over {over} contradicts the status": result["feasible"].astype(bool) != is_ok,
    }
    # A row keeps its other values where one is missing or not finite.
    is_empty = ~is_computed & ~np.isin(status, (Status.NOT_GIVEN, Status.NOT_FINITE))
    for metric in metrics:
        undefined = np.isnan(result[metric.name])
        if metric.statistic != "cv" and (is_ok & undefined).any():
            rules[f"{metric.name} over {over} is undefined in spite of the status 'ok'"] = is_ok & undefined
        if (is_empty & ~undefined).any():
            rules[f"{metric.name} over {over} has a value in spite of its status"] = is_empty & ~undefined
    has_strokeless = any(own.lacks_strokes for own in subject.mechanism.statuses.values())
    for closed_form in subject.mechanism.metrics if has_strokeless else ():
        if closed_form.is_partial:
            continue
        # alone, because a metric that needs strokes decides the status of the others
        result = subject.evaluate([closed_form.name], window, drive, _TOLERANCE)
        rule = f"{closed_form.name} over {over} is undefined in spite of the status 'ok'"
        rules[rule] = (result["status"] == Status.OK) & np.isnan(result[closed_form.name])
    for sentence, broken in rules.items():
        if broken.any():
            yield f"{sentence}, for {subject.describe(int(np.flatnonzero(broken)[0]))}"


def _accepted_parameters(subject: Subject) -> Iterator[str]:
    """Parameters of which a value outside the declared range does not give the status 'not_finite'."""
    mechanism, designs = subject.mechanism, subject.complete_designs
    metrics = [metric.name for metric in mechanism.metrics] or [mechanism.any_metric]
    window, drive = next(iter(subject.windows()))
    for parameter in mechanism.parameters:
        for value in (np.nan, np.inf, -np.inf, -1.0, 0.0):
            if parameter.allows(value):
                continue
            changed = designs | {parameter.name: np.full(len(subject), value)}
            result = subject.evaluate(metrics, window, drive, designs=changed)
            if (result["status"] != Status.NOT_FINITE).any():
                yield f"{parameter.name} = {value:g} is outside its range, but its status is not 'not_finite'"
