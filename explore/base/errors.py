"""Errors and warnings that reach a user: each is also the built-in that it resembles most."""

#: The place of an entry in a study: names of keys and positions in lists.
KeyPath = tuple[str | int, ...]
#: Problems of a study, each the place of an entry and the reason.
Problems = list[tuple[KeyPath, str]]


class ExploreError(Exception):
    """Base of every error that `explore` raises on purpose; each line of its text is one problem."""


class ConfigError(ExploreError, ValueError):
    """A study file is wrong.

    Parameters
    ----------
    problems
        One sentence for each problem found, ``file:line: key: reason; suggestion``.
    """

    def __init__(self, problems: list[str]) -> None:
        super().__init__("\n".join(problems))
        self.problems = problems

    def __reduce__(self) -> tuple[type["ConfigError"], tuple[list[str]]]:
        return type(self), (self.problems,)


class RequestError(ExploreError, ValueError):
    """A requested metric, window, statistic, parameter or option does not exist or has no meaning."""


class MotionError(ExploreError, ArithmeticError):
    """The mechanism cannot make the full turn that is to be simulated."""


class ResultsError(ExploreError, OSError):
    """A results file is missing, not written by explore, damaged, locked or of another study."""


class ClusterError(ExploreError, RuntimeError):
    """The workers of a sweep cannot be reached, were lost, or do not compute with the same versions as this process."""


class DoubtfulInputWarning(UserWarning):
    """A study or a task is valid, but may not say what its author means."""


class FailedBlocksWarning(RuntimeWarning):
    """Blocks of a sweep failed and were left out of its results.

    Parameters
    ----------
    failures
        The reason of each failed block by the number of the block.
    """

    def __init__(self, failures: dict[int, str]) -> None:
        super().__init__(
            "\n".join(f"block {number} failed and was left out: {reason}" for number, reason in failures.items())
        )
        self.failures = failures

    def __reduce__(self) -> tuple[type["FailedBlocksWarning"], tuple[dict[int, str]]]:
        return type(self), (self.failures,)


class NothingFeasibleWarning(RuntimeWarning):
    """Results have no design to rank; the text says why, in the words of `explore rank`."""
