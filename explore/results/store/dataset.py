"""Committed rows as an xarray dataset that reads a column when its values are needed. Needs xarray."""

from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from xarray.backends import BackendArray
from xarray.core.indexing import ExplicitIndexer, IndexingSupport, LazilyIndexedArray, explicit_indexing_adapter

from explore.model.columns import Column
from explore.results.store.layout import INDEX, KEEP_FRONT
from explore.results.store.rows import RowReader, dtype_of


class _LazyColumn(BackendArray):
    """A column as an array of shape (rows,); indexing it reads the indexed values."""

    def __init__(self, reader: RowReader, column: Column) -> None:
        self._reader, self._column = reader, column
        self.shape = (reader.layout.count_rows(reader.is_committed),)
        self.dtype = dtype_of(column)

    def __getitem__(self, key: ExplicitIndexer) -> Any:
        return explicit_indexing_adapter(key, self.shape, IndexingSupport.OUTER, self._read)

    def _read(self, key: tuple[Any, ...]) -> Any:
        return self._reader.read_positions(self._column, key[0])


def make_dataset(reader: RowReader) -> xr.Dataset:
    """Make the dataset of `explore.xarray`."""
    encoding = {"preferred_chunks": {INDEX: reader.layout.block_size}}
    variables = {
        column.name: xr.Variable((INDEX,), LazilyIndexedArray(_LazyColumn(reader, column)), _attrs(column), encoding)
        for column in reader.layout.columns
        if column.name != INDEX
    }
    coordinate = (INDEX, _design_index(reader), _attrs(reader.column(INDEX)))
    return xr.Dataset(variables, coords={INDEX: coordinate}, attrs=dict(reader.layout.attributes))


def _attrs(column: Column) -> dict[str, Any]:
    attrs: dict[str, Any] = {"units": column.unit, "long_name": column.long_name}
    if column.labels:
        attrs["flag_values"] = np.array(list(column.labels), column.dtype)
        attrs["flag_meanings"] = " ".join(label.replace(" ", "_") for label in column.labels.values())
    return attrs


def _design_index(reader: RowReader) -> pd.Index:
    """Numbers of the committed designs; they are read only from a file that keeps the front."""
    if reader.layout.attributes.get("keep") == KEEP_FRONT:
        return pd.Index(reader.kept_designs, name=INDEX)
    ranges = [pd.RangeIndex(*rows, name=INDEX) for rows in reader.committed_ranges]
    return ranges[0].append(ranges[1:]) if ranges else pd.RangeIndex(0, name=INDEX)
