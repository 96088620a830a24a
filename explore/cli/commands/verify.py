"""`explore verify`: check the committed blocks of a results file."""

from __future__ import annotations

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
    from explore import open_results

    source = open_results(results or newest_results())
    with block_bar("checking") as progress:
        damaged = source.verify(progress)
    committed = sorted({*source.committed_blocks, *damaged})
    statuses = source.count_statuses(sorted({*source.committed_blocks} - {*damaged}))
    blocks = {number: source.row_range(number) for number in damaged}
    if as_json:
        print_json(
            {
                "path": str(source.path),
                "sound": not damaged,
                "complete": source.is_complete,
                "keep": source.keep,
                "studied": source.n_studied,
                "designs": source.n_designs,
                "committed": source.n_committed,
                "blocks": source.n_blocks,
                "committed_blocks": len(committed),
                "pending_blocks": source.n_blocks - len(committed),
                "damaged_blocks": [{"block": n, "first_row": a, "last_row": b - 1} for n, (a, b) in blocks.items()],
                "counts": statuses,
            }
        )
    else:
        say(
            f"{source.path}: {count_of(len(committed), 'block')} committed, "
            f"{source.n_blocks - len(committed):,} pending, {len(damaged):,} damaged; "
            f"{count_of(source.n_committed, 'design')}",
            data=True,
        )
        title = f"{'designs' if source.keep == 'all' else 'kept designs'} by status"
        rows = [[label, f"{n:,}"] for label, n in statuses.items()]
        print_table(title + ", damaged blocks left out" * bool(damaged), [("status", ""), ("designs", "")], rows)
        _conclude(source, damaged)
    if damaged:
        raise typer.Exit(1)


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
