"""Expressions of Pyslvs, ``M[J[R, P[0.0, 0.0], L[ground, L1]], ...]``, which PMKS of the desktop uses as well.

A joint R joins all its links. RP is a pin of the other links in a slot of the first one; P lets the other links
translate along the first one. Angles of slots are those in the drawn position.
"""

import cmath
import math
import re

from explore.base.errors import RequestError
from explore.mechanisms.linkages.table import FRAME
from explore.studies.imports.drawn import Drawn, DrawnSlot

_COMMENT = re.compile(r"#\[.*?#\][^\n]*|#[^\n]*", re.DOTALL)
_JOINT = re.compile(
    r"\s*J\[\s*(RP|R|P)\s*(?:,\s*A\[([^\]]*)\]\s*)?(?:,\s*color\[[^\]]*\]\s*)?"
    r",\s*P\[([^\],]*),([^\]]*)\]\s*,\s*L\[([^\]]*)\]\s*\]\s*"
)
_GROUND = "ground"
#: Largest number of joints.
_MOST_JOINTS = 200


def read_pyslvs(text: str) -> Drawn:
    """The linkage of an expression; a `RequestError` says in one line where it is none."""
    text = _COMMENT.sub("", text).strip()
    if not (text.startswith("M[") and text.endswith("]")):
        raise RequestError("is no expression of Pyslvs: that is M[ ... ]")
    drawn, rest, number = Drawn(), text[2:-1], 0
    while rest.strip():
        match = _JOINT.match(rest)
        if match is None:
            raise RequestError(
                f"joint {number} of the expression is not J[type, P[x, y], L[links]]: {rest[:40].strip()}"
            )
        _add_joint(drawn, f"P{number}", match)
        number, rest = number + 1, rest[match.end() :].removeprefix(",")
        if number > _MOST_JOINTS:
            raise RequestError(f"has more than {_MOST_JOINTS} joints")
    drawn.driver = next(
        (link for link, points in drawn.links.items() if link != FRAME and set(points) & set(drawn.links[FRAME])), ""
    )
    if not drawn.driver:
        raise RequestError("no link has a pin in the frame, so none can be the driver")
    drawn.remarks.append(
        f"the expression names no driver, so {drawn.driver} is: the first link with a pin in the frame"
    )
    return drawn


def _add_joint(drawn: Drawn, name: str, match: re.Match[str]) -> None:
    kind, angle, x, y, names = match.groups()
    links = [FRAME if link.strip() == _GROUND else link.strip() for link in names.split(",") if link.strip()]
    place = complex(_number(x, name), _number(y, name))
    if kind == "R":
        _add_point(drawn, name, place, links)
        return
    if angle is None or len(links) < 2:
        raise RequestError(f"the slider {name} has no angle A[...], or fewer than two links")
    base, *others = links
    direction = cmath.rect(1.0, math.radians(_number(angle, name)))
    if math.remainder(_number(angle, name), 90.0) == 0.0:
        direction = complex(round(direction.real), round(direction.imag))
    if kind == "RP":
        _add_point(drawn, name, place, others)
        drawn.slots[f"slot_{name}"] = DrawnSlot(name, base, direction)
        return
    for other in others:
        link, body = (base, FRAME) if other == FRAME else (other, base)
        drawn.links.setdefault(link, [])
        drawn.slides[link] = (body, direction)


def _add_point(drawn: Drawn, name: str, place: complex, links: list[str]) -> None:
    drawn.points[name] = place
    for link in links:
        drawn.links.setdefault(link, []).append(name)


def _number(text: str, name: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise RequestError(f"a number of {name} is not one: {text[:40].strip()}")
    return number
