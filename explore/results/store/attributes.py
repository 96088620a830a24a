"""Reading the attributes of a results file and of its columns, with limits on their types and lengths."""

import h5py
from h5py import h5a, h5s

from explore.model.columns import Attribute, Column
from explore.results.store.layout import INDEX
from explore.results.store.study_record import contains_only, parse_json

_LARGEST_ATTRIBUTE = 65_536
_ROLES = ("index", "parameter", "metric", "margin", "bookkeeping", "")
#: Allowed dtypes of columns.
_TYPES = ("<f8", "<i8", "<i4", "|i1")
#: Dtypes of the columns that every results file has.
_TYPE_OF = {INDEX: "<i8", "status": "|i1", "feasible": "|i1"}
#: Length of the longest allowed texts of a column, letters.
_LONGEST = {"units": 100, "long_name": 1000, "role": 20, "labels": _LARGEST_ATTRIBUTE}


def read_attributes(owner: h5py.HLObject) -> dict[str, Attribute]:
    """The attributes that are texts or numbers; others were added by other programs."""
    values = {name: _read_attribute(owner, name) for name in owner.attrs}
    return {name: value for name, value in values.items() if value is not None}


def read_column(name: str, dataset: h5py.Dataset) -> Column:
    """The column of a dataset, from its type and attributes; ValueError if one is not allowed."""
    dtype = dataset.dtype.str
    if dtype not in _TYPES or dtype != _TYPE_OF.get(name, dtype):
        raise ValueError(f"{dataset.name} has the wrong type {dataset.dtype}")
    texts = {key: _column_text(dataset, key) for key in _LONGEST}
    role = texts["role"]
    if role not in _ROLES or (role == "index") != (name == INDEX):
        raise ValueError(f"{dataset.name} cannot have the role {role!r}")
    labels = parse_json(f"labels of {dataset.name}", texts["labels"] or "{}")
    if not contains_only(labels, dict, str) or (labels and dtype == "<f8"):
        raise ValueError(f"labels of {dataset.name} do not name integer codes")
    return Column(
        name, texts["units"], texts["long_name"], role, dtype, {int(code): label for code, label in labels.items()}
    )


def text_of(value: bytes | str) -> str:
    """The value as text; ValueError if it cannot be encoded as UTF-8."""
    return value.decode() if isinstance(value, bytes) else value.encode().decode()


def _read_attribute(owner: h5py.HLObject, name: str) -> Attribute | None:
    """The value of an attribute; None when it is neither a text nor a number."""
    attribute = h5a.open(owner.id, name.encode())
    if attribute.get_space().get_simple_extent_type() == h5s.NULL:
        return None
    if attribute.get_storage_size() > _LARGEST_ATTRIBUTE:
        raise ValueError(f"attribute {name} is too long")
    value = owner.attrs[name]
    if isinstance(value, bytes | str):
        return text_of(value)
    value = getattr(value, "tolist", lambda: None)()
    if type(value) is int:  # not bool, a subclass of int
        return value if -(2**63) <= value < 2**63 else None
    return value if isinstance(value, float) else None


def _column_text(dataset: h5py.Dataset, key: str) -> str:
    if key not in dataset.attrs:
        return ""
    text = _read_attribute(dataset, key)
    if isinstance(text, str) and len(text) <= _LONGEST[key]:
        return text
    raise ValueError(f"{key} of {dataset.name} is not a text of at most {_LONGEST[key]:,} letters")
