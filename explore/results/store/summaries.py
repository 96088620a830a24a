"""A summary of a results file, for programs."""

from __future__ import annotations

from typing import Any

from explore.results.store.results import Results


def summarise(results: Results) -> dict[str, Any]:
    """What `explore show --json` prints, without the path."""
    return {
        "complete": results.is_complete,
        "packed": results.is_packed,
        "keep": results.keep,
        "studied": results.n_studied,
        "designs": results.n_designs,
        "committed": results.n_committed,
        "counts": results.counts,
        "units": results.units,
        "attributes": {key: value for key, value in results.attributes.items() if key != "determines"},
    }
