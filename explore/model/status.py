"""Status codes of designs: those that all mechanisms share, and the declaration of those that a mechanism adds."""

from dataclasses import dataclass
from enum import IntEnum


class Status(IntEnum):
    """Outcome of the evaluation of one design of any mechanism."""

    PENDING = 0
    OK = 1
    SCREENED = 6
    TOLERANCE_NOT_MET = 7
    NOT_FINITE = 8
    FAILED = 9
    NOT_GIVEN = 10
    UNREACHABLE = 11

    @property
    def label(self) -> str:
        """The word used in tables and files."""
        return self.name.lower()

    @property
    def sentence(self) -> str:
        """The meaning of the status, in a sentence."""
        return _STATUS_SENTENCES[self]


#: Codes that a mechanism can declare; files of four-bars have the first four.
OWN_CODES = (*range(2, 6), *range(20, 128))


@dataclass(frozen=True)
class OwnStatus:
    """A status that a mechanism declares: a reason why designs of it have no motion, no turn, or no strokes.

    The label is the word in tables and files, the sentence the meaning. With `lacks_strokes` the motion exists but has
    no strokes, so that a request that needs none is computed. With `lacks_turn` it may
    exist over an interval. With `is_undecided` the design may have what it says is missing.
    """

    label: str
    sentence: str
    lacks_strokes: bool = False
    lacks_turn: bool = False
    is_undecided: bool = False


_STATUS_SENTENCES = {
    Status.PENDING: "not computed yet",
    Status.OK: "computed",
    Status.SCREENED: "a constraint that is known without samples fails; nothing was sampled",
    Status.TOLERANCE_NOT_MET: "the error bound misses the tolerance; the values are kept",
    Status.NOT_FINITE: "a parameter or a metric is not a usable finite number",
    Status.FAILED: "the block of this design failed to compute",
    Status.NOT_GIVEN: "a metric needs a parameter that this design leaves at 0: a load, a rating or an allowed stress",
    Status.UNREACHABLE: "nothing within its bounds gives the value to solve for",
}
