"""Why designs are not ranked, in sentences."""

from collections.abc import Mapping

from explore.results.ranking.rankings import Ranking
from explore.results.ranking.tallies import Tally


def left_out(tally: Tally, sentences: Mapping[str, str], *, with_missed: bool = True) -> list[str]:
    """What is left out, each with its number and reason; `sentences` are those of statuses, by their words."""
    missed, undefined = (
        [(name.removesuffix("_margin"), count) for name, count in counts.most_common() if count]
        for counts in (tally.by_constraint, tally.by_undefined_constraint)
    )
    return [
        *(f"{count:,} miss the constraint on {name}" for name, count in missed if with_missed),
        *(f"{count:,} in which {name}, a constraint, is undefined" for name, count in undefined),
        *(f"{count:,} {label}: {sentences.get(label, '')}" for label, count in tally.by_status.most_common()),
        *([f"{tally.n_not_finite:,} in which an objective is undefined or infinite"] if tally.n_not_finite else []),
    ]


def left_out_by_request(ranking: Ranking) -> list[str]:
    """The feasible designs that the request leaves out, each reason with its number."""
    return [f"{count:,} feasible ones that {reason}" for reason, count in ranking.exclusions.items() if count]


def reason_for_nothing(ranking: Ranking, name: object) -> str:
    """Why a ranking of the results of a name has no design; empty if it has one."""
    return "" if ranking.tally.n_ranked else f"{nothing_ranked(ranking, name)}, so there is nothing to rank"


def nothing_ranked(ranking: Ranking, name: object) -> str:
    """Why a ranking of the results of a name has no design, as the beginning of a sentence."""
    is_narrowed = any(ranking.exclusions.values())
    if ranking.tally.n_not_finite:
        which = " that meets the request" if is_narrowed else ""
        return f"in each feasible design of {name}{which} an objective is undefined or infinite"
    return f"no feasible design of {name} meets the request" if is_narrowed else f"no design of {name} is feasible"


def warning_of_nothing(ranking: Ranking, name: object, sentences: Mapping[str, str]) -> str:
    """The reason for an empty ranking and all that is left out, in one line; empty if it has a design."""
    reason = reason_for_nothing(ranking, name)
    return reason and "; left out: ".join((reason, *left_out_by_request(ranking), *left_out(ranking.tally, sentences)))
