"""What all writers of results files share: they hold the lock, remove unfinished files and explain errors."""

import contextlib
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

from explore.base.errors import ResultsError
from explore.base.files import real_path
from explore.model.columns import Attribute, Column
from explore.results.store.locking import LockFile
from explore.results.store.sidecar_files import check_journal, remove_leftovers, set_aside


@contextlib.contextmanager
def exclusive_access(path: Path) -> Iterator[None]:
    """Hold the lock of a results file, and first remove the unfinished files of killed writers."""
    with LockFile(path):
        remove_leftovers(path)
        yield


class SweepWriter(ABC):
    """The single writer of a sweep's results file, a context manager.

    The arguments are those of `create_results_file`; with `restart` an existing file and journal are moved aside. On
    entering, a `ResultsError` says that another process is writing, or that the file cannot be opened or created.
    """

    def __init__(
        self,
        path: Path,
        columns: Sequence[Column],
        n_designs: int,
        block_size: int,
        attributes: Mapping[str, Attribute],
        *,
        restart: bool = False,
    ) -> None:
        self.path = real_path(path)
        self._content = (tuple(columns), n_designs, block_size, dict(attributes))
        self._restart = restart
        self._closing = contextlib.ExitStack()

    def __enter__(self) -> Self:
        try:
            with contextlib.ExitStack() as stack:
                stack.enter_context(exclusive_access(self.path))
                if self._restart:
                    set_aside(self.path)
                check_journal(self.path)
                self._open(stack)
                self._closing = stack.pop_all()
        except ResultsError:
            raise
        except OSError as error:
            raise ResultsError(f"{self.path} cannot be written: {error.strerror or error}") from error
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with self._closing:
            if error is None:
                self._check_written()

    @abstractmethod
    def _open(self, stack: contextlib.ExitStack) -> None:
        """Open or create the file; the stack closes it before it releases the lock."""

    def _check_written(self) -> None:  # noqa: B027 -- a writer that checks as it writes needs nothing here
        """Check the file at the end of a run without an error; `ResultsError` if it is damaged or displaced."""
