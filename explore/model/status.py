"""Status codes of designs."""

from enum import IntEnum


class Status(IntEnum):
    """Outcome of the evaluation of one design. Mechanisms may add codes of their own from 20."""

    PENDING = 0
    OK = 1
    CANNOT_ASSEMBLE = 2
    CRANK_BLOCKED = 3
    CHANGE_POINT = 4
    NO_STROKE = 5
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

    @staticmethod
    def label_of(code: int) -> str:
        """The word for any code, including those of mechanisms."""
        return Status(code).label if code in Status._value2member_map_ else f"status {code}"


_STATUS_SENTENCES = {
    Status.PENDING: "not computed yet",
    Status.OK: "computed",
    Status.CANNOT_ASSEMBLE: "the links cannot be assembled: the longest is at least as long as the others together",
    Status.CRANK_BLOCKED: "the crank cannot turn fully: the linkage locks before a full turn",
    Status.CHANGE_POINT: "all links fall into one line, from where the motion may continue on either branch",
    Status.NO_STROKE: "the output turns fully, so there are no strokes: only the window 'cycle' is defined",
    Status.SCREENED: "a constraint known from the geometry alone fails; nothing was sampled",
    Status.TOLERANCE_NOT_MET: "the error bound misses the tolerance; the values are kept",
    Status.NOT_FINITE: "a parameter or a metric is not a usable finite number",
    Status.FAILED: "the block of this design failed to compute",
    Status.NOT_GIVEN: "a metric needs a parameter that this design leaves at 0: a load, a rating or an allowed stress",
    Status.UNREACHABLE: "no length within its bounds gives the value to solve for",
}
