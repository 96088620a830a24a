"""Designs chosen from results, and what their study asks of a design."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from explore.base.counts import design_numbers
from explore.base.errors import RequestError
from explore.model.request import Request
from explore.results.ranking.rankings import rank_source
from explore.results.ranking.reasons import nothing_ranked
from explore.results.store.results import Results
from explore.studies.config.linkage import mechanism_of
from explore.studies.request.requests import make_request

if TYPE_CHECKING:
    import pandas as pd


def chosen_designs(results: Results, numbers: Sequence[int] | int | None = None) -> pd.DataFrame:
    """All columns of designs by number, in the given order, or of the Pareto set in the objectives of the study."""
    if numbers is not None:
        return results.designs(check_numbers(numbers))
    if not results.objectives:
        raise RequestError(f"{results.path} has no objective, so no design is the best: choose one with `design`")
    ranking = rank_source(results)
    if ranking.frame.empty:
        raise RequestError(f"{nothing_ranked(ranking, results.path)}, so none is the best: choose one with `design`")
    return results.designs(ranking.frame.index.to_numpy())


def check_numbers(numbers: Sequence[int] | int) -> npt.NDArray[np.int64]:
    """Numbers of designs, each named once."""
    given = np.atleast_1d(design_numbers(numbers))
    unique, counts = np.unique(given, return_counts=True)
    for number in unique[counts > 1]:
        raise RequestError(f"design {number} is named twice; name each design once")
    return given


def request_of(results: Results) -> Request:
    """What the study of results computes of each design: its metrics, constraints and tolerance."""
    study = results.sections
    evaluate = study.get("evaluate", {})
    return make_request(
        mechanism_of(results),
        metrics=evaluate.get("metrics"),
        window=evaluate.get("window"),
        drive=evaluate.get("drive"),
        constraints=study.get("constraints"),
        tolerance=evaluate.get("tolerance", 1e-9),
        formulas=study.get("metrics"),
    )
