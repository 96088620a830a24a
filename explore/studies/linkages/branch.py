"""How each joint assembles, in the words of [linkage.branch]: a sign for each joint or slot that has two sides."""

import re
from collections.abc import Collection, Iterable, Mapping
from typing import Any

from explore.base.errors import Problems
from explore.base.suggest import format_value, suggestion
from explore.mechanisms.linkages.steps import Circle, JoinPoint, PoseBySlot, Step
from explore.mechanisms.linkages.table import LinkageTable
from explore.studies.linkages.structure import SECTION

#: A step that has two solutions.
TwoSided = JoinPoint | PoseBySlot

_WORDS = ("far", "near", "positive", "negative")
_SIDE = re.compile(r"\s*(left|right)\s+of\s+(\w+)\s+(\w+)\s*")


def two_sided(steps: Iterable[Step]) -> dict[str, TwoSided]:
    """The steps with two solutions, by the name of their joint or slot."""
    found: dict[str, TwoSided] = {}
    for step in steps:
        if isinstance(step, PoseBySlot):
            found[step.slot.name] = step
        elif isinstance(step, JoinPoint) and isinstance(step.first, Circle):
            found[step.point] = step
    return found


def words_of(step: TwoSided) -> tuple[str, str]:
    """The words of the signs +1 and -1."""
    if isinstance(step, PoseBySlot):
        return "positive", "negative"
    if isinstance(step.first, Circle) and isinstance(step.second, Circle):
        ends = f"{step.first.centre} {step.second.centre}"
        return f"left of {ends}", f"right of {ends}"
    return "far", "near"


def read_branch(
    entries: Mapping[str, Any], table: LinkageTable, steps: Mapping[str, TwoSided], problems: Problems
) -> dict[str, int]:
    """The sign of each joint or slot that the section names; see `words_of`. Those of groups are read by others."""
    signs: dict[str, int] = {}
    known = {*table.points, *(slot.name for slot in table.slots), *(link.name for link in table.links)}
    for name, entry in entries.items():
        key = (SECTION, "branch", name)
        if name not in steps:
            if name in known:
                reason = f"{name} has no two sides: it follows from what is known before it; leave it out"
            else:
                reason = f"unknown point or slot {format_value(name)}; {suggestion(name, steps or known)}"
            problems.append((key, reason))
            continue
        sign = _sign(entry, steps[name])
        if sign:
            signs[name] = sign
        else:
            plus, minus = words_of(steps[name])
            problems.append((key, f'must be "{plus}" or "{minus}", got {format_value(entry)}'))
    return signs


def _sign(entry: object, step: TwoSided) -> int:
    """The sign of an entry; 0 if it is none of the words."""
    words = words_of(step)
    if not isinstance(entry, str):
        return 0
    match = _SIDE.fullmatch(entry)
    if match and "of" in words[0]:
        sign = 1 if match[1] == "left" else -1
        ends = words[0].split()[2:]
        return sign if [match[2], match[3]] == ends else -sign if [match[3], match[2]] == ends else 0
    return dict(zip(words, (1, -1), strict=True)).get(entry.strip(), 0)


def note_odd_words(entries: Mapping[str, Any], names: Collection[str], problems: Problems) -> None:
    """Note names and words of the section that no joint has, of a table whose joints are not known."""
    for name, entry in entries.items():
        key = (SECTION, "branch", name)
        if name not in names:
            problems.append((key, f"unknown point or slot {format_value(name)}; {suggestion(name, names)}"))
        elif isinstance(entry, str) and not _SIDE.fullmatch(entry) and entry.strip() not in _WORDS:
            words = ", ".join(f'"{word}"' for word in _WORDS)
            problems.append((key, f'must be {words} or as "left of A C", got {format_value(entry)}'))


def note_missing(missing: Mapping[str, TwoSided], problems: Problems, *, has_branch: bool) -> None:
    """Note joints of which neither a word nor a sketch tells the side."""
    if missing:
        said = ", ".join('{} ("{}" or "{}")'.format(name, *words_of(step)) for name, step in missing.items())
        reason = f"which of two sides is not said: {said}; write it in [linkage.branch], or draw a [linkage.sketch]"
        problems.append(((SECTION, "branch") if has_branch else (SECTION,), reason))
