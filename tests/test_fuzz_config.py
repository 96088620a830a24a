"""Mutated studies: each is planned, or refused with the file and line of each problem."""

import contextlib
import re
import resource
import tomllib
from pathlib import Path

import pytest
from changed_trees import change, text_of
from command_line import call
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from explore.base.errors import ConfigError
from explore.comparison.scenes import load_scene
from explore.mechanisms.registry import MECHANISMS
from explore.studies.config.study_file import starter

CONFIGS = Path(__file__).parent.parent / "configs"
STUDIES = [path.read_text(encoding="utf-8") for path in sorted(CONFIGS.rglob("*.toml"))]
STUDIES += [starter(mechanism) for mechanism in MECHANISMS.values()]
STUDIES.append(f"""{starter(MECHANISMS["crank-rocker"])}
[metrics]
reach = {{ formula = "coupler + ground - min(crank, rocker)**2 / 100", unit = "mm" }}
chord = {{ formula = "2 * rocker * sin(swing_angle / 2) + reach", unit = "mm" }}
""")
TOKEN = re.compile(r'"[^"\n]*"|#[^\n]*|[\w.+-]+|\s+|.', re.DOTALL)
#: Memory that planning any study may take beyond what the packages do, bytes.
MEMORY = 1 << 30

VALUES = [
    "nan", "-nan", "inf", "-inf", "1e400", "-1e400", "5e-324", "1e308", "-1", "0", "-0.0", "1", "2", "9" * 400,
    "9" * 5000, "9223372036854775807", "9223372036854775808", "9007199254740993", "1073741825", "0x7fffffffffffffff",
    "0o17", "0b1", "1_000", "1e-9", "1979-05-27", "1979-05-27T07:32:00Z", "07:32:00", "true", "false", '""', '" "',
    '"1"', '"nan"', '"nan mm"', '"inf rad/s"', '"1e400 mm"', '"1e308 km"', '"60 rpm"', '"60 rpmm"', '"1 mm mm"',
    '"1/0 mm"', '"1**1e9 mm"', '"10**10**10 mm"', '"9**9**9**9 mm"', '"mm"', '"__import__(\'os\')"', '"[1] mm"',
    '"ω"', '"\\u0000"', '"\\u001b[31m"', '"a\\nb"', "'''a\nb'''", '"' + "x" * 3000 + '"', '"cv:max:min"', '"cv:"',
    '":"', '"cv"', '"swing_angle"', '"crank"', '"sobol"', '"grid"', '"table"', '"clutch"', '"cycle"', "[]", "[[]]",
    "{}", "[1, 1]", "[1, 'a']", "[nan]", "[1e400]", "[true]", "{ start = 1, stop = 2, num = 3 }",
    "{ start = 1, stop = 2, num = 9007199254740992 }", "{ start = 1, stop = 1.0000000000000002, num = 1000 }",
    "{ start = 1e-300, stop = 1e300, num = 7 }", "{ min = 1, max = 2 }", "{ min = 1, max = 2, log = true }",
    "{ min = 5e-324, max = 1e308, log = true }", "{ min = 1 }", "{ from = 0, to = 90 }", "{ from = 90, to = 0 }",
    "{ from = -1e300, to = 1e300 }", "{ a = { b = { c = 1 } } }", "[" * 300 + "]" * 300,
    '{ solve = "swing_angle", value = 20 }', '{ solve = "time_ratio", value = 1e300 }', '{ solve = "swing_angle" }',
    '{ formula = "crank", unit = "mm" }', '"reach"', '"chord + 1"', '"("', '"1 / 0 + crank"', '"9**9**9**9 * crank"',
    '"__import__(\'os\')"', '"' + "(" * 400 + '"', '"' + "-" * 900 + 'crank"', '"lambda: 0"', '"sin(pi)"', '"N m"',
    '{ solve = "grashof_margin", value = 1, min = 5e-324, max = 1e308 }', '{ solve = "cv", value = nan }',
]  # fmt: skip
PIECES = ["=", "[", "]", "[[", "{", "}", ",", ".", "#", '"', "'", '"""', "\\", "\n", "\r", "\r\n", "\t", "\0", "\ufeff",
          "é", "\u2028", "\U0001f600", "\u202e", "\x7f", "\x85", "[a.b.c]\n", "[parameters]\n", "[parameters.crank]\n",
          "[[constraints]]\n", "x = 1\n", "'a b' = 1\n", '"" = 1\n', "a.b = 1\n", '"\\n" = 1\n']  # fmt: skip


@st.composite
def mutated_texts(draw):
    """One of the studies with a few of its words removed, doubled, moved or replaced."""
    words = TOKEN.findall(draw(st.sampled_from(STUDIES)))
    for _ in range(draw(st.integers(1, 6))):
        at = draw(st.integers(0, len(words) - 1))
        change = draw(st.sampled_from(["value", "delete", "double", "swap", "insert", "letter", "text", "cut"]))
        if change == "value":
            places = [k for k, word in enumerate(words) if re.match(r'[\d"+-]', word)] or [at]
            words[draw(st.sampled_from(places))] = draw(st.sampled_from(VALUES))
        elif change == "delete":
            del words[at : at + draw(st.integers(1, 5))]
        elif change == "double":
            words[at:at] = words[at : at + draw(st.integers(1, 30))]
        elif change == "swap":
            other = draw(st.integers(0, len(words) - 1))
            words[at], words[other] = words[other], words[at]
        elif change == "insert":
            words.insert(at, draw(st.sampled_from(PIECES + VALUES)))
        elif change == "letter":
            cut = draw(st.integers(0, len(words[at])))
            words[at] = words[at][:cut] + draw(st.sampled_from("aeX_1-. ω\n")) + words[at][cut + 1 :]
        elif change == "text":
            words.insert(at, draw(st.text(max_size=20)))
        else:
            del words[at:]
        words = words or ["\n"]
    return "".join(words)


KEYS = st.sampled_from([
    "crank", "crnak", "speed", "phases", "branch", "start", "stop", "num", "min", "max", "log", "from", "to", "method",
    "count", "seed", "file", "metrics", "window", "drive", "tolerance", "cv", "swing_angle", "rocker_velocity_mean",
    "rank", "sampling", "evaluate", "formula", "unit", "reach", "chord", "sqrt", "constraints",
    "parameters", "mechanism", "", "a b", "ω", "x" * 200, "a\nb",
])  # fmt: skip
SCALARS = st.one_of(
    st.floats(), st.floats(1, 1000), st.integers(-3, 10), st.integers(-(2**70), 2**70), st.booleans(),
    st.text(max_size=8),
    st.sampled_from(["cv", "swing_angle:max", "grid", "sobol", "drive", "clutch", "slow", "60 rpm", "1 mm", "nan mm"]),
    st.dates(), st.times(), st.datetimes(),
)  # fmt: skip
TREES = st.recursive(SCALARS, lambda inner: st.lists(inner, max_size=4) | st.dictionaries(KEYS, inner, max_size=4))


@st.composite
def mutated_trees(draw):
    """One of the studies with a few of its values, at any depth, replaced, removed or given another key."""
    return text_of(change(draw, tomllib.loads(draw(st.sampled_from(STUDIES))), KEYS, TREES, most=3))


@contextlib.contextmanager
def little_memory():
    """Refuse this process more than MEMORY beyond what it holds already."""
    held = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (held + MEMORY, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("fuzz")
    for number, text in enumerate(STUDIES):  # imports and compiles what the first plans need
        (folder / f"{number}.toml").write_text(text, encoding="utf-8")
        assert call("sweep", folder / f"{number}.toml", "--dry-run")[0] == 0
        if not is_scene(str(folder / f"{number}.toml")):
            call("precision", folder / f"{number}.toml")
        (folder / f"{number}.toml").unlink()
    return folder


def is_scene(file):
    """Whether `explore precision` would compare methods on it."""
    try:
        load_scene(file)
    except ConfigError:
        return False
    return True


def assert_planned_or_refused(folder, text):
    """A plan, or a line for each mistake that begins with the file and a line of it; nothing written, nothing odd."""
    study = folder / "study.toml"
    study.write_text(text, encoding="utf-8", errors="surrogatepass", newline="")
    with contextlib.chdir(folder), little_memory():
        code, out, err = call("sweep", "study.toml", "--dry-run")
        others = [
            call(*command) for command in (["simulate", "study.toml", "--angles", "4"], ["coverage", "study.toml"])
        ]
        if not is_scene("study.toml"):
            others.append(call("precision", "study.toml"))
            assert others[-1][0] == 2, "others are compared for minutes"
    assert [path.name for path in folder.iterdir()] == ["study.toml"]
    for exit_code, _, message in [(code, out, err), *others]:
        assert "Traceback" not in message
        assert "internal error" not in message
        assert exit_code in (0, 1, 2)
        assert exit_code == 0 or message.startswith(("error: ", "design ", "coverage ignores")), message
    if code == 0:
        assert re.match(r"[\d,]+ designs \((grid|sobol)\) in [\d,]+ blocks?, \d+ columns, [\d,.]+ [MGT]B", err), err
        assert "first and last designs" in out
        return
    assert code == 2, err
    assert out == ""
    assert {message for _, _, message in others} == {err}
    lines = err.removeprefix("error: ").splitlines()
    assert lines
    for line in lines:
        place = re.match(r"study\.toml:(\d+): \S", line)
        unreadable = re.match(r"study\.toml: (is not UTF-8 text|and [\d,]+ more$)", line)
        assert place or unreadable, err
        # A key may be missing on the empty line after the last line break.
        assert not place or 1 <= int(place[1]) <= text.count("\n") + 1


@pytest.mark.parametrize("examples", [25, pytest.param(2_500, marks=pytest.mark.slow)])
@pytest.mark.parametrize("texts", [mutated_texts, mutated_trees])
def test_words_or_values_out_of_place(folder, texts, examples):
    # Examples of the same seed on every run; the generators make texts of several kB.
    @settings(derandomize=True, deadline=None, max_examples=examples,
              suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])  # fmt: skip
    @given(text=texts())
    def check(text):
        assert_planned_or_refused(folder, text)

    check()
