"""Small files that could take much time or memory: each is read or refused within 2 GB and 20 s on two cores."""

import os
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
from changed_trees import text_of
from command_line import assert_refused, call
from damage_worker import Worker
from store_files import N_BLOCKS, fill, still_pending, unseal, values, writer
from studies import FEW, GOOD, swept
from waiting import PATIENCE

import explore
from explore.base.errors import ResultsError
from explore.results.store.open_results import open_results
from explore.studies.config.key_lines import MOST_NESTED, MOST_PARTS, find_excess_depth

#: A little fewer letters than a study file may have.
FULL = (1 << 21) - 200
TABLE = 'mechanism = "crank-rocker"\n[sampling]\nmethod = "table"\nfile = "designs.csv"\n'
HEADER = "crank,coupler,rocker,ground\n"


@pytest.fixture(scope="module")
def worker():
    worker = Worker()
    worker.run(["mechanisms"])  # start the process and import the package
    yield worker
    worker.close()


def study_with_list(values, key="crank = 100"):
    return GOOD.replace(key, f"{key.partition(' ')[0]} = [{', '.join(values)}]")


STUDIES = {
    "a dotted key of 40 kB": ("a." * 20_000 + "b = 1\n", ":1: a key of more than 16 parts"),
    "a dotted table of 200 kB": (f"{GOOD}[{'a.' * 100_000}b]\n", ":7: a key of more than 16 parts"),
    "a dotted key in a table on one line": (f"x = {{ {'a . ' * 20_000}b = 1 }}\n", ":1: a key of more than 16 parts"),
    "quoted parts": ('"a#".' * 20_000 + "b = 1\n", ":1: a key of more than 16 parts"),
    "lists in lists": ("x = " + "[" * 100_000 + "]" * 100_000, ":1: more than 16 nested tables or lists"),
    "tables in tables": ("x = " + "{a=" * 9_000 + "1" + "}" * 9_000, ":1: more than 16 nested tables or lists"),
    "many keys of many parts": ("\n".join(f"{'a.' * 15}b{i} = 1" for i in range(50_000)), ":1: a: unknown key"),
    "many items at some depth": (f"x = {'[' * 15}{'1,' * (FULL // 2)}{']' * 15}", ":1: x: unknown key"),
    "many tables of the same name": (GOOD + "[[x]]\n" * (FULL // 6), ":7: x: unknown key"),
    "a key of 2 MB": ("a" * FULL + " = 1\n", ":1: " + "a" * 59 + "…: unknown key; available:"),
    "a text of 2 MB": (f'mechanism = "{"x" * FULL}"\n', ":1: mechanism: unknown mechanism 'xxx"),
    "a text of escapes": ('mechanism = "' + "\\u0041" * (FULL // 6) + '"\n', ":1: mechanism: unknown"),
    "texts that do not end": ('\\"""\n' * (FULL // 5), ":1: not TOML"),
    "a text that does not end": ('x = "' + '\\"' * (FULL // 2), ":1: not TOML"),
    "an integer of 2 MB": ("x = " + "9" * FULL, ":1: not TOML"),
    "a line of brackets": ("a = x" + "{" * (FULL - 9) + "}", ":1: more than 16 nested tables"),
    "a line of words in brackets": ("a = x" + "{ x }" * (FULL // 5) + "}", ":1: not TOML"),
    "100,000 values": (study_with_list(f"{1 + i / 1000}" for i in range(100_000)), ""),
    "100,000 texts with units": (study_with_list(f'"{1 + i / 1000} mm"' for i in range(100_000)), ""),
    "100,000 values that are wrong": (study_with_list(f"-{i}" for i in range(100_000)), ": and 99,980 more"),
    "100,000 metrics": (
        f"{GOOD}[evaluate]\nmetrics = {[f'x{i}' for i in range(100_000)]}",
        ":8: evaluate.metrics: must have at most 1,000 entries",
    ),
    "1,000 metrics": (f"{GOOD}[evaluate]\nmetrics = {[f'swing_{i}' for i in range(1000)]}", ": and 980 more"),
    "100,000 parameters": (GOOD + "\n".join(f"x{i} = 1" for i in range(100_000)), ": must have at most 1,000 entries"),
    "100,000 unknown tables": (GOOD + "\n".join(f"[t{i}]" for i in range(100_000)), ": and 99,980 more"),
    "100,000 unknown keys of a table": (
        study_with_list(()).replace("[]", "{ start = 1, " + ", ".join(f"sto{i} = 1" for i in range(100_000)) + " }"),
        ": and 99,98",
    ),
}  # fmt: skip


#: Those that take several seconds each.
LONG = {
    "many keys of many parts", "many items at some depth", "many tables of the same name", "100,000 texts with units",
    "100,000 metrics", "100,000 unknown keys of a table",
}  # fmt: skip


@pytest.mark.parametrize("name", [pytest.param(name, marks=[pytest.mark.slow] * (name in LONG)) for name in STUDIES])
def test_studies(worker, tmp_path, name):
    """In a process that has 3 GB of address space, 1 GB of it for the packages."""
    text, message = STUDIES[name]
    study = tmp_path / "study.toml"
    study.write_text(text, encoding="utf-8")
    (reply,) = worker.run(["sweep", str(study), "--dry-run"])
    if message:
        assert reply["code"] == 2, reply["err"]
        assert f"{study}{message}" in reply["err"] or message in reply["err"]
        assert len(reply["err"]) < 8000
        assert reply["err"].count("\n") <= 22
    else:
        assert reply["code"] == 0, reply["err"]


def test_depth_counts_no_texts_comments_or_numbers():
    """Points and brackets within texts, comments and numbers do not nest keys."""
    dots = "a." * 50
    for text in (
        f"# {dots} [[[[[[[[[[[[[[[[[[[[\nx = 1\n",
        f"x = \"{dots}\"\ny = '{dots}'\n",
        f'x = """\n{dots}\\"""{dots}""{dots}"""""\n',
        f"x = '''\n{dots}''{dots}'\n{'[' * 50}'''''\n",
        f'"{dots}"."{dots}" = 1\n',
        f"x = [{'1.5, ' * 50}]\n",
        f"x = [{'1.5,  # one' * 50}\n]\n",
        "x.y = 1.5\n" * 50,
        ".".join(["a"] * MOST_PARTS) + " = 1.5\n",
        f"x = {'[' * MOST_NESTED}{']' * MOST_NESTED}\n" * 2,
    ):
        assert find_excess_depth(text) is None, text
    for text in (
        "x = 1\n" + ".".join(["a"] * (MOST_PARTS + 1)) + " = 1\n",
        '# "\n[' + " . ".join(['"a.b"'] * (MOST_PARTS + 1)) + "]\n",
        f'x = \'"""\'\ny = {"[" * (MOST_NESTED + 1)}',
        f'x = "\\\\"\ny = {"{a=" * (MOST_NESTED + 1)}',
    ):
        assert find_excess_depth(text)[0] == 2, text


TABLES = {
    "100,000 names": (",".join(f"n{i}" for i in range(100_000)) + "\n", ":1: has 100,000 columns"),
    "1,000 names": (",".join(f"n{i}" for i in range(1000)) + "\n", ": and "),
    "15 MB of commas": ("," * 15_000_000, "line 1 has more than 1,048,576 characters"),
    "a cell of 15 MB": (HEADER + "1" * 15_000_000, "line 2 has more than 1,048,576 characters"),
    "15 MB in quotation marks": (HEADER + '"' + "1\n" * 7_500_000, "not CSV: field larger than field limit"),
    "a row of 500,000 cells": (HEADER + "1," * 500_000, ":2: has 500001 cells, but the header has 4"),
}


@pytest.mark.parametrize("name", TABLES)
def test_tables(worker, tmp_path, name):
    content, message = TABLES[name]
    (tmp_path / "designs.csv").write_text(content)
    (tmp_path / "study.toml").write_text(TABLE)
    (reply,) = worker.run(["sweep", str(tmp_path / "study.toml"), "--dry-run"])
    assert (reply["code"], reply["out"]) == (2, "")
    assert message in reply["err"]
    assert len(reply["err"]) < 8000


def test_a_huge_table_is_not_read_into_memory(worker, tmp_path):
    with (tmp_path / "designs.csv").open("wb") as file:
        file.truncate(1 << 40)
    (tmp_path / "study.toml").write_text(TABLE)
    (reply,) = worker.run(["sweep", str(tmp_path / "study.toml"), "--dry-run"])
    assert "line 1 has more than 1,048,576 characters" in reply["err"]


GROUND = "ground = [691.7118, 720]"


@pytest.mark.parametrize(("command", "old", "new", "message"), [
    ("coverage", GROUND, "ground = { start = 1, stop = 2, num = 9007199254740992 }", "of ground, got 9,007,199,"),
    ("coverage", "crank = [80", "crank = { start = 1, stop = 2, num = 99999999999 } # [", "of crank, got 99,999,999,"),
    ("precision", GROUND, "ground = { start = 1, stop = 2, num = 99999999999 }", "scene of 399,999,999,996 designs"),
])  # fmt: skip
def test_studies_of_too_many_designs(tmp_path, command, old, new, message):
    study = tmp_path / "study.toml"
    scene = '[scene]\ntitle = "a"\nabout = "a"\nmodel = "geometry"\nquestion = "a"\n'
    study.write_text(FEW.replace(old, new) + (scene if command == "precision" else ""))
    assert_refused(call(command, study), 2, message)


#: CPU seconds and additional MB of the first use of a Jansen leg and of the largest table, all translated anew.
COSTS = """
import resource, sys, tomllib
import explore
from explore.studies.config.study_file import linkage_starter

def use(study, default):
    linkage = explore.Linkage(study)
    values = {k: v["min"] if isinstance(v, dict) else v for k, v in study["parameters"].items()}
    before = resource.getrusage(resource.RUSAGE_SELF)
    maxima = [f"{each.name}_max" for each in linkage.mechanism.signals if "max" in each.statistics]
    explore.evaluate(linkage, values, metrics=None if default else maxima)
    after = resource.getrusage(resource.RUSAGE_SELF)
    print(after.ru_utime - before.ru_utime, (after.ru_maxrss - before.ru_maxrss) / 1024)

use(tomllib.loads(linkage_starter("four-bar")), False)
use(tomllib.loads(linkage_starter("jansen")), True)
use(tomllib.loads(sys.argv[1]), False)
"""


def chain_of(part, count):
    """A table of dyads, of bars or of levers with a slot that has friction, and loads on each part."""
    joints = [f"J{k}" for k in range(count)]
    before = ["A", *joints]
    frame = {"O": [0, 0]} | {f"G{k}": [150 - 50 * k, 20 - 40 * (k % 2)] for k in range(count)}
    links = {"crank": {"O": 0, "A": "r"}} | {f"b{k}": {f"G{k}": 0, joint: 90} for k, joint in enumerate(joints)}
    table = {"driver": "crank", "frame": frame, "links": links}
    if part == "bars":
        links |= {f"a{k}": {before[k]: 0, joint: 100} for k, joint in enumerate(joints)}
        table["branch"] = {joint: f"left of {before[k]} G{k}" for k, joint in enumerate(joints)}
    else:
        slots = {f"s{k}": {"pin": before[k], "link": f"b{k}", "along": [[0, 3], [1, 3]]} for k in range(count)}
        table["slots"] = slots
    table["loads"] = {
        "gravity": [0, -9.81],
        "masses": {link: {"mass": 1.5, "centroid": [20, 3], "inertia": 0.01} for link in links},
        "forces": {joint: [10, -3] for joint in joints},
        "dampers": {f"d{k}": {"between": f"b{k}", "rate": 0.3} for k in range(count)},
    } | ({} if part == "bars" else {"friction": dict.fromkeys(table["slots"], 0.1)})
    return {"linkage": table, "parameters": {"r": 10.0}}


@pytest.mark.parametrize("part", ["bars", "levers"])
def test_the_largest_table_with_loads_costs_seconds(tmp_path, part):
    """All maxima of its signals: no more than 500 MB, and some times the time of a small table's default metrics."""
    with pytest.raises(explore.ConfigError, match="has 27 links, slots and slides and loads; at most 26 are possible"):
        explore.Linkage(chain_of(part, 13))
    done = subprocess.run(
        [sys.executable, "-c", COSTS, text_of(chain_of(part, 12))],
        env=os.environ | {"XDG_CACHE_HOME": str(tmp_path)}, capture_output=True, text=True, timeout=PATIENCE,
        check=True,
    )  # fmt: skip
    _, (small, _), (largest, memory) = (map(float, line.split()) for line in done.stdout.splitlines())
    assert memory < 500
    # 8 times as many lines for LLVM, whose time with all effort would be 40 times that of the small one
    assert largest < 15 * small


# --- sparse results files ---------------------------------------------------------------------------------------------
sound = swept(FEW, "sound", give=lambda results: results.path)


def stretched(sound, path, n_designs, words, block_size=65_536, **attributes):
    """A copy of the sound file with sparse columns of `n_designs` rows and these commit words."""
    with h5py.File(sound) as file, h5py.File(path, "w", libver="latest") as other:
        for name, value in {**file.attrs, **attributes, "n_designs": n_designs, "block_size": block_size}.items():
            other.attrs[name] = value
        n_blocks = -(-n_designs // block_size)
        holes = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        holes.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
        holes.set_fill_time(h5py.h5d.FILL_TIME_NEVER)
        unseal(other)
        for name, dataset in file["designs"].items():
            column = other.require_group("designs").create_dataset(name, (n_designs,), dataset.dtype, dcpl=holes)
            for key, value in dataset.attrs.items():
                column.attrs[key] = value
        file.copy("frame/axis0", other.require_group("frame"))
        commit = other.require_group("progress").create_dataset("commit", (n_blocks,), "<u8", dcpl=holes)
        if len(words):
            commit[: len(words)] = words
    return path


READERS = (
    ["show"], ["show", "--json"], ["show", "--design", "3"], ["rank"], ["report"], ["verify"], ["pack"],
    *(["plot", kind] for kind in ("pareto", "map", "parallel", "motion", "mechanism", "ratio")),
)  # fmt: skip

KEPT = {"keep": "front", "studied_designs": 2**40, "studied_counts": "{}"}
CLAIMS = {
    "2^33 rows, none done": (2**33, 0, 65_536, {}),
    "2^33 rows, 3,000 blocks done": (2**33, 3000, 65_536, {}),
    "2^33 rows in one block": (2**33, 1, 2**33, {}),
    "2^33 blocks": (2**33, 0, 1, {}),
    "2^28 rows, all kept": (2**28, 4096, 65_536, KEPT),
    "2^33 rows kept, none done": (2**33, 0, 65_536, KEPT),
}  # fmt: skip


@pytest.mark.parametrize("name", CLAIMS)
def test_rows_that_take_no_space_cost_none(worker, sound, tmp_path, name):
    n_designs, done, block_size, attributes = CLAIMS[name]
    words = np.full(done, 2**32 + 7, "<u8")
    path = stretched(sound, tmp_path / "sparse.h5", n_designs, words, block_size, **attributes)
    assert path.stat().st_size > 2**33
    assert path.stat().st_blocks * 512 < 200_000
    commands = [[command, *rest[:1], str(path), *rest[1:]] if command == "plot" else [command, str(path), *rest]
                for command, *rest in READERS]  # fmt: skip
    study = str(sound.parent / "study.toml")
    for command in [*commands, ["sweep", study, "-o", str(path)]]:
        (reply,) = worker.run(command)
        assert "should not have happened" not in reply["err"], command
        assert "memory" not in reply["err"], command
        assert reply["code"] in (0, 1, 2), command
        if done and command[0] not in ("show", "sweep"):
            assert reply["code"] == 1, (command, reply["err"])
    if done:
        with pytest.raises(ResultsError, match="damaged"):
            open_results(path).to_pandas()


def test_a_sparse_copy_of_an_unfinished_file_is_as_good(tmp_path):
    """Rows that are not written yet take no space in a copy made by ``cp --sparse=always``."""
    path = fill(tmp_path / "half.h5", [0, 3])
    with path.open("r+b") as file:
        content = path.read_bytes()
        file.truncate(0)
        for start in range(0, len(content), 4096):
            page = content[start : start + 4096]
            if page.strip(b"\0"):
                file.seek(start)
                file.write(page)
        file.truncate(len(content))
    assert path.stat().st_blocks * 512 < len(content)
    results = open_results(path)
    assert results.n_committed == 2000
    assert results.verify() == []
    assert len(results.to_pandas()) == 2000
    assert still_pending(path) == [number for number in range(N_BLOCKS) if number not in (0, 3)]
    with writer(path) as store:
        for number in store.pending:
            store.commit(number, values(number))
    assert open_results(path).is_complete


# --- pipes ------------------------------------------------------------------------------------------------------------


def test_pipes_are_refused_at_once(tmp_path, monkeypatch):
    """Commands that read a study, or the table that a study names; reading these pipes would block."""
    monkeypatch.chdir(tmp_path)
    os.mkfifo("pipe.toml")
    os.mkfifo("designs.csv")
    Path("study.toml").write_text(TABLE)
    for command in (["sweep"], ["sweep", "--keep", "front"], ["simulate"], ["coverage"], ["precision"]):
        for study, message in (("pipe.toml", "is a pipe or a device"), ("study.toml", "is not a regular file")):
            assert_refused(call(command[0], study, *command[1:]), 2, message)
    assert sorted(path.name for path in Path().iterdir()) == ["designs.csv", "pipe.toml", "study.toml"]
