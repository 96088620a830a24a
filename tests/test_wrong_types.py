"""Each value of each starter, and of each request of the service, replaced by one of another type: one clear line."""

import asyncio
import contextlib
import itertools
import json
import random
import re
import tomllib
import warnings
from pathlib import Path
from types import SimpleNamespace

import httpx
import pytest
from command_line import call

from explore import DoubtfulInputWarning
from explore.base.errors import ConfigError, RequestError
from explore.mechanisms.registry import MECHANISMS
from explore.service.access import Access
from explore.service.application import make_application
from explore.service.folder import Folder
from explore.service.job_files import read_job_file
from explore.service.plans import Limits
from explore.service.queue import Jobs
from explore.studies.config.study_file import parse_study, starter
from explore.synthesis.tasks.registry import TASK_TYPES
from explore.synthesis.tasks.task_files import parse_task, task_starter

#: What replaces a value, as TOML.
VALUES = [
    "[]", "{}", '""', "0", "-1", "true", "[[1, [2]], []]", '"' + "x" * 100_000 + '"', "nan", "1979-05-27", "9" * 400,
    '"1 in"', "[1.5, nan]", "07:32:00", '{ a = { b = [] } }', "[{}]", "-inf", '"\\u0000"',
]  # fmt: skip
#: Sections and keys that the starters leave out, so that their values are replaced too.
MORE = {
    "path": "[target]\nfile = 'p.csv'\nweights = [1, 1]\ncrank_angles = [0, 30]\nangles_from = 'frame'\n[bounds]\n"
    "crank_pivot = { x = [0, 50], y = 20 }\nrocker_pivot = { x = [50, 150] }\npassage = 'reported'\n"
    "crank_span_min = 90\n[search]\nexact = true\n",
    "slider-path": "[target]\nfile = 'p.csv'\nweights = [1, 1]\n[bounds]\ncrank_pivot = { x = [0, 50], y = 20 }\n",
    "motion": "[target]\nfile = 'p.csv'\n[bounds]\nlink_ratio_max = 5\ncrank_pivot = { x = [0, 50], y = 20 }\n"
    "rocker_pivot = { x = [50, 150] }\npassage = 'reported'\n",
    "function": "[target]\nfile = 'p.csv'\ntable = [[1, 0], [1.5, 0.1], [2, 0.3]]\n",
    "any task": "[metrics]\nreach = { formula = 'coupler', unit = 'mm' }\n"
    "[constraints]\nswing_angle = { min = 1, max = 2 }\n"
    "[evaluate]\nmetrics = ['cv']\nwindow = { from = 0, to = 90 }\ndrive = 'clutch'\ntolerance = 1e-9\n"
    "[units]\nlength = 'in'\n[tolerances]\ncrank = 0.1\n",
    "study": "[metrics]\nreach = { formula = '1 + pi', unit = 'mm' }\n[constraints]\ncv = { min = 1, max = 2 }\n"
    "[evaluate]\nmetrics = ['cv']\nwindow = { from = 0, to = 90 }\ndrive = 'clutch'\ntolerance = 1e-9\n"
    "[units]\nlength = 'in'\n[tolerances]\ncrank = 0.1\n[rank]\nmetrics = ['cv']\n"
    "[sampling]\nmethod = 'sobol'\ncount = 16\nseed = 1\nfile = 'designs.csv'\n"
    "[points]\nM = { along = 5, across = { min = 1, max = 2 } }\n"
    "[scene]\nname = 'x'\ngroup = 'y'\n"
    "[parameters]\nground = { solve = 'swing_angle', value = 20, min = 1, max = 2 }\n",
    "path target": "[points]\nM = { along = 5, across = 5 }\n[target]\nkind = 'path'\npoint = 'M'\n"
    "points = [[0, 0], [1, 1], [2, 0]]\nfile = 'p.csv'\nclosed = true\nweights = [1, 1, 1]\ncrank_angles = [0, 1, 2]\n"
    "angles_from = 'free'\n",
    "poses target": "[points]\nM = { along = 5, across = 5 }\n[target]\nkind = 'poses'\npoint = 'M'\n"
    "poses = [[0, 0, 0], [1, 1, 2], [2, 0, 3]]\nfile = 'p.csv'\nlever = 3\norder = 'any'\n",
    "function target": "[target]\nkind = 'function'\ntable = [[0, 0], [1, 1], [2, 3]]\nfile = 'p.csv'\n",
}


class Raw(str):
    """TOML text."""


def to_toml(value):
    """The inline TOML of a value."""
    if isinstance(value, Raw):
        return str(value)
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{json.dumps(key)} = {to_toml(item)}" for key, item in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(to_toml, value)) + "]"
    return json.dumps(value)


def document(sections):
    return "".join(f"{json.dumps(key)} = {to_toml(value)}\n" for key, value in sections.items())


def merged(content, more):
    """The content with keys that it lacks."""
    both = dict(content)
    for key, value in more.items():
        both[key] = merged(both[key], value) if isinstance(both.get(key), dict) and isinstance(value, dict) else value
    return both


def places(value, path=()):
    """The paths of all values in a value; of a list the first and the last item."""
    if path:
        yield path
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, item in items:
        if not isinstance(value, list) or key in (0, len(value) - 1):
            yield from places(item, (*path, key))


def replaced(value, path, new):
    """The value with another one at a path."""
    if not path:
        return Raw(new)
    copy = value.copy()
    copy[path[0]] = replaced(value[path[0]], path[1:], new)
    return copy


def bases():
    """Files to change, by name: their kind and content."""
    for name, mechanism in MECHANISMS.items():
        content = tomllib.loads(starter(mechanism))
        yield name, "study", content
        for more in ("study", "path target", "poses target", "function target"):
            yield f"{name}, {more}", "study", merged(content, tomllib.loads(MORE[more]))
    for name in TASK_TYPES:
        content = tomllib.loads(task_starter(name))
        yield name, "task", content
        for more in (name, "any task"):
            yield f"{name}, {more} keys", "task", merged(content, tomllib.loads(MORE.get(more, "")))


BASES = {name: (kind, content) for name, kind, content in bases()}
LINE = re.compile(r"file\.toml(:\d+)?: |designs\.csv|file\.toml: and \d+ more")


def trials(kind, count, seed):
    """So many different files with one value replaced, drawn with a seed; all for None. With what is where."""
    found = [
        (name, path, new) for name, (own, content) in BASES.items() if own == kind
        for path in places(content) for new in VALUES
    ]  # fmt: skip
    for name, path, new in found if count is None else random.Random(seed).sample(found, count):
        yield f"{name}: {path} = {new[:40]}", document(replaced(BASES[name][1], path, new))


def check(kind, text, folder):
    """Read a file, which is accepted or refused with the place of each problem; returns whether it is refused."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DoubtfulInputWarning)
            parse_study(text, "file.toml", folder) if kind == "study" else parse_task(text, "file.toml", folder)
    except ConfigError as error:
        lines = error.problems
    else:
        return False
    assert lines
    for line in lines:
        assert LINE.match(line), line
        assert line.isprintable(), line
        assert len(line) < 2000, line
    return True


def check_all(kind, count, seed, folder):
    """Check files; returns how many are refused."""
    (folder / "p.csv").write_text("x,y\n0,0\n1,1\n2,0\n")
    refused = 0
    for what, text in trials(kind, count, seed):
        try:
            refused += check(kind, text, folder)
        except Exception as error:
            pytest.fail(f"{what}: {error!r}")
    return refused


@pytest.mark.parametrize(("count", "least"), [(100, 50), pytest.param(None, 1000, marks=pytest.mark.slow)])
@pytest.mark.parametrize("kind", ["study", "task"])
def test_wrong_types(kind, count, least, tmp_path):
    assert check_all(kind, count, 20261123, tmp_path) > least  # some values are of the right type


@pytest.mark.parametrize("new", VALUES)
def test_the_type_of_a_file(new):
    """The keys that say what a file is, at its beginning, through all that reads one."""
    for text in (f"task = {new}\n", f"mechanism = {new}\n", f"refine = {new}\n"):
        for kind in ("study", "task"):
            assert check(kind, text, Path())
        with pytest.raises((ConfigError, RequestError)):
            read_job_file("job", text.encode()).plan(Path("none"))


def test_commands_refuse_wrong_types_in_one_line_each(tmp_path):
    with contextlib.chdir(tmp_path):
        for kind, command in (("study", "sweep"), ("task", "synthesize")):
            for what, text in trials(kind, 12, 7):
                if not check(kind, text, tmp_path):
                    continue  # a dry run would measure it
                Path("file.toml").write_text(text, encoding="utf-8")
                code, out, err = call(command, "file.toml", "--dry-run")
                assert (code, out) == (2, ""), what
                assert err.startswith("error: file.toml"), err
                assert "internal" not in err


@pytest.fixture(scope="module")
def post(tmp_path_factory):
    """Asks the application in this process, which runs no job."""
    folder = Folder(tmp_path_factory.mktemp("service") / "served")
    with folder.locked():
        station = SimpleNamespace(folder=folder, jobs=Jobs(folder, Limits(queue=10**6), lambda *_: None), workers=1)
        application = make_application(station, Access("http://here"), lambda: False)

        async def post(route, **content):
            transport = httpx.ASGITransport(application, raise_app_exceptions=False)
            async with httpx.AsyncClient(transport=transport, base_url="http://here") as asking:
                return await asking.post(route, **content)

        yield lambda route, **content: asyncio.run(post(route, **content))


def test_the_service_refuses_wrong_types(post):
    """Files and the bodies around them: created, or refused with a reason; never an error of the service."""
    number = itertools.count()
    for kind, route in (("study", "/api/studies"), ("task", "/api/tasks")):
        files = [(f"task = {new}", f"task = {new}\n") for new in VALUES] + list(trials(kind, 20, 3))
        for what, text in files:
            answer = post(route, json={"name": f"job-{next(number)}", kind: text})
            assert answer.status_code in (201, 400, 422), (what, answer.text)
            assert answer.status_code == 201 or answer.json()["detail"]
    text = task_starter("dead-positions")
    bodies = [
        ("/api/tasks", {"name": "n", "task": text, "priority": 5}),
        ("/api/studies", {"name": "n", "study": starter(MECHANISMS["crank-rocker"]), "keep": "all", "priority": 5}),
        ("/api/refinements", {"name": "n", "refine": "job", "metric": ["cv"], "evaluations": 10, "seed": 1}),
        ("/api/jobs/none/priority", {"priority": 5}),
    ]
    values = [[], {}, "", 0, -1, True, [[1, [2]], []], "x" * 100_000, None, 1.5, 10**400, "1979-05-27", [{}]]
    for route, body in bodies:
        for key, value in itertools.product(body, values):
            answer = post(route, json={**body, "name": f"job-{next(number)}", key: value})
            assert answer.status_code in (201, 400, 404, 409, 422), (route, key, str(value)[:40], answer.text)
            assert answer.status_code == 201 or answer.json()["detail"]
        for value in values:
            assert post(route, json=value).status_code == 422
        assert post(route, content=b'{"priority": NaN}').status_code == 422
