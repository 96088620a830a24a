"""How the signals of a mechanism are integrated: by what is known of their singularities, or by what samples tell."""

from dataclasses import dataclass

#: Largest number of singularities that a mechanism declares.
MOST_SINGULARITIES = 3
#: Largest number of breaks, for which the buffers of panels are large enough.
MOST_BREAKS = 6
#: Largest number of senses, two bits of a law each.
MOST_SENSES = 16


@dataclass(frozen=True)
class Adaptive:
    """Halve panels until the samples resolve every signal: for any signals, see `quadrature.adaptive`.

    Full turns without breaks, of signals without corners, are `Resolved` first.

    Panels are graded towards the singularities of `Graded` where there are some, as for signals that have corners
    besides.
    """

    singularities: tuple[tuple[int, int], ...] = ()


@dataclass(frozen=True)
class Graded:
    """Choose the nodes by the distances of singularities, before sampling: about ten times as fast.

    The samples are checked afterwards, and designs that contradict the singularities are sampled adaptively.

    Attributes
    ----------
    singularities
        Row and anchor, 0 or 1 for its opposite, of each constant that holds the half-tangent of the distance of a
        complex singularity; see `explore.evaluation.quadrature.panels`.
    """

    singularities: tuple[tuple[int, int], ...]


@dataclass(frozen=True)
class Located:
    """Choose the nodes by the distance of the nearest complex singularity, wherever it stands.

    Full turns have equal steps. Designs whose singularity is too near, and those that contradict it, are `Anchored`,
    and sampled adaptively where that does not do.

    Attributes
    ----------
    row
        Row of the constant that holds the half-tangent of the distance, tanh(distance/2); 0 where it is not known. Of
        designs that are moved over an interval it holds minus that of log(rho): no singularity is in the ellipse with
        the ends of the interval as foci and semi-axes of the sum rho, in half lengths.
    middle_row, reach_row
        Rows of the middle of the interval and of half its length, rad; both are 1 where it is the turn.
    place_row, others_row
        Rows of the angle above which it stands, rad, NaN where that is not known, and of the half-tangent of the
        distance of all others. Designs that it is too near to are `Anchored` there.
    knows_places
        Whether the angle is known of all designs that have strokes: these are `Anchored` first.
    """

    row: int
    middle_row: int
    reach_row: int
    place_row: int
    others_row: int
    knows_places: bool = False

    @property
    def singularities(self) -> tuple[tuple[int, int], ...]:
        """The rows, with -1 for no anchor."""
        return ((self.row, -1), (self.middle_row, -1), (self.reach_row, -1))

    @property
    def anchored(self) -> "Anchored":
        """Panels graded towards the singularity."""
        return Anchored(self.row, self.place_row, self.others_row)


@dataclass(frozen=True)
class Anchored:
    """Grade panels towards the nearest complex singularity at its place; the rows are those of `Located`."""

    row: int
    place_row: int
    others_row: int

    @property
    def singularities(self) -> tuple[tuple[int, int], ...]:
        """The rows: the anchor of the first one is its place."""
        return ((self.row, 0), (self.place_row, -1), (self.others_row, -1))


@dataclass(frozen=True)
class Resolved:
    """Choose the nodes of full turns by what samples tell: as many equal steps as resolve every signal.

    Full turns of mechanisms whose quadrature is `Adaptive` have it. Designs that need too many steps are sampled
    adaptively.
    """

    singularities: tuple[tuple[int, int], ...] = ()


Quadrature = Adaptive | Anchored | Graded | Located | Resolved
