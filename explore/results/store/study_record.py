"""The study of a results file: its attributes that are JSON texts, checked and parsed once."""

import json
import math
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import NoneType
from typing import Any, Self

from explore.model.columns import Attribute
from explore.model.quantities import Sense
from explore.model.targets import Target, target_from_content

#: Keys of the ends of an interval, deg.
_ENDS = ("from", "to")
#: Keys of the ends of an interval in older files, rad.
_OLD_ENDS = ("start", "stop")


@dataclass(frozen=True)
class StudyRecord:
    """Properties of a study that its results file stores as JSON; each is empty if the file lacks it.

    They are those of `explore.results.store.recorded_study.RecordedStudy`. The `studied_counts` are numbers of designs
    by the label of their status, in a file that keeps the front only; `constraints` bounds "min" and "max" of each
    constrained metric in its unit, None where a side is open. Files of a mechanism without drives say "none".
    """

    objectives: tuple[str, ...] = ()
    senses: Mapping[str, Sense | None] = field(default_factory=dict)
    speed_powers: Mapping[str, float | None] = field(default_factory=dict)
    status_sentences: Mapping[str, str] = field(default_factory=dict)
    label_sentences: Mapping[str, str] = field(default_factory=dict)
    studied_counts: Mapping[str, int] = field(default_factory=dict)
    tally: Mapping[str, Any] = field(default_factory=dict)
    constraints: Mapping[str, Mapping[str, float | None]] = field(default_factory=dict)
    window: str | Mapping[str, float] = ""
    drive: str = ""
    points: tuple[str, ...] = ()
    target: Target | None = None

    @classmethod
    def from_attributes(cls, attributes: Mapping[str, Attribute]) -> Self:
        """Parse the attributes of a results file; ValueError when one does not have the form described above."""
        contents = {}
        for name, has_form in _FORMS.items():
            if name in attributes:
                contents[name] = parse_json(f"attribute {name}", attributes[name])
                if not has_form(contents[name]):
                    raise ValueError(f"attribute {name} has the wrong form")
        determines = contents.pop("determines", {})
        evaluate = determines.get("evaluate", {})
        constraints = {
            metric: {side: None if bound is None else float(bound) for side, bound in sides.items()}
            for metric, sides in determines.get("constraints", {}).items()
        }
        drive = evaluate.get("drive", "")
        window = evaluate.get("window", "")
        if not isinstance(window, str):
            old = dict(zip(_ENDS, _OLD_ENDS, strict=True))
            window = window if "from" in window else {key: _degrees(window[old[key]]) for key in _ENDS}
        objectives = tuple(contents.pop("objectives", ()))
        return cls(
            objectives=objectives, constraints=constraints, window=window, drive="" if drive == "none" else drive,
            points=tuple(determines.get("points", ())),
            target=target_from_content(determines["target"]) if "target" in determines else None, **contents,
        )  # fmt: skip


def parse_json(name: str, text: Attribute) -> Any:
    """The content of a JSON text; ValueError with the text's name if it is not JSON or cannot be encoded as UTF-8."""
    try:
        content = json.loads(str(text))
        json.dumps(content, ensure_ascii=False).encode()
    except RecursionError:
        raise ValueError(f"{name} is nested too deeply") from None
    except ValueError as error:
        raise ValueError(f"{name} is not JSON: {error}") from None
    return content


def contains_only(content: Any, container: type, *items: type) -> bool:
    """Whether the content is a list or object with items of these types; a boolean is not an int here."""
    values = content.values() if isinstance(content, dict) else content
    return isinstance(content, container) and all(type(value) in items for value in values)


def _is_bound(value: Any) -> bool:
    """Whether the value is None or a finite number; Python's JSON also reads NaN and integers of any length."""
    return value is None or (type(value) in (int, float) and abs(value) <= sys.float_info.max)


def _is_window(content: Any) -> bool:
    """Whether the content is a name, or the first and the last input angle of an interval."""
    if not isinstance(content, dict):
        return isinstance(content, str)
    ends = _ENDS if "from" in content else _OLD_ENDS
    is_interval = content.keys() == set(ends) and contains_only(content, dict, int, float)
    return is_interval and all(map(_is_bound, content.values())) and content[ends[0]] <= content[ends[1]]


def _degrees(radians: float) -> float:
    """The angle in degrees, with few digits if it was written with few."""
    degrees = math.degrees(radians)
    short = float(f"{degrees:.12g}")
    return short if math.radians(short) == radians else degrees


def _is_study(content: Any) -> bool:
    """Whether constraints, window, drive and points have the right form, if the content has them."""
    if not isinstance(content, dict):
        return False
    constraints, evaluate = content.get("constraints", {}), content.get("evaluate", {})
    return (
        contains_only(constraints, dict, dict)
        and all(
            sides.keys() == {"min", "max"} and all(map(_is_bound, sides.values())) for sides in constraints.values()
        )
        and isinstance(evaluate, dict)
        and isinstance(evaluate.get("drive", ""), str)
        and _is_window(evaluate.get("window", ""))
        and contains_only(content.get("points", []), list, str)
    )


_FORMS: dict[str, Callable[[Any], bool]] = {
    "determines": _is_study,
    "objectives": lambda content: contains_only(content, list, str),
    "senses": lambda content: isinstance(content, dict) and all(v in ("min", "max", None) for v in content.values()),
    "speed_powers": lambda content: contains_only(content, dict, int, float, NoneType),
    "status_sentences": lambda content: contains_only(content, dict, str),
    "label_sentences": lambda content: contains_only(content, dict, str),
    "studied_counts": lambda content: contains_only(content, dict, int),
    "tally": lambda content: contains_only(content, dict, int, list, dict),
}
