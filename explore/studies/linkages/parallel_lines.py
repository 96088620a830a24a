"""Lines of a table that are to meet and are parallel in all designs: their joint has no place, or every place."""

from collections.abc import Iterable, Iterator, Mapping

from explore.base.errors import KeyPath, Problems
from explore.mechanisms.linkages.steps import Circle, DriveOnLines, JoinPoint, Locus, SlideInSlot, SlideLine, Step
from explore.mechanisms.linkages.table import LinkageTable, Slide, Slot, carrier
from explore.studies.linkages.coordinates import value_of
from explore.studies.linkages.structure import SECTION

#: Sine of the angle below which two lines are parallel.
_PARALLEL = 1e-9
#: Numbers of sets of values at which lines are compared.
_TRIALS = 3


def note_parallel_lines(table: LinkageTable, steps: Iterable[Step], problems: Problems) -> None:
    """Note each pair of lines that is to place a joint and is parallel whatever the parameters and the crank angle."""
    trials = [
        {p.name: 10.0 + 7.0 * ((0.618034 * (k + 1) + 0.414214 * trial) % 1.0) for k, p in enumerate(table.parameters)}
        for trial in range(_TRIALS)
    ]
    for first, second in _pairs(steps):
        if carrier(first.body, table.slides) != carrier(second.body, table.slides):
            continue
        pairs = [(_direction(table, first, values), _direction(table, second, values)) for values in trials]
        if all(abs((a.conjugate() * b).imag) <= _PARALLEL * abs(a) * abs(b) for a, b in pairs):  # not if undefined
            slot = second if isinstance(second, Slot) else first
            other = second if slot is first else first
            reason = f"is parallel to {_words(other)} in all designs, so the two place no joint; turn one of them"
            problems.append((_key(slot), reason))


def _pairs(steps: Iterable[Step]) -> Iterator[tuple[Slot | Slide, Slot | Slide]]:
    """The lines that are to meet."""
    for step in steps:
        loci: tuple[Locus | Slide, ...] = ()
        if isinstance(step, SlideInSlot):
            loci = step.slide, step.slot
        elif isinstance(step, DriveOnLines):
            loci = step.first[1], step.second[1]
        elif isinstance(step, JoinPoint):
            loci = step.first, step.second
        lines = [each.slide if isinstance(each, SlideLine) else each for each in loci if not isinstance(each, Circle)]
        if len(lines) == 2:
            yield lines[0], lines[1]


def _direction(table: LinkageTable, line: Slot | Slide, values: Mapping[str, float]) -> complex:
    """The direction of a line in coordinates of what it turns with."""
    if isinstance(line, Slide):
        return complex(*(value_of(coordinate, values) for coordinate in line.direction))
    places = table.body_of[line.body].place_of
    start, end = (
        complex(*(value_of(coordinate, values) for coordinate in (places[end] if isinstance(end, str) else end)))
        for end in line.along
    )
    return end - start


def _words(line: Slot | Slide) -> str:
    return f"the slide of {line.link}" if isinstance(line, Slide) else f"the slot {line.name}"


def _key(line: Slot | Slide) -> KeyPath:
    return (SECTION, "slides", line.link) if isinstance(line, Slide) else (SECTION, "slots", line.name)
