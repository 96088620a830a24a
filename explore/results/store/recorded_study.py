"""What a results file says of its study, as properties of results."""

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from explore.base.errors import ResultsError
from explore.model.columns import Attribute
from explore.model.quantities import Sense
from explore.model.targets import Target
from explore.results.store.layout import Layout


class RecordedStudy:
    """The study of a results file, from its attributes; each property is empty if the file lacks it."""

    path: Path
    _layout: Layout

    @property
    def attributes(self) -> Mapping[str, Attribute]:
        """The attributes of the file: the study's text, seed, versions, hashes and so on."""
        return dict(self._layout.attributes)

    @property
    def config(self) -> str:
        """The study as written, TOML."""
        return str(self._layout.attributes.get("config", ""))

    @property
    def sections(self) -> dict[str, Any]:
        """The study by its sections; `ResultsError` if its text cannot be read."""
        try:
            return tomllib.loads(self.config)
        except tomllib.TOMLDecodeError as error:
            raise ResultsError(f"{self.path} is damaged: its study cannot be read: {error}") from None

    @property
    def given(self) -> frozenset[str]:
        """Names of objectives and of constrained metrics that the solver of a task measured, and no study computes."""
        if self._layout.attributes.get("sampler") != "synthesis":
            return frozenset()
        sections, asked = self.sections, [*self.objectives, *self._layout.study.constraints]
        computed = [*sections.get("rank", {}).get("metrics", []), *sections.get("constraints", {})]
        return frozenset(map(_metric, asked)) - set(map(_metric, computed))

    @property
    def own_objectives(self) -> tuple[str, ...]:
        """The objectives that the study computes; of tolerances those whose robust values are the file's."""
        if self._layout.attributes.get("sampler") == "tolerances":
            robust = (text.rpartition(":") for text in self.objectives if _metric(text) != "yield")
            return tuple(f"{name.removesuffix('_robust')}:{sense}" for name, _, sense in robust)
        return tuple(text for text in self.objectives if _metric(text) not in self.given)

    @property
    def named_objectives(self) -> tuple[str, ...]:
        """The objectives that a study can name: its own that are no margins."""
        margins = {column.name for column in self._layout.columns if column.role == "margin"}
        return tuple(text for text in self.own_objectives if _metric(text) not in margins)

    @property
    def mechanism(self) -> str:
        """Name of the mechanism; empty if the file has none."""
        return str(self._layout.attributes.get("mechanism", ""))

    @property
    def speed(self) -> str:
        """Name of the parameter that is the input speed; empty if the file has none."""
        return str(self._layout.attributes.get("speed", ""))

    @property
    def objectives(self) -> tuple[str, ...]:
        """The study's objectives, such as ``"cv:min"``."""
        return self._layout.study.objectives

    @property
    def senses(self) -> dict[str, Sense | None]:
        """The better side of each metric, "min" or "max"; None where it has none."""
        return dict(self._layout.study.senses)

    @property
    def window(self) -> str | Mapping[str, float]:
        """Part of the turn that the statistics run over: a name, or "from" and "to" in degrees; "" if not known."""
        return self._layout.study.window

    @property
    def drive(self) -> str:
        """Stroke that the window "drive" means; empty if the file has none."""
        return self._layout.study.drive

    @property
    def points(self) -> tuple[str, ...]:
        """Names of the points of the floating link, whose coordinates are parameters such as ``knife_along``."""
        return self._layout.study.points

    @property
    def target(self) -> Target | None:
        """What the linkages are to do; None where the study has no target."""
        return self._layout.study.target

    @property
    def speed_powers(self) -> dict[str, float | None]:
        """Power of the input speed that each metric is proportional to; None where there is none."""
        return dict(self._layout.study.speed_powers)

    @property
    def status_sentences(self) -> dict[str, str]:
        """What each status means, by its label."""
        return dict(self._layout.study.status_sentences)

    @property
    def label_sentences(self) -> dict[str, str]:
        """What labels of columns other than the status mean; empty if the file does not say."""
        return dict(self._layout.study.label_sentences)

    @property
    def tally(self) -> dict[str, Any]:
        """Counts of all studied designs by why they are not in the front, if only the front is kept; else empty."""
        return dict(self._layout.study.tally)

    @property
    def keep(self) -> str:
        """Which designs of the study are in the file: "all", or "front" for the Pareto-optimal ones."""
        return str(self._layout.attributes.get("keep", "all"))

    @property
    def n_designs(self) -> int:
        """Number of designs of the file, including those not committed yet."""
        return self._layout.n_designs

    @property
    def is_packed(self) -> bool:
        """Whether the file is a compressed copy."""
        return self._layout.is_packed

    @property
    def n_blocks(self) -> int:
        """Number of blocks of the file."""
        return self._layout.n_blocks

    def row_range(self, block: int) -> tuple[int, int]:
        """First row of a block in the file and the first row after it; rows are designs when all are kept."""
        return self._layout.row_range(block)


def _metric(objective: str) -> str:
    """The metric of an objective such as ``"cv:min"``."""
    return objective.partition(":")[0].strip()
