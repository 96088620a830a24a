"""The data that the page of a report draws one design from, for a page that gets designs one by one."""

from typing import Any

from explore.base.errors import RequestError
from explore.base.json_text import json_value
from explore.figures.reporting.contents import describe_column, describe_study, design_kernel
from explore.figures.reporting.motion import translate_functions
from explore.figures.reporting.rows import FEASIBLE, INFEASIBLE
from explore.model.mechanism import Mechanism
from explore.results.store.results import Results


def collect_design(results: Results, mechanism: Mechanism, number: int) -> dict[str, Any]:
    """The data of a report on one design; can be written as JSON.

    As in a report: facts of the study, its "columns" in declared units, "designs" and "kinds". The columns are not
    packed: each has its one value under "declared", None where it is undefined.
    """
    row = results.declared.design(number)
    columns = [
        {**describe_column(column, results.scales[column.name]), "declared": [row[column.name]]}
        for column in results.columns
        if column.role != "index"
    ]
    kind = FEASIBLE if row.get("feasible") else INFEASIBLE
    facts = {**describe_study(results, mechanism, None), "columns": columns, "designs": [number], "kinds": [kind]}
    return dict(json_value(facts))


def motion_script(results: Results, mechanism: Mechanism) -> str:
    """The mechanism's functions as a script for the page of a report; `RequestError` without translation."""
    script = translate_functions(design_kernel(results, mechanism))
    if not script:
        raise RequestError(f"the motion of a {mechanism.name} cannot be drawn in a page")
    return script
