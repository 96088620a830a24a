"""Errors that reach a user: each is also the built-in that it resembles most."""


class ExploreError(Exception):
    """Base of every error that `explore` raises on purpose; its text is one clear sentence."""


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
    """A metric, window, statistic or parameter was asked for that does not exist or has no meaning."""


class MotionError(ExploreError, ArithmeticError):
    """The one mechanism that was to be simulated cannot make the motion."""


class ResultsError(ExploreError, OSError):
    """A results file is missing, foreign, damaged, locked or does not belong to this study."""


class ClusterError(ExploreError, RuntimeError):
    """The workers of a sweep cannot be reached, were lost, or do not compute with the same versions as this process."""
