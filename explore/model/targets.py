"""What a linkage is to do, its target, as plain data."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from itertools import chain
from math import hypot, inf, isfinite
from typing import Any, ClassVar, Literal, Self, get_args

AnglesFrom = Literal["free", "frame"]
PoseOrder = Literal["given", "any"]
#: Largest number of points of a target: an attribute of a results file holds them.
MOST_TARGET_POINTS = 500


class Target(ABC):
    """What a linkage is to do; each kind is a class with its data.

    Attributes
    ----------
    kind
        Its kind in study files.
    doer
        What of the linkage has a target of this kind, in words.
    """

    kind: ClassVar[str]
    doer: ClassVar[str]

    @property
    def path(self) -> PathTarget | None:
        """The places that a point is to pass, for figures; None where the target has none."""
        return None

    @abstractmethod
    def to_content(self) -> dict[str, Any]:
        """The section of a study file, in declared units, without keys that are at their defaults."""

    @classmethod
    def from_content(cls, content: Any) -> Self:
        """The target of `to_content`; ValueError if the content has another form."""
        try:
            return cls._read(content)
        except (KeyError, TypeError, AttributeError) as error:
            raise ValueError(f"a target lacks {error}") from None

    @classmethod
    @abstractmethod
    def _read(cls, content: Any) -> Self: ...

    @classmethod
    @abstractmethod
    def examples(cls, point: str = "knife") -> tuple[Self, ...]:
        """Targets of a point that have all metrics of the kind, for lists of these."""


@dataclass(frozen=True)
class PathTarget(Target):
    """A path that a point of the floating link is to follow.

    Attributes
    ----------
    point
        Name of the point.
    points
        Places that it passes in this order, in either sense of the crank, mm.
    closed
        Whether it returns from the last to the first.
    weights
        Of the squared distances; empty for equal ones.
    crank_angles
        Crank angle at each point, deg; empty where they are free.
    angles_from
        What the crank angles count from: "free", any angle, or "frame", the x axis of the linkage.
    """

    point: str
    points: tuple[tuple[float, float], ...]
    closed: bool = False
    weights: tuple[float, ...] = ()
    crank_angles: tuple[float, ...] = ()
    angles_from: AnglesFrom = "free"
    kind: ClassVar[str] = "path"
    doer: ClassVar[str] = "a point"

    @property
    def path(self) -> PathTarget:
        """The target itself."""
        return self

    def to_content(self) -> dict[str, Any]:
        """The section of a study file, in declared units, without keys that are at their defaults."""
        content: dict[str, Any] = {"point": self.point, "points": [list(place) for place in self.points]}
        content |= {"closed": True} if self.closed else {}
        content |= {key: list(value) for key in ("weights", "crank_angles") if (value := getattr(self, key))}
        content |= {"angles_from": self.angles_from} if self.angles_from != "free" else {}
        return {"kind": self.kind, **content}

    @classmethod
    def _read(cls, content: Any) -> PathTarget:
        places = tuple((float(x), float(y)) for x, y in content["points"])
        weights, angles = (tuple(map(float, content.get(key, ()))) for key in ("weights", "crank_angles"))
        start = content.get("angles_from", "free")
        target = cls(str(content["point"]), places, bool(content.get("closed", False)), weights, angles, start)
        numbers = [*(number for place in places for number in place), *weights, *angles]
        if not all(map(isfinite, numbers)) or not 0 < len(places) <= MOST_TARGET_POINTS:
            raise ValueError("a target has finite points")
        if any(listed and len(listed) != len(places) for listed in (weights, angles)):
            raise ValueError("a target has as many weights and crank angles as points")
        if start not in get_args(AnglesFrom):
            raise ValueError(f"the crank angles of a target cannot count from {start!r}")
        return target

    @classmethod
    def examples(cls, point: str = "knife") -> tuple[PathTarget]:
        """A path of a point."""
        return (cls(point, ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))),)


@dataclass(frozen=True)
class FunctionTarget(Target):
    """A function of the input angle that the output angle is to follow.

    The table has what input and output have turned from their starts, deg, pair by pair; the inputs ascend or descend.
    """

    table: tuple[tuple[float, float], ...]
    kind: ClassVar[str] = "function"
    doer: ClassVar[str] = "the output"

    def to_content(self) -> dict[str, Any]:
        """The section of a study file, in declared units."""
        return {"kind": self.kind, "table": [list(pair) for pair in self.table]}

    @classmethod
    def _read(cls, content: Any) -> FunctionTarget:
        table = tuple((float(x), float(y)) for x, y in content["table"])
        if not all(map(isfinite, chain(*table))) or not 0 < len(table) <= MOST_TARGET_POINTS:
            raise ValueError("a target has finite pairs")
        return cls(table)

    @classmethod
    def examples(cls, _: str = "") -> tuple[FunctionTarget]:
        """The output as the input."""
        return (cls(((0.0, 0.0), (1.0, 1.0), (2.0, 2.0))),)


@dataclass(frozen=True)
class PosesTarget(Target):
    """Poses that the floating link is to carry a body through.

    Attributes
    ----------
    point
        Name of the point of the body whose places are given.
    poses
        Its places, mm, with angles of the body, deg.
    lever
        Length at whose end the error of an angle counts as a distance, mm; 0 for the largest distance of a place from
        the mean of all.
    order
        "given" where the crank passes the poses in their order, in either sense, within a turn; "any" for each pose
        by itself.
    """

    point: str
    poses: tuple[tuple[float, float, float], ...]
    lever: float = 0.0
    order: PoseOrder = "given"
    kind: ClassVar[str] = "poses"
    doer: ClassVar[str] = "the link with a point"

    @property
    def path(self) -> PathTarget:
        """The places of the point."""
        return PathTarget(self.point, tuple((x, y) for x, y, _ in self.poses))

    @property
    def length(self) -> float:
        """The lever, mm."""
        n = len(self.poses)
        middle = sum(x for x, _, _ in self.poses) / n, sum(y for _, y, _ in self.poses) / n
        return self.lever or max(hypot(x - middle[0], y - middle[1]) for x, y, _ in self.poses)

    def to_content(self) -> dict[str, Any]:
        """The section of a study file, in declared units, without keys that are at their defaults."""
        content: dict[str, Any] = {"point": self.point, "poses": [list(pose) for pose in self.poses]}
        content |= {"lever": self.lever} if self.lever else {}
        content |= {"order": self.order} if self.order != "given" else {}
        return {"kind": self.kind, **content}

    @classmethod
    def _read(cls, content: Any) -> PosesTarget:
        poses = tuple((float(x), float(y), float(angle)) for x, y, angle in content["poses"])
        target = cls(str(content["point"]), poses, float(content.get("lever", 0)), content.get("order", "given"))
        if not all(map(isfinite, chain(*poses))) or not 0 < len(poses) <= MOST_TARGET_POINTS:
            raise ValueError("a target has finite poses")
        if not (0.0 <= target.lever < inf and target.length > 0.0):
            raise ValueError("a target has a lever above 0")
        if target.order not in get_args(PoseOrder):
            raise ValueError(f"the poses of a target have no order {target.order!r}")
        return target

    @classmethod
    def examples(cls, point: str = "knife") -> tuple[PosesTarget]:
        """Poses of a body with a point."""
        return (cls(point, ((0.0, 0.0, 0.0), (1.0, 0.0, 10.0))),)


@dataclass(frozen=True)
class DwellTarget(Target):
    """A dwell: the output is to rest while the crank turns, anywhere in its turn.

    Attributes
    ----------
    angle
        What the crank turns in the dwell, deg; 0 for as much as the travel allows.
    travel
        What the output may move in the dwell, mm or deg; 0 for the least that the angle allows.
    """

    angle: float = 0.0
    travel: float = 0.0
    kind: ClassVar[str] = "dwell"
    doer: ClassVar[str] = "the output"

    def to_content(self) -> dict[str, Any]:
        """The section of a study file, in declared units."""
        return {"kind": self.kind, **({"angle": self.angle} if self.angle else {"travel": self.travel})}

    @classmethod
    def _read(cls, content: Any) -> DwellTarget:
        angle, travel = (float(content.get(key, 0.0)) for key in ("angle", "travel"))
        if not (0.0 <= angle < 360.0 and 0.0 <= travel < inf and bool(angle) != bool(travel)):
            raise ValueError("a dwell has an angle between 0 and 360 deg, or a travel above 0")
        return cls(angle, travel)

    @classmethod
    def examples(cls, _: str = "") -> tuple[DwellTarget, DwellTarget]:
        """A sixth of a turn, and a travel of 1."""
        return cls(angle=60.0), cls(travel=1.0)


#: The kinds of targets by their names in study files.
TARGETS: dict[str, type[Target]] = {
    target.kind: target for target in (PathTarget, FunctionTarget, PosesTarget, DwellTarget)
}


def target_from_content(content: Any) -> Target:
    """The target of `Target.to_content`; ValueError if the content has another form."""
    kind = content.get("kind", PathTarget.kind) if isinstance(content, dict) else None
    if not isinstance(kind, str) or kind not in TARGETS:
        raise ValueError(f"there is no target of the kind {kind!r}")
    return TARGETS[kind].from_content(content)
