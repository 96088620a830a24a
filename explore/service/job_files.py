"""The file of a job: a study to sweep, a task to find linkages for, or the refinement of another job's results."""

from dataclasses import asdict, dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

from explore.analysis.refining.plan import EVALUATIONS, RefinementPlan, plan_refinement
from explore.base.errors import ConfigError, Problems, RequestError, ResultsError
from explore.results.store.open_results import open_results
from explore.service.folder import check_name
from explore.studies.config import toml_text
from explore.studies.config.linkage import curve_files
from explore.studies.config.study import Study
from explore.studies.config.study_file import parse_study
from explore.synthesis.tasks.task_files import TaskFile, parse_task

#: Largest file of a job, as on the command line, bytes.
MOST_FILE_BYTES = 1 << 21


class Kind(StrEnum):
    """Kinds of jobs, by their files."""

    study = "study"
    task = "task"
    refinement = "refinement"


@dataclass(frozen=True)
class Refinement:
    """What `explore refine` is told, with the name of a job in place of results; without metrics, the study's."""

    refine: str
    metric: tuple[str, ...] = ()
    evaluations: int = EVALUATIONS
    seed: int = 0

    def to_toml(self) -> str:
        """The text of its file."""
        return toml_text.format_toml({**asdict(self), "metric": list(self.metric)})

    def plan(self, folder: Path) -> RefinementPlan:
        """Its plan, from the results in a folder; errors name their file without the folder."""
        check_name(self.refine)
        try:
            return plan_refinement(
                open_results(folder / f"{self.refine}.h5"),
                objectives=list(self.metric) or None,
                evaluations=self.evaluations,
                seed=self.seed,
            )
        except (RequestError, ResultsError) as error:
            raise type(error)(str(error).replace(f"{folder}/", "")) from None


JobFile = Study | TaskFile | Refinement


def read_job_file(name: str, content: bytes, kind: Kind | None = None) -> JobFile:
    """Read the file of a job, which has to be of a kind if one is given.

    Raises `ConfigError` with one line ``NAME.toml:line: key: reason; suggestion`` for each problem.
    """
    file = f"{name}.toml"
    if len(content) > MOST_FILE_BYTES:
        raise ConfigError([f"{file}: has {len(content):,} bytes, but at most {MOST_FILE_BYTES:,} are read"])
    try:
        text = content.decode("utf-8-sig")  # as a study file is read
    except UnicodeDecodeError as error:
        raise ConfigError([f"{file}: is not UTF-8 text (byte {error.start}); save it as UTF-8"]) from None
    sections = toml_text.parse_toml(file, text)
    found, key = _kind_of(sections, kind)
    if kind is not None and found != kind:
        _refuse(file, text, [((key,), f"this is a {found}, but a {kind} was announced; submit it as a {found}")])
    _refuse(file, text, _named_files(sections))
    if found == Kind.task:
        return parse_task(text, file)
    if found == Kind.refinement:
        _refuse(file, text, _refinement_problems(sections))
        return Refinement(**sections | {"metric": tuple(sections.get("metric", ()))})
    return parse_study(text, file, Path())


def _kind_of(sections: dict[str, Any], announced: Kind | None) -> tuple[Kind, str]:
    """The kind of a file, and the key that tells it; a file without any that was announced as a task lacks its key."""
    if "mechanism" not in sections:
        for key, kind in (("task", Kind.task), ("refine", Kind.refinement)):
            if key in sections:
                return kind, key
        if announced == Kind.task:
            return Kind.task, "task"
    return Kind.study, "mechanism"


def _named_files(sections: dict[str, Any]) -> Problems:
    """The keys that name a file, which is refused before anything opens it: it would be a file of the server."""
    sampling, target = (sections.get(name) for name in ("sampling", "target"))
    problems: Problems = []
    if isinstance(sections.get("linkage"), str):
        reason = "a server reads no file of a linkage; write its sections in the study, [linkage] and others"
        problems.append((("linkage",), reason))
    for name in curve_files(sections):
        reason = "a server reads no file of a curve; write its rows as points = [[0, 0], [10, 5]]"
        problems.append((("linkage", "loads", "curves", name, "file"), reason))
    if isinstance(sampling, dict) and ("file" in sampling or sampling.get("method") == "table"):
        key = "file" if "file" in sampling else "method"
        reason = "a server reads no table of designs; write lists of values, or sweep the study with `explore sweep`"
        problems.append((("sampling", key), reason))
    if isinstance(target, dict) and "file" in target:
        reason = "a server reads no file of points; write its rows as points = [[0, 0], [10, 5]], or as poses or table"
        problems.append((("target", "file"), reason))
    return problems


def _refinement_problems(sections: dict[str, Any]) -> Problems:
    """Problems of a refinement, whose file a person may have written."""
    known = Refinement.__dataclass_fields__
    problems: Problems = [((key,), "unknown key") for key in sections if key not in known]
    if not isinstance(sections["refine"], str):
        problems.append((("refine",), "must be the name of a job in quotes"))
    metric = sections.get("metric", [])
    if not (isinstance(metric, list) and all(isinstance(name, str) for name in metric)):
        problems.append((("metric",), 'must be a list of metrics, such as ["cv", "swing_angle:max"]'))
    for key in ("evaluations", "seed"):
        if type(sections.get(key, 0)) is not int:
            problems.append(((key,), "must be a whole number"))
    return problems


def _refuse(file: str, text: str, problems: Problems) -> None:
    """Raise `ConfigError` with the lines of the problems, if there are any."""
    if problems:
        raise ConfigError(toml_text.locate_problems(file, text, problems))
