"""A design of results in words, and a summary of the file for programs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from explore.results.store.results import Results

#: Value of each column of a design, codes in words.
Record = dict[str, Any]


def label_record(results: Results, row: Record) -> Record:
    """The values of a design, with words for the codes of columns such as the status."""
    return {
        column.name: column.labels.get(int(row[column.name]), row[column.name]) if column.labels else row[column.name]
        for column in results.columns
    }


def with_status(results: Results, record: Record) -> Record:
    """The record with the label and the sentence of its status, and names with the units that are not declared."""
    from explore.base.units.shown import headings

    status, names = str(record["status"]), headings(results.scales, record)
    named = {names.get(name, name): value for name, value in record.items()}
    return {**named, "status_label": status, "status_sentence": results.status_sentences.get(status, "")}


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
