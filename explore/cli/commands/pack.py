"""`explore pack`: write a compressed copy of finished results."""

from pathlib import Path
from typing import Annotated

from explore.cli.options import ResultsArgument, output_option
from explore.cli.output import say
from explore.cli.paths import check_results_file, newest_results, packed_name
from explore.cli.progress import block_bar


def pack(
    results: ResultsArgument = None,
    output: Annotated[
        Path | None, output_option(help="The copy; by default NAME.packed.h5 beside the results.")
    ] = None,
) -> None:
    """Write a compressed copy of finished results, which every command reads like the original."""
    from explore import open_results
    from explore.results.store.packing import pack as pack_file

    source = results or newest_results()
    open_results(source)  # says why if they cannot be read
    target = output or packed_name(source)
    check_results_file(target)
    with block_bar("packing") as progress:
        pack_file(source, target, progress)
    before, after = source.stat().st_size, target.stat().st_size
    say(f"{before / 1e6:,.1f} MB -> {after / 1e6:,.1f} MB, {before / after:.1f} times smaller: {target}")
