"""Read a results file: its study, its columns and its designs, also while a sweep writes it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from dataclasses import replace
from functools import cached_property
from html import escape
from importlib.util import find_spec
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from explore.base.counts import design_numbers
from explore.base.errors import RequestError
from explore.base.units.shown import Scale, ShownUnits, in_units, read_shown_units, show_bounds
from explore.model.columns import Column
from explore.model.progress import ReportProgress
from explore.results.store.block_bytes import damaged_blocks
from explore.results.store.layout import INDEX, KEEP_FRONT
from explore.results.store.recorded_study import RecordedStudy
from explore.results.store.rows import RowReader
from explore.results.store.table_words import in_words

if TYPE_CHECKING:
    import pandas as pd
    import xarray


#: Number of designs that a notebook shows.
_FIRST = 5


class Results(RecordedStudy):
    """The designs that were committed to a results file when it was opened.

    `explore.open_results` makes one. No file stays open, and a running sweep is not disturbed: open the file again to
    see what was committed since.

    Parameters
    ----------
    path
        The file.

    Raises
    ------
    ResultsError
        The file is missing or is not a sound results file; on reading, the file was replaced or is damaged.

    Examples
    --------
    >>> results = explore.open_results("results/grid.h5")  # doctest: +SKIP
    >>> results.units["swing_angle"]  # doctest: +SKIP
    'deg'
    >>> frame = results.to_pandas(["crank", "swing_angle"])  # doctest: +SKIP
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self._reader = RowReader(self.path)
        self._layout = self._reader.layout
        self._units = ShownUnits()

    def __repr__(self) -> str:
        if self.keep != "all":
            return f"<Results {str(self.path)!r}: {self.n_committed} kept of {self.n_studied} designs>"
        return f"<Results {str(self.path)!r}: {self.n_committed} of {self.n_designs} designs>"

    def _repr_html_(self) -> str:
        """For notebooks: what the results are, how many designs have each status, and the first ones in words."""
        counts = ", ".join(f"{count:,} {label}" for label, count in self.counts.items())
        head = f"<p><b>{escape(self.mechanism)}</b> {escape(repr(self)[1:-1])}: {escape(counts)}</p>"
        numbers = [int(number) for block in islice(self.blocks([INDEX]), 1) for number in block[INDEX][:_FIRST]]
        return head + in_words(self.designs(numbers)).to_html() if numbers else head

    def __len__(self) -> int:
        return self.n_committed

    @property
    def constraints(self) -> dict[str, dict[str, float | None]]:
        """The bounds of each constrained metric as "min" and "max", in the metric's unit; None leaves a side open."""
        return show_bounds(self._layout.study.constraints, self.scales)

    @cached_property
    def columns(self) -> tuple[Column, ...]:
        """The columns in their order, the index first."""
        return tuple(replace(column, unit=self.scales[column.name].shown) for column in self._layout.columns)

    @property
    def units(self) -> dict[str, str]:
        """Unit of each column."""
        return {column.name: column.unit for column in self.columns}

    @property
    def declared(self) -> Results:
        """These results in declared units."""
        return self.in_units(ShownUnits())

    @property
    def shown_units(self) -> ShownUnits:
        """The chosen units."""
        return self._units

    @cached_property
    def scales(self) -> dict[str, Scale]:
        """The declared and the shown unit of each column."""
        return self._units.scales({column.name: column.unit for column in self._layout.columns})

    def in_units(self, units: ShownUnits | Mapping[str, str]) -> Results:
        """These results with all values and bounds in the chosen units, as ``{"length": "in", "speed": "rpm"}``.

        The file stays in declared ones: values are converted when they are read. Two designs that differ by a rounding
        error may become equal, so that rankings compare the declared values.
        """
        units = units if isinstance(units, ShownUnits) else read_shown_units(units)
        if units == self._units:
            return self
        shown = copy(self)
        for name in ("columns", "scales"):
            vars(shown).pop(name, None)
        shown._units = units
        return shown

    def show(self, frame: pd.DataFrame) -> pd.DataFrame:
        """A table of `declared` in the shown units."""
        return in_units(frame, self.scales)

    @property
    def n_studied(self) -> int:
        """Number of designs of the study, including those that were not kept."""
        return self._reader.n_studied

    @property
    def n_committed(self) -> int:
        """Number of committed designs."""
        return self._layout.count_rows(self._reader.is_committed)

    @property
    def is_complete(self) -> bool:
        """Whether every design is committed."""
        return bool(self._reader.is_committed.all())

    @property
    def committed_blocks(self) -> list[int]:
        """Numbers of the committed blocks, ascending."""
        return np.flatnonzero(self._reader.is_committed).tolist()

    @cached_property
    def counts(self) -> dict[str, int]:
        """Number of committed designs by the label of their status; labels that do not occur are left out.

        Designs that were studied but not kept are counted too.
        """
        if self.keep == KEEP_FRONT:
            return {label: count for label, count in self._layout.study.studied_counts.items() if count}
        return self.count_statuses(self.committed_blocks)

    def count_statuses(self, blocks: Sequence[int]) -> dict[str, int]:
        """Number of designs in some committed blocks by the label of their status."""
        counts: Counter[int] = Counter()
        status = self._reader.column("status")
        for block in self._reader.read_blocks([status], blocks):
            codes, numbers = np.unique(block["status"], return_counts=True)
            counts.update(dict(zip(codes.tolist(), numbers.tolist(), strict=True)))
        return {status.labels.get(code, str(code)): counts[code] for code in sorted(counts)}

    def to_pandas(self, columns: Sequence[str] | str | None = None) -> pd.DataFrame:
        """The committed designs as a table.

        Parameters
        ----------
        columns
            Names of the columns to read, or one name; all when None.

        Returns
        -------
        pandas.DataFrame
            Index "design", one row for each committed design. ``attrs["units"]`` has the unit of each column,
            ``attrs["labels"]`` the words for the codes of columns such as ``status``, ``attrs`` also "senses",
            "objectives" and "constraints" for `explore.rank`.
        """
        import pandas as pd  # 0.4 s, not needed by a sweep

        given = [columns] if isinstance(columns, str) else columns
        names = [column.name for column in self.columns] if given is None else list(given)
        selected = [self._reader.column(name) for name in names if name != INDEX]
        index, *arrays = self._reader.read_committed([self._reader.column(INDEX), *selected])
        data = dict(zip((column.name for column in selected), arrays, strict=True))
        return self._with_attrs(pd.DataFrame(data, index=pd.Index(index, name=INDEX), copy=False))

    def to_xarray(self) -> xarray.Dataset:
        """The committed designs as a dataset; see `explore.xarray`."""
        if find_spec("xarray") is None:
            raise RequestError('this needs xarray: pip install "linkage-explore[xarray]"')
        from explore.results.store.dataset import make_dataset

        return make_dataset(self._reader)

    def design(self, number: int) -> dict[str, Any]:
        """One design: the value of each column by name; errors as of `designs`."""
        one = design_numbers([number] if np.ndim(number) else number)
        rows = self._reader.rows_of(one.reshape(1))
        arrays = self._reader.read_rows(self._layout.columns, rows)
        return {
            name: scale.show_all(values)[0].item()
            for (name, scale), values in zip(self.scales.items(), arrays, strict=True)
        }

    def designs(self, numbers: npt.ArrayLike) -> pd.DataFrame:
        """Read some designs by number.

        Parameters
        ----------
        numbers
            Design numbers, shape (n,), in any order.

        Returns
        -------
        pandas.DataFrame
            All columns, index "design", one row for each number in the order of `numbers`; ``attrs`` as of `to_pandas`.

        Raises
        ------
        RequestError
            If a number is not whole.
        ResultsError
            If a design is not in the file, or its block does not have its checksum.
        """
        import pandas as pd  # 0.4 s, not needed by a sweep

        unique, places = np.unique(design_numbers(numbers), return_inverse=True)
        rows = self._reader.rows_of(unique)
        arrays = self._reader.read_rows(self._layout.columns, rows)
        data = {name: values[places] for name, values in zip(self.scales, arrays, strict=True)}
        return self._with_attrs(pd.DataFrame(data, copy=False).set_index(INDEX))

    def blocks(self, columns: Sequence[str] | None = None) -> Iterator[dict[str, npt.NDArray[Any]]]:
        """Read the committed blocks in order, each as arrays of shape (n,) by name; all columns when None."""
        selected = self._layout.columns if columns is None else tuple(self._reader.column(name) for name in columns)
        for block in self._reader.read_blocks(selected, self.committed_blocks):
            yield {name: self.scales[name].show_all(values) for name, values in block.items()}

    def verify(self, report_progress: ReportProgress | None = None) -> list[int]:
        """Check the bytes of every committed block against its checksum.

        Parameters
        ----------
        report_progress
            Called after each block with the number of blocks checked and to check.

        Returns
        -------
        list of int
            Numbers of the damaged blocks.
        """
        with self._reader.open() as file:
            return damaged_blocks(file, self._layout, report_progress)

    def _with_attrs(self, frame: pd.DataFrame) -> pd.DataFrame:
        """Add units, labels and what `explore.rank` needs of the study to a table, and show it."""
        frame.attrs["units"] = {c.name: c.unit for c in self._layout.columns if c.name in frame}
        frame.attrs["labels"] = {c.name: dict(c.labels) for c in self.columns if c.labels and c.name in frame}
        frame.attrs["senses"] = self.senses
        frame.attrs["objectives"] = list(self.objectives)
        frame.attrs["constraints"] = self._layout.study.constraints
        return self.show(frame)
