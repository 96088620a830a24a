"""Names that the shell completes: mechanisms and columns of results."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from explore.base.errors import ExploreError

if TYPE_CHECKING:
    from explore.model.columns import Column


def complete_mechanisms() -> list[str]:
    """Names of the mechanisms, without loading any."""
    from explore.mechanisms.entry_points import registered_entries

    return sorted(registered_entries())


def complete_tasks() -> list[tuple[str, str]]:
    """Types of tasks, with what their linkages do."""
    from explore.synthesis.tasks.registry import TASK_TYPES

    return [(each.name, each.summary) for each in TASK_TYPES.values()]


def complete_linkages() -> list[tuple[str, str]]:
    """Names of the classic linkages, with what they do."""
    from explore.studies.config.study_file import linkage_starters

    return list(linkage_starters().items())


def complete_objectives(ctx: typer.Context) -> list[tuple[str, str]]:
    """Columns of the results that can be objectives, with their meaning."""
    from explore.results.ranking.rankings import RANKABLE_ROLES

    return [(c.name, c.long_name) for c in _columns(ctx) if c.role in RANKABLE_ROLES and not c.labels]


def complete_columns(ctx: typer.Context) -> list[tuple[str, str]]:
    """Columns of the results that can be drawn, with their meaning."""
    return [(c.name, c.long_name) for c in _columns(ctx) if c.role != "index" and not c.labels]


def complete_metrics(ctx: typer.Context) -> list[tuple[str, str]]:
    """Metrics of the results, or of the mechanism that the line names its closed-form ones, with their meaning."""
    return _quantities(ctx, "metric")


def complete_parameters(ctx: typer.Context) -> list[tuple[str, str]]:
    """Parameters of the mechanism that the line names, else those of the results."""
    return _quantities(ctx, "parameter")


def _quantities(ctx: typer.Context, role: str) -> list[tuple[str, str]]:
    from explore.mechanisms.registry import MECHANISMS

    name = ctx.params.get("mechanism")
    if name is None:
        return [(c.name, c.long_name) for c in _columns(ctx) if c.role == role and not c.labels]
    with suppress(ExploreError, KeyError):
        mechanism = MECHANISMS[name]
        if role == "parameter":
            return [(p.name, p.long_name) for p in mechanism.parameters]
        return [(m.name, m.long_name) for m in mechanism.metrics if not m.labels]
    return []


def _columns(ctx: typer.Context) -> Iterator[Column]:
    """The columns of the results that the command line names, else of the newest; none if they cannot be read."""
    from explore import open_results
    from explore.cli.paths import list_results

    # After an option without its value, click leaves the words of the line in the arguments.
    named = ctx.params.get("results") or ctx.args
    words = map(Path, named if isinstance(named, (list, tuple)) else [named])
    with suppress(ExploreError, OSError):
        path = next((word.expanduser() for word in words if word.expanduser().is_file()), None)
        yield from open_results(path or list_results()[0]).columns
