"""`explore pack`: a compressed copy of a finished results file."""

from __future__ import annotations

from pathlib import Path

from explore.cli.bars import block_bar
from explore.cli.output import newest_results, say


def pack_results(path: Path | None, output: Path | None) -> None:
    """Write the copy and say what it saves."""
    from explore.store.opening import open_results
    from explore.store.packing import pack

    source = path or Path(newest_results())
    open_results(source)  # it knows why a file is not there yet
    target = output or source.with_name(source.name.removesuffix(".h5") + ".packed.h5")
    with block_bar("packing") as progress:
        pack(source, target, progress)
    before, after = source.stat().st_size, target.stat().st_size
    say(f"{before / 1e6:,.1f} MB -> {after / 1e6:,.1f} MB, {before / after:.1f} times smaller: {target}")
