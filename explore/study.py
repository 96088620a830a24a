"""A study: a validated config, all names resolved."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

from explore.design_space import DesignSpace
from explore.vocabulary import Objective, Request


@dataclass(frozen=True)
class Study:
    """What a sweep runs.

    Attributes
    ----------
    request
        What is to be known of each design.
    space
        The designs.
    objectives
        Of the ranking.
    text
        The config as written, kept in the results file.
    determines
        Normalised JSON of everything that determines the columns; two studies with the same text here give the same
        results.
    """

    request: Request
    space: DesignSpace
    objectives: tuple[Objective, ...]
    text: str
    determines: str

    @property
    def sha256(self) -> str:
        """Hash of what determines the columns."""
        return hashlib.sha256(self.determines.encode()).hexdigest()
