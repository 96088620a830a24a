"""Statuses of designs of a linkage: two for each joint, and those of a turn and of strokes that are not there."""

from collections.abc import Collection, Sequence

from explore.model.status import OwnStatus

#: Code of a design that assembles at no crank angle.
CANNOT_ASSEMBLE = 2
#: Code of a design that is in another assembly after a turn.
RETURNS_NOT = 3
#: Code of a design with links that have no assembly at the crank angle of the sketch.
NO_ASSEMBLY = 4
#: Code of a design whose output does not turn back exactly twice.
NO_STROKES = 5
#: Code of a design of which it is not decided whether its crank turns.
TURN_NOT_DECIDED = 20
#: Code of a design of which it is not decided where its output turns back.
STROKES_NOT_DECIDED = 21
#: Code of a crank that the first joint blocks.
_FIRST_JOINT = 22


def blocked_at(joint: int) -> int:
    """Code of a crank that a joint blocks; the next one is that of assemblies of it that are too close to tell."""
    return _FIRST_JOINT + 2 * joint


def declare_statuses(
    joints: Sequence[str], of_lines: Collection[str], *, turns: bool, is_pin: bool, has_groups: bool
) -> dict[int, OwnStatus]:
    """The statuses by code; those in `of_lines` are joints of two lines.

    `turns` tells the turn from a range, and `is_pin` a driven pin from a crank.
    """
    driver, turn = ("driven pin", "moves over its travel") if is_pin else ("crank", "turns fully")
    motion = turn if turns else "moves over its range"
    statuses = {
        CANNOT_ASSEMBLE: OwnStatus("cannot_assemble", "some joint is out of reach at every crank angle"),
        NO_STROKES: OwnStatus(
            "no_strokes",
            "the output does not turn back exactly twice in a turn: only the window 'cycle' and intervals are defined",
            lacks_strokes=True,
        ),
        TURN_NOT_DECIDED: OwnStatus(
            "turn_not_decided",
            f"whether the {driver} {motion} was not decided: joints are close to their limits too often",
            lacks_turn=True,
            is_undecided=True,
        ),
        STROKES_NOT_DECIDED: OwnStatus(
            "strokes_not_decided",
            "how often the output turns back was not decided: it comes to rest, or nearly so, at a crank angle",
            lacks_strokes=True,
            is_undecided=True,
        ),
    }
    if has_groups:
        words = "after a turn of the crank the links are assembled in another way"
        statuses[RETURNS_NOT] = OwnStatus("does_not_return", words, lacks_turn=True)
        words = "links have no assembly at the crank angle of the sketch"
        statuses[NO_ASSEMBLY] = OwnStatus("no_assembly_at_sketch", words)
    for k, joint in enumerate(joints):
        statuses[blocked_at(k)] = OwnStatus(
            f"crank_blocked_at_{joint}",
            f"the {driver} cannot {motion.replace('s ', ' ', 1)}: {joint} is out of reach at some crank angles",
            lacks_turn=True,
        )
        label, sentence = (
            (
                f"parallel_lines_at_{joint}",
                f"the two lines that place {joint} become parallel, or nearly so, at a crank angle: it has no place",
            )
            if joint in of_lines
            else (
                f"change_point_at_{joint}",
                f"two assemblies of {joint} meet at a crank angle, or are nearer to each other than rounding tells",
            )
        )
        statuses[blocked_at(k) + 1] = OwnStatus(label, sentence, lacks_turn=True, is_undecided=True)
    return statuses
