"""The data of a page of several results: the columns of all, their joint Pareto set, and facts of each."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from itertools import accumulate, chain
from typing import TYPE_CHECKING, Any

import numpy as np

from explore.base.errors import RequestError
from explore.figures.reporting.contents import Contents, ReportStep, describe_column, describe_study
from explore.figures.reporting.motion import describe_motion, kernel_for, translate_functions
from explore.figures.reporting.packing import ColumnPacker
from explore.figures.reporting.rows import ReportRows, choose_rows
from explore.model.columns import Column
from explore.model.mechanism import Mechanism
from explore.results.labels import distinct_names
from explore.results.ranking.joint import RESULTS_COLUMN, JointRanking, rank_sources
from explore.results.ranking.rankings import RankRequest
from explore.results.store.results import Results

if TYPE_CHECKING:
    import pandas as pd

#: Largest number of results that a page tells apart by colours and marks.
MAX_RESULTS = 6


def collect_joint_contents(
    sources: Mapping[str, Results], mechanism: Mechanism | None, command: str, step: ReportStep
) -> Contents:
    """Collect the data of a page of several results of one mechanism, by their names, as `collect_contents`.

    Raises `RequestError` if there are more results than a page tells apart, a column has another unit in some of them,
    or `explore.rank` refuses to rank them together.
    """
    if len(sources) > MAX_RESULTS:
        raise RequestError(f"a page of {len(sources)} results has no colours to tell them apart; name {MAX_RESULTS}")
    step("ranking")
    columns = _union_of_columns(sources)
    joint = rank_sources(sources, RankRequest())
    step("choosing designs")
    rows = [choose_rows(source, _joint_front(joint, name), shares=len(sources)) for name, source in sources.items()]
    step("reading")
    frame = _read_designs(list(sources.values()), rows, list(columns))
    step("packing")
    packer = ColumnPacker()
    names = distinct_names(sources)
    origins = np.repeat(np.arange(len(sources)), [len(part.numbers) for part in rows])
    origin_column = {
        "name": RESULTS_COLUMN, "unit": "", "meaning": "results file of the design", "role": "bookkeeping",
        "labels": {str(number): name for number, name in enumerate(names.values())}, "whole": True, "verbatim": True,
        "packed": packer.add(origins),
    }  # fmt: skip
    scales = {name: scale for source in sources.values() for name, scale in source.scales.items()}
    described = [
        {**describe_column(column, scales[name]), "packed": packer.add(frame[name].to_numpy())}
        for name, column in columns.items()
    ]
    step("describing")
    files = [_describe_file(names[name], source, mechanism, joint, name) for name, source in sources.items()]
    kernel = _kernel(list(sources.values()), mechanism) if mechanism else None
    for file, part in zip(files, rows, strict=True):
        file["parts"] = [asdict(count) for count in part.parts]
    study = {
        **_describe_all(files, joint),
        "motion": describe_motion(kernel, next(iter(sources.values())).shown_units) if kernel else None,
        "command": command,
        "columns": [origin_column, *described],
        "designs": packer.add(np.concatenate([part.numbers for part in rows])),
        "kinds": packer.add(np.concatenate([part.kinds for part in rows])),
        "chosen": _best_row(joint, list(sources), rows),
    }
    return Contents(study, packer.texts, translate_functions(kernel) if kernel else "")


def _union_of_columns(sources: Mapping[str, Results]) -> dict[str, Column]:
    """The columns of all results by name, without the numbers of designs."""
    columns: dict[str, tuple[str, Column]] = {}
    for path, source in sources.items():
        for column in source.columns:
            first_path, first = columns.setdefault(column.name, (path, column))
            if column.unit != first.unit:
                units = f"{first.unit or 'a number'} in {first_path} and {column.unit or 'a number'} in {path}"
                raise RequestError(f"{column.name} is in {units}, so they cannot be on one page")
    if RESULTS_COLUMN in columns:
        path = columns[RESULTS_COLUMN][0]
        raise RequestError(f"{path} has a column {RESULTS_COLUMN}, which a page of several results makes itself")
    return {name: column for name, (_, column) in columns.items() if column.role != "index"}


def _joint_front(joint: JointRanking, name: str) -> Any:
    """Numbers of the designs of one of the results that are in the joint Pareto set."""
    frame = joint.whole.frame
    return frame.index[(frame[RESULTS_COLUMN] == name).to_numpy(bool)].to_numpy(np.int64)


def _read_designs(sources: Sequence[Results], rows: Sequence[ReportRows], names: Sequence[str]) -> pd.DataFrame:
    """The designs of the page in declared units, one file after the other; NaN in columns that a file does not have."""
    import pandas as pd

    frames = [source.declared.designs(part.numbers) for source, part in zip(sources, rows, strict=True)]
    return pd.concat([frame.reindex(columns=list(names)) for frame in frames])


def _describe_file(
    name: str, source: Results, mechanism: Mechanism | None, joint: JointRanking, path: str
) -> dict[str, Any]:
    """Facts of one of the results."""
    part = joint.parts[path]
    given = {column.name for column in source.columns if column.role == "parameter"}
    parameters = [parameter.name for parameter in mechanism.parameters] if mechanism else []
    return {
        **describe_study(source, mechanism, part),
        "name": name,
        "front": [len(part.frame), len(_joint_front(joint, path))],
        "lacks": [parameter for parameter in parameters if parameter not in given],
    }


def _kernel(sources: Sequence[Results], mechanism: Mechanism) -> Mechanism:
    """The mechanism that computes the motions of the page: with forces only where all studies have loads."""
    given = [{column.name for column in source.columns if column.role == "parameter"} for source in sources]
    return kernel_for(mechanism, set.intersection(*given))


def _describe_all(files: Sequence[Mapping[str, Any]], joint: JointRanking) -> dict[str, Any]:
    """Facts of all results together; what differs between them is left to each."""
    first = files[0]
    counts: Counter[str] = Counter()
    for label, count, _ in chain.from_iterable(file["counts"] for file in files):
        counts[label] += count
    meanings = {label: sentence for file in files for label, _, sentence in file["counts"]}
    parts = zip(*(file["parts"] for file in files), strict=True)
    missed = {entry[0]: entry for file in files for entry in file["missed"]}
    shared = {key: first[key] if all(file[key] == first[key] for file in files) else "" for key in ("window", "drive")}
    return {
        **{key: first[key] for key in ("version", "mechanism", "summary", "defaults")},
        **shared,
        "name": " + ".join(file["name"] for file in files),
        "sentences": {label: sentence for file in files for label, sentence in file["sentences"].items()},
        "studied": sum(file["studied"] for file in files),
        "committed": sum(file["committed"] for file in files),
        "complete": all(file["complete"] for file in files),
        "keep": "all" if all(file["keep"] == "all" for file in files) else "front",
        "counts": [[label, count, meanings[label]] for label, count in counts.items()],
        "objectives": [[objective.metric, objective.sense] for objective in joint.whole.objectives],
        "feasible": sum(file["feasible"] for file in files),
        "missed": list(missed.values()),
        "bounds": [bound for bound in first["bounds"] if all(bound in file["bounds"] for file in files)],
        "facts": [],
        "config": "",
        "parts": [
            {"kind": same[0]["kind"], **{key: sum(part[key] for part in same) for key in ("total", "held")}}
            for same in parts
        ],
        "files": list(files),
        "caveats": list(joint.caveats),
        "nearest": None,
        "density": None,
    }


def _best_row(joint: JointRanking, paths: Sequence[str], rows: Sequence[ReportRows]) -> int:
    """Row of the first design of the joint ranking that is on the page; 0 if none is."""
    starts = dict(zip(paths, accumulate((len(part.numbers) for part in rows), initial=0), strict=False))
    numbers = dict(zip(paths, (part.numbers for part in rows), strict=True))
    for design, path in zip(joint.whole.frame.index, joint.whole.frame[RESULTS_COLUMN], strict=True):
        place = int(np.searchsorted(numbers[path], design))
        if place < len(numbers[path]) and numbers[path][place] == design:
            return starts[path] + place
    return 0
