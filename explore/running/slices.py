"""The designs of a block on several threads, where they take long and there are more threads than blocks."""

import time

import numpy as np

from explore.evaluation.evaluate import Evaluation, evaluate_columns, join_evaluations
from explore.model.columns import Arrays
from explore.model.request import Request
from explore.running.threads import Threads

#: Number of the first designs, whose time tells that of the others; eight times as many follow where that is short.
_FIRST = 256
#: Time of the others, s, from which threads share them.
_LONG = 0.05
#: Number of slices for each thread: some designs take longer than others.
_SLICES_EACH = 8
#: Number of designs that slices are multiples of: whole tiles of lanes.
_TILE = 64


def evaluate_on_threads(request: Request, parameters: Arrays, threads: int) -> Evaluation:
    """Do what `evaluate_columns` does on up to so many threads; no number depends on how many they are."""
    count = len(next(iter(parameters.values())))
    if threads <= 1 or _shares_motions(request, parameters):
        return evaluate_columns(request, parameters)

    def evaluate(first: int, last: int) -> Evaluation:
        return evaluate_columns(request, {name: column[first:last] for name, column in parameters.items()})

    parts, done, size, seconds = list[Evaluation](), 0, _FIRST, 0.0
    while done < count and seconds <= _LONG:
        began, last = time.perf_counter(), min(done + size, count)
        parts.append(evaluate(done, last))
        seconds = (time.perf_counter() - began) * (count - last) / (last - done)
        done, size = last, 8 * size
    size = -(-(count - done) // (threads * _SLICES_EACH * _TILE)) * _TILE
    if done < count:
        with Threads(threads) as pool:
            results = [pool.submit(evaluate, first, min(first + size, count)) for first in range(done, count, size)]
            parts += [result.result() for result in results]
    return join_evaluations(parts)


def _shares_motions(request: Request, parameters: Arrays) -> bool:
    """Whether designs may have the same motion at several speeds, which is evaluated once for all of a block."""
    speed = request.mechanism.speed
    if speed is None or speed.name not in parameters or speed in request.kernel.kernel_parameters:
        return False
    return 1 < len(np.unique(parameters[speed.name])) <= len(parameters[speed.name]) // 2
