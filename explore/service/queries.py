"""Names of queries: FastAPI drops those that a route does not have, and all but the last of one that is given twice.

So a mistyped condition of a ranking would be left out without a word, and a mistyped dry run queue its job.
"""

from typing import get_origin

from fastapi import Request

from explore.base.errors import RequestError
from explore.base.suggest import format_value, suggestion


async def check_query(request: Request) -> None:
    """Raise `RequestError` for a name that the route does not have, or for a second value where it takes one."""
    known = {field.alias: field.field_info.annotation for field in request.scope["route"].dependant.query_params}
    for name in request.query_params:
        if name not in known:
            advice = suggestion(name, known) if known else "this address takes none"
            raise RequestError(f"unknown parameter {format_value(name)}; {advice}")
        if len(request.query_params.getlist(name)) > 1 and get_origin(known[name]) is not list:
            raise RequestError(f"{name} is given more than once; give one, conditions joined by 'and'")
