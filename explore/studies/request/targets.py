"""Targets of a study, of a request and of results: read, checked against the mechanism, and found again."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from explore.base.errors import Problems, RequestError
from explore.base.suggest import closest_name, format_value, suggestion
from explore.model.mechanism import Mechanism
from explore.model.targets import DwellTarget, FunctionTarget, PathTarget, PosesTarget, Target
from explore.studies.request.dwell_targets import read_dwell_target
from explore.studies.request.function_targets import read_function_target
from explore.studies.request.path_targets import read_path_target
from explore.studies.request.pose_targets import read_poses_target

#: Target, or the section of a study file that describes one.
TargetOrSection = Target | Mapping[str, Any]

_Read = Callable[[Mechanism, Mapping[str, Any], Problems, Path], Target | None]
_READERS: Mapping[str, _Read] = {
    PathTarget.kind: read_path_target,
    FunctionTarget.kind: read_function_target,
    PosesTarget.kind: read_poses_target,
    DwellTarget.kind: read_dwell_target,
}


def add_target(mechanism: Mechanism, target: TargetOrSection | None) -> Mechanism:
    """The mechanism with a target; a `RequestError` has one line ``target.key: reason`` for each problem."""
    if target is None:
        return mechanism
    if isinstance(target, Target):
        target = target.to_content()
    if isinstance(target, Mapping):
        target = {key: value.tolist() if hasattr(value, "tolist") else value for key, value in target.items()}
    problems: Problems = []
    found = read_target(mechanism, target, problems)
    if problems or found is None:
        raise RequestError("\n".join(f"{'.'.join(map(str, ('target', *key)))}: {reason}" for key, reason in problems))
    return mechanism.with_target(found)


def read_target(mechanism: Mechanism, entries: object, problems: Problems, folder: Path = Path()) -> Target | None:
    """The target that a section describes, of a mechanism with the points of the study; None where it has a problem.

    Keys of problems are those within the section. The name of a file of points is relative to `folder`.
    """
    kinds = " or ".join(f'"{kind}"' for kind in mechanism.targets)
    if not mechanism.targets:
        reason = "a linkage with a range meets no targets; leave out the target or the range"
        problems.append(((), reason if mechanism.limits else f"{mechanism.in_words} meets no targets; leave it out"))
        return None
    if not isinstance(entries, Mapping):
        problems.append(((), f"must be a table with kind = {kinds}, got {format_value(entries)}"))
        return None
    before = len(problems)
    kind = entries.get("kind")
    if kind not in list(mechanism.targets):
        reason = f"{suggestion(str(kind), mechanism.targets)}" if "kind" in entries else f"write kind = {kinds}"
        problems.append((("kind",) if "kind" in entries else (), f"the kind of target is missing or unknown; {reason}"))
        kind = closest_name(str(kind), mechanism.targets)  # its other mistakes are said too
    if kind is None:
        return None
    target = _READERS[kind](mechanism, entries, problems, folder)
    taken = {signal.name for signal in mechanism.signals} | {parameter.name for parameter in mechanism.parameters}
    described = mechanism.targets[kind]
    added = {"parameter": described.parameters, "metric": described.formulas(target) if target else ()}
    for what, name in ((what, each.name) for what, those in added.items() for each in those if each.name in taken):
        reason = f"its {what} {name} would have the name of another column"
        problems.append(((), f"{reason}; rename that column, or the point"))
    return None if len(problems) > before else target
