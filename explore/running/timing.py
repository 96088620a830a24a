"""How long the designs of a study take, before it is swept."""

import time

import numpy as np

from explore.evaluation.evaluate import evaluate_columns
from explore.model.columns import Arrays
from explore.studies.config.study import Study

#: Number of pieces of a study, spread over it, that are timed.
_PIECES = 32
#: Numbers of designs of a piece, in which designs that differ only in speed share a motion as in the sweep.
_PIECE_SIZES = (4, 16, 64)
#: Time above which no larger pieces are timed, s.
_LEAST_SECONDS = 0.1


def seconds_per_design(study: Study) -> float:
    """Time of one worker per design, measured on designs spread over the study."""
    seconds, count = 0.0, 1
    for size in _PIECE_SIZES:
        designs = _spread_designs(study, size)
        # Functions are compiled or loaded when a design first needs them, which takes longer than all these designs.
        evaluate_columns(study.request, designs)
        start = time.perf_counter()
        evaluate_columns(study.request, designs)
        seconds, count = time.perf_counter() - start, len(next(iter(designs.values())))
        if seconds >= _LEAST_SECONDS or count == study.space.n_designs:
            break
    return seconds / count


def _spread_designs(study: Study, size: int) -> Arrays:
    """The designs of pieces of a study, each once: all where the pieces would overlap."""
    space = study.space
    if space.n_designs <= _PIECES * size:
        return space.designs(0, space.n_designs)
    firsts = np.linspace(0, space.n_designs - size, _PIECES).astype(np.int64).tolist()
    pieces = [space.designs(first, first + size) for first in firsts]
    return {name: np.concatenate([piece[name] for piece in pieces]) for name in pieces[0]}
