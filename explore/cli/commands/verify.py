"""`explore verify`: check the committed blocks of a results file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from explore.cli.options import JsonOption, ResultsArgument
from explore.cli.output import complain, count_of, print_json, say
from explore.cli.paths import newest_results
from explore.cli.progress import block_bar
from explore.cli.tables import print_table

if TYPE_CHECKING:
    from explore.results.store.results import Results

#: Largest number of damaged blocks that are listed; --json lists all.
_MOST_LISTED = 20


def verify(results: ResultsArgument = None, as_json: JsonOption = False) -> None:
    """Check every committed block of a results file against its checksum."""
    raise typer.Exit(_verify(results or newest_results(), as_json=as_json))


def _verify(path: Path, *, as_json: bool) -> int:
    """Check a results file, print its blocks and designs, and return the exit code."""
    from explore import open_results

    results = open_results(path)
    with block_bar("checking") as progress:
        damaged = results.verify(progress)
    committed = sorted({*results.committed_blocks, *damaged})
    statuses = results.count_statuses(sorted({*results.committed_blocks} - {*damaged}))
    if as_json:
        print_json(
            {
                "path": str(results.path),
                "sound": not damaged,
                "complete": results.is_complete,
                "keep": results.keep,
                "studied": results.n_studied,
                "designs": results.n_designs,
                "committed": results.n_committed,
                "blocks": results.n_blocks,
                "committed_blocks": len(committed),
                "pending_blocks": results.n_blocks - len(committed),
                "damaged_blocks": [
                    {"block": number, "first_row": start, "last_row": stop - 1}
                    for number in damaged
                    for start, stop in [results.row_range(number)]
                ],
                "counts": statuses,
            }
        )
        return 1 if damaged else 0
    say(
        f"{results.path}: {count_of(len(committed), 'block')} committed, "
        f"{results.n_blocks - len(committed):,} pending, {len(damaged):,} damaged; "
        f"{count_of(results.n_committed, 'design')}",
        data=True,
    )
    title = (
        ("designs" if results.keep == "all" else "kept designs")
        + " by status"
        + (", damaged blocks left out" if damaged else "")
    )
    print_table(title, [("status", ""), ("designs", "")], [[label, f"{n:,}"] for label, n in statuses.items()])
    _conclude(results, damaged)
    return 1 if damaged else 0


def _conclude(results: Results, damaged: list[int]) -> None:
    """Say whether the file is sound, and what to do if not."""
    if not damaged:
        state = "finished" if results.is_complete else f"not finished: {results.n_committed:,} of {results.n_designs:,}"
        say(f"every committed block is sound; {state}", data=True)
        return
    what = "rows" if results.keep != "all" else "designs"
    for number in damaged[:_MOST_LISTED]:
        start, stop = results.row_range(number)
        complain(f"block {number} is damaged: {what} {start:,} to {stop - 1:,}")
    if len(damaged) > _MOST_LISTED:
        complain(f"and {len(damaged) - _MOST_LISTED:,} more; --json lists all")
    complain(_advice(results))


def _advice(results: Results) -> str:
    if results.is_packed:
        return "restore the file from a copy, or pack the original again"
    if results.keep != "all":
        return "restore the file from a copy, or run the sweep or refinement again with --restart"
    return "run the sweep or refinement again: it computes the damaged blocks anew and keeps the others"
