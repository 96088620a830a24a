"""What a submitted study asks for, and the limits of the service."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from explore.config import key_lines, toml_text
from explore.config.study_file import parse_study
from explore.errors import ConfigError, RequestError
from explore.sweeping.collectors import results_columns, row_bytes

#: Largest study in bytes, as on the command line.
MOST_STUDY_BYTES = 1 << 21


@dataclass(frozen=True)
class Limits:
    """What the service accepts: designs and bytes of a job, jobs that wait, and seconds that a sweep may take.

    None for the seconds sets no limit.
    """

    designs: int = 1_000_000_000
    bytes: int = 100_000_000_000
    queue: int = 100
    seconds: float | None = None


@dataclass(frozen=True)
class Plan:
    """What a study asks for; `bytes` is None where only the front is kept."""

    mechanism: str
    designs: int
    blocks: int
    columns: int
    bytes: int | None
    method: str


def make_plan(name: str, content: bytes, keep: str) -> Plan:
    """Read a study and count what its sweep would make.

    Raises
    ------
    ConfigError
        With one line ``NAME.toml:line: key: reason; suggestion`` for each problem.
    """
    file = f"{name}.toml"
    if len(content) > MOST_STUDY_BYTES:
        raise ConfigError([f"{file}: has {len(content):,} bytes, but a study has at most {MOST_STUDY_BYTES:,}"])
    try:
        text = content.decode("utf-8-sig")  # as a study file is read
    except UnicodeDecodeError as error:
        raise ConfigError([f"{file}: is not UTF-8 text (byte {error.start}); save it as UTF-8"]) from None
    _refuse_files(file, text)
    study = parse_study(text, file, Path())
    if keep == "front" and not study.objectives:
        raise RequestError("to keep only the front, give objectives ([rank] metrics of the study)")
    n_designs = study.space.n_designs
    size = n_designs * row_bytes(study) if keep == "all" else None
    columns = len(results_columns(study))
    mechanism = study.request.mechanism.name
    return Plan(mechanism, n_designs, study.space.n_blocks, columns, size, study.space.method)


def check_limits(plan: Plan, limits: Limits, folder: Path) -> None:
    """Raise `RequestError` that says what to change if a plan is beyond the limits or the free space."""
    if plan.designs > limits.designs:
        raise RequestError(
            f"the study has {plan.designs:,} designs, but this server takes {limits.designs:,} at most; "
            "sweep fewer values"
        )
    if plan.bytes is None:
        return
    advice = "sweep fewer values or metrics, or keep the front only"
    if plan.bytes > limits.bytes:
        raise RequestError(
            f"the results need {plan.bytes:,} bytes, but this server takes {limits.bytes:,} at most; {advice}"
        )
    free = shutil.disk_usage(folder).free
    if plan.bytes > free:
        raise RequestError(f"the results need {plan.bytes:,} bytes, but only {free:,} are free on the server; {advice}")


def _refuse_files(file: str, text: str) -> None:
    """Refuse a study that names a file, before anything opens it: it would be a file of the server."""
    sections: dict[str, Any] = toml_text.parse_toml(file, text)
    sampling, target = (sections.get(name) for name in ("sampling", "target"))
    key, reason = ("", ""), ""
    if isinstance(sampling, dict) and ("file" in sampling or sampling.get("method") == "table"):
        key = ("sampling", "file" if "file" in sampling else "method")
        reason = "a server reads no table of designs; write lists of values, or sweep the study with `explore sweep`"
    elif isinstance(target, dict) and "file" in target:
        key, reason = ("target", "file"), "a server reads no file of points; write them as points = [[0, 0], [10, 5]]"
    if reason:
        line = key_lines.line_of(key_lines.locate(text.replace("\r\n", "\n")), key)
        raise ConfigError([f"{file}:{line}: {'.'.join(key)}: {reason}"])
