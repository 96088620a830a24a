"""Files that a command reads and writes: checks before anything is computed, and the newest results."""

import errno
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from explore.base.errors import RequestError, ResultsError
from explore.cli.output import say

#: Formats of figures.
FIGURE_ENDINGS = (".png", ".svg", ".pdf")
#: Formats of tables.
TABLE_ENDINGS = (".csv", ".json", ".md", ".parquet")
#: Ending of results that `explore pack` packed.
_PACKED = ".packed.h5"


def check_output(path: Path | None, endings: Sequence[str]) -> None:
    """Refuse an output file that cannot be written, or whose name does not end in one of the formats."""
    if path is None:
        return
    if path.suffix.lower() not in endings:
        names = f"{', '.join(endings[:-1])} or {endings[-1]}" if len(endings) > 1 else endings[0]
        raise RequestError(f"-o {path}: the name must end in {names}")
    check_new_file(path)


def check_new_file(path: Path) -> None:
    """Refuse a path at which no file can be written."""
    if path.exists() and not path.is_file():
        kind = "a folder" if path.is_dir() else "a pipe or a device"
        raise RequestError(f"-o {path}: it is {kind}; name another file")
    if not path.parent.is_dir():
        raise RequestError(f"-o {path}: there is no folder {path.parent}; name another file")


def check_results_file(path: Path) -> None:
    """Refuse a folder in place of a results file, and a name that says another format."""
    if path.is_dir():
        raise ResultsError(f"{path} is a folder; name another file with -o")
    ending = path.suffix.lower()
    if ending in (*TABLE_ENDINGS, *FIGURE_ENDINGS, ".toml"):
        reason = f"results are HDF5, so the name must not end in {ending}; write {path.with_suffix('.h5')}"
        raise RequestError(f"-o {path}: {reason}")


def refuse_overwriting(source: Path, output: Path | None, description: str) -> None:
    """Refuse an output file that is also the input, `description` in words."""
    if output is not None and output.exists() and source.exists() and output.samefile(source):
        raise RequestError(f"-o {output} is {description} itself; name another file")


@contextmanager
def atomic_files(folder: Path) -> Iterator[Path]:
    """A temporary folder whose files move to `folder` at the end; after an error none does.

    Entered before anything is computed, so that a folder that cannot be written is reported at once.
    """
    if folder.exists() and not folder.is_dir():
        raise RequestError(f"-o {folder} is a file; name a folder")
    from explore.base.files import check_regular, explained
    from explore.results.store.outputs import new_output_folder

    is_new = not folder.exists()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with new_output_folder(folder) as place:
            yield place
            files = list(place.iterdir())
            for file in files:
                check_regular(folder / file.name)
            for file in files:
                file.replace(folder / file.name)
    except BaseException as error:
        if is_new:
            with suppress(OSError):
                folder.rmdir()
        if isinstance(error, KeyboardInterrupt):
            say(f"interrupted; nothing was written to {folder}", "yellow")
        if isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT):
            raise explained(error, folder) from error
        raise


def newest_results() -> Path:
    """The results that a command reads when none are named."""
    newest, *others = list_results()
    if others:
        say(f"{newest} is the newest of {len(others) + 1} results", "dim")
    return newest


def list_results() -> list[Path]:
    """The results in the folder `results`, the newest first; `ResultsError` if there are none."""
    folder = Path("results")
    times = {path: path.stat().st_mtime for path in folder.glob("*.h5") if not _is_packed_copy(path)}
    # A sweep with --keep front has only a journal until it is done.
    times |= {path.with_suffix(""): path.stat().st_mtime for path in folder.glob("*.h5.journal")}
    if not times:
        raise ResultsError("no results yet: run `explore sweep STUDY` first, or name a results file")
    return sorted(times, key=times.__getitem__, reverse=True)


def packed_name(path: Path) -> Path:
    """The packed copy of a results file, beside it."""
    return path.with_name(path.name.removesuffix(".h5") + _PACKED)


def _is_packed_copy(path: Path) -> bool:
    """Whether this is the packed copy of results that are there too."""
    return path.name.endswith(_PACKED) and path.with_name(path.name.removesuffix(_PACKED) + ".h5").exists()
