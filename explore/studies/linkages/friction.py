"""Where a table can have friction."""

from collections.abc import Iterable

from explore.base.errors import KeyPath, Problems
from explore.mechanisms.linkages.bearings import RigidParts, rigid_parts
from explore.mechanisms.linkages.group_steps import groups_of
from explore.mechanisms.linkages.load_table import Element
from explore.mechanisms.linkages.steps import Step
from explore.mechanisms.linkages.table import FRAME, LinkageTable, Slot
from explore.model.quadrature import MOST_SENSES
from explore.studies.linkages.structure import SECTION, Structure

#: Largest number of links that turn on pins with friction: the function of more takes seconds to compile.
_MOST_BEARINGS = 8


def bodies_on(structure: Structure, point: str) -> list[str]:
    """The links that have a point, then the body that its block slides on, or the frame."""
    links = [link.name for link in structure.links if point in link.place_of]
    slots = [slot.body for slot in structure.slots if slot.pin == point]
    return [*links, *slots, *([FRAME] if point in structure.bodies[FRAME].place_of else [])]


def note_many_senses(elements: Iterable[Element], key: KeyPath, problems: Problems) -> None:
    """Note too many motions that are opposed."""
    bearings = sum(len(each.ends) - 1 for each in elements if each.kind == "pin_friction")
    count = bearings + len({each.ends for each in elements if each.kind in ("opposing", "friction")})
    if bearings > _MOST_BEARINGS:
        reason = f"has {bearings} links that turn on pins with friction; at most {_MOST_BEARINGS} are possible"
        problems.append(((*key, "friction"), reason))
    elif count > MOST_SENSES:
        reason = f"has {count} motions with what opposes them or friction; at most {MOST_SENSES} are possible"
        problems.append((key, reason))


def note_resting_pins(table: LinkageTable, steps: Iterable[Step], problems: Problems) -> None:
    """Note slots with friction whose pin rests."""
    rough = table.loads.rough if table.loads else ()
    for group in groups_of(steps):
        for tie in group.ties:
            if isinstance(tie, Slot) and tie.name in rough and group.rests_on_first(tie):
                reason = f"the pin of {tie.name} rests, as {group.first} and {group.second} are of one rigid part"
                problems.append(((SECTION, "loads", "friction", tie.name), reason))


def note_rigid_parts(table: LinkageTable, steps: Iterable[Step], problems: Problems) -> None:
    """Note what opposes, or friction of, a motion that is none, as its bodies are of one rigid part."""
    kinds = {"pin_friction": "friction", "friction": "friction", "opposing": "opposing"}
    elements = [each for each in (table.loads.elements if table.loads else ()) if each.kind in kinds]
    rigid = rigid_parts(table, steps) if elements else RigidParts(table, {})
    slots, parts = {slot.name: slot for slot in table.slots}, rigid.parts
    slides = {slide.link: slide.body for slide in table.slides}
    for element in elements:
        *links, holder = element.ends
        reason = ""
        if element.kind == "pin_friction":
            if all(parts[link] == parts[holder] for link in links):
                reason = f"{links[0]} does not turn against {holder}, as both are of one rigid part; leave it out"
        elif holder in slots:
            if rigid.rests_in(slots[holder]):
                reason = f"the pin {slots[holder].pin} rests in {holder}, as both are of one rigid part; leave it out"
        elif holder in slides and (element.kind == "friction" or holder in table.sliders):
            if parts[holder] == parts[slides[holder]]:
                reason = f"{holder} does not slide, as it is of one rigid part with {slides[holder]}; leave it out"
        elif parts[holder] == parts[FRAME]:
            reason = f"{holder} does not turn, as it is of one rigid part with the frame; leave it out"
        if reason:
            problems.append(((SECTION, "loads", kinds[element.kind], element.name), reason))
