"""Files that are not TOML or cannot be read, lines of keys, and mutated studies."""

import random
import re
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from studies import GOOD

from explore.base.errors import ConfigError
from explore.studies.config.key_lines import line_of, locate
from explore.studies.config.study_file import load_study

CONFIGS = Path(__file__).parent.parent / "configs"


# Invalid files


@pytest.mark.parametrize(
    ("line", "number", "hint"),
    [
        ("speed = 60 rpm", 7, '"60 rpm"'),
        ("phases = three", 7, "write a string in quotes"),
        ("speed = 5,5", 7, "write decimals with a point"),
        ("speed: 5", 7, "with =, not with a colon"),
        ("speed = [1,\n 2", 8, "Unclosed array"),
        ("crank = 5", 7, "a key occurs twice"),
        ("[parameters]", 7, "not TOML"),
        ("speed = { start = 1,\n stop = 2, num = 3 }", 7, "write a table in { } on one line"),
        pytest.param("speed = " + "9" * 5000, 7, "Exceeds the limit (4300 digits)", id="digits"),
    ],
)
def test_toml_syntax(problems, line, number, hint):
    (problem,) = problems(GOOD + line)
    assert problem.startswith(f"study.toml:{number}: not TOML: ")
    assert hint in problem


def test_unreadable_files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("folder").mkdir()
    Path("latin").write_bytes("é".encode("latin-1"))
    Path("results.h5").write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(1 << 22))  # larger than any study file
    for name, reason in {
        "results.h5": "holds results, not a study; give the study, a .toml file",
        "./none.toml": "no such file; `explore init` writes one to start from",
        "folder": "is a folder, not a study file",
        "latin": "is not UTF-8 text (byte 0); save it as UTF-8",
    }.items():
        with pytest.raises(ConfigError) as caught:
            load_study(name)
        assert caught.value.problems == [f"{name}: {reason}"]
    with pytest.raises(ConfigError, match="is not a valid file name"):
        load_study("a\0b")


def test_forbidden_file(unprivileged):
    folder, lower = unprivileged
    file = folder / "study.toml"
    file.write_text(GOOD)
    file.chmod(0)
    lower()
    with pytest.raises(ConfigError, match="cannot be read: Permission denied"):
        load_study(file)


def test_path_is_printed_as_given(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("a").mkdir()
    Path("a/x.toml").write_text("x = 1\n")
    with pytest.raises(ConfigError) as caught:
        load_study(Path("a") / "x.toml")
    assert caught.value.problems[0].startswith("a/x.toml:1: ")


# Lines of keys


def test_locate():
    text = '''\
# [no] = 1
top.sub."a.b" = """
x = 1 \\"""" # quotes"""
'lit eral' = \'\'\'
# no''\'\'\'
[one.two] # comment
list = [ # one
  1, "a,]#\\"", # two
  { x = [1,
    2], 'y' = '#' },
]
date = 1979-05-27 07:32:00
[[many]]
a = 1
[[many]]
b = 2
'''
    lines = locate(text.replace('\\"""" # quotes"""', '\\"""" # quotes'))
    assert lines[("top", "sub", "a.b")] == 2
    assert lines[("lit eral",)] == 4
    assert lines[("one", "two")] == 6
    assert lines[("one", "two", "list", 1)] == 8
    assert lines[("one", "two", "list", 2, "x", 1)] == 10
    assert lines[("one", "two", "list", 2, "y")] == 10
    assert lines[("one", "two", "date")] == 12
    assert lines[("many",)] == 13
    assert lines[("many", "b")] == 16
    assert line_of(lines, ("one", "two", "list", 7)) == 7
    assert line_of(lines, ("nowhere",)) == 1


# Mutated studies


TEXTS = [GOOD, *(path.read_text(encoding="utf-8") for path in sorted(CONFIGS.rglob("*.toml")))]
SNIPPETS = [
    "",
    "nan",
    "-1",
    "[]",
    "{}",
    "[[",
    '"',
    "'''",
    "=",
    ".",
    "\n",
    "\x00",
    "é",
    '"60 rpm"',
    "1e999",
    "true",
    "#",
]


def mutated(text, seed):
    """The text with a few pieces removed, doubled, moved or replaced."""
    choose = random.Random(seed)
    for _ in range(choose.randint(1, 6)):
        pieces = re.split(r"(\s+|[=\[\]{},.\"])", text)
        at, other = choose.randrange(len(pieces)), choose.randrange(len(pieces))
        pieces[at] = choose.choice([*SNIPPETS, pieces[other], pieces[at] * 2, pieces[at][::-1], pieces[at][:-1]])
        text = "".join(pieces)
    return text


@settings(max_examples=300, derandomize=True, database=None, deadline=None, suppress_health_check=list(HealthCheck))
@given(st.sampled_from(TEXTS), st.integers(0, 2**32))
def test_only_config_errors_come_out(tmp_path_factory, text, seed):
    file = tmp_path_factory.getbasetemp() / "fuzz.toml"
    file.write_bytes(mutated(text, seed).encode())
    reported = []
    try:
        load_study(file)
    except ConfigError as error:
        reported = error.problems
    assert all(problem.startswith(f"{file}:") and "\n" not in problem for problem in reported)
