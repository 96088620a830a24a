"""The designs of a block on several threads, where they take long and there are more threads than blocks."""

import math
import time
from collections.abc import Callable
from concurrent.futures import Future

import numpy as np

from explore.evaluation.evaluate import Evaluation, evaluate_columns
from explore.model.columns import Arrays
from explore.model.request import Request
from explore.running.threads import Threads

#: Number of designs whose time tells that of the others.
_FIRST = 256
#: Time of the others, s, from which threads share them.
_LONG = 0.05
#: Number of slices for each thread: some designs take longer than others.
_SLICES_EACH = 8


def evaluate_on_threads(request: Request, parameters: Arrays, threads: int) -> Evaluation:
    """Do what `evaluate_columns` does on up to so many threads; no bit depends on their number."""
    count = len(next(iter(parameters.values())))
    if threads <= 1 or count <= _FIRST:
        return evaluate_columns(request, parameters)

    def evaluate(first: int, last: int) -> Evaluation:
        return evaluate_columns(request, {name: column[first:last] for name, column in parameters.items()})

    began = time.perf_counter()
    parts = [evaluate(0, _FIRST)]
    seconds = (time.perf_counter() - began) * (count / _FIRST - 1.0)
    size = math.ceil((count - _FIRST) / (threads * _SLICES_EACH)) if seconds > _LONG else count
    bounds = [(first, min(first + size, count)) for first in range(_FIRST, count, size)]
    parts += [evaluate(*bounds[0])] if len(bounds) == 1 else _share(evaluate, bounds, threads)
    columns = {name: np.concatenate([part.columns[name] for part in parts]) for name in parts[0].columns}
    return Evaluation(columns, sum(part.kinematic_evaluations for part in parts))


def _share(evaluate: Callable[[int, int], Evaluation], bounds: list[tuple[int, int]], threads: int) -> list[Evaluation]:
    """Evaluate slices on threads; raise the error of the first one that fails."""
    results: list[Future[Evaluation]] = [Future() for _ in bounds]

    def work(number: int) -> None:
        try:
            results[number].set_result(evaluate(*bounds[number]))
        except BaseException as problem:
            results[number].set_exception(problem)

    with Threads(threads) as pool:
        for number in range(len(bounds)):
            pool.submit(work, number)
        return [result.result() for result in results]
