"""Randomly damaged results files: each is read, refused with an error or computed again; no command crashes."""

import re
from pathlib import Path

import h5py
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from store_files import unseal

STUDY = """mechanism = "crank-rocker"
[parameters]
crank = { start = 60, stop = 140, num = 9 }
coupler = 1083.4236
rocker = 541.7118
ground = [691.7118, 700]
speed = [4.2735, 5.9829]
[evaluate]
metrics = ["linkage_class", "swing_angle", "cv", "rocker_acceleration_max"]
[constraints]
swing_angle = { min = 10 }
[rank]
metrics = ["cv", "rocker_acceleration_max:min"]
"""
#: Bytes at which a number, an address or a length is likely to mean something else.
BYTES = st.one_of(st.integers(0, 255), st.sampled_from([0, 1, 2, 8, 127, 128, 254, 255]))


class Sound:
    """A finished sweep of 36 designs, and the offsets of HDF5's structures and of the values in its file."""

    # Not a dataclass, because Hypothesis would print all its bytes at a failure.
    def __init__(self, folder: Path, whole: bytes, metadata: list[int], values: list[int]):
        self.folder, self.whole, self.metadata, self.values = folder, whole, metadata, values


@pytest.fixture(scope="module")
def sound(tmp_path_factory, worker):
    folder = tmp_path_factory.mktemp("damage")
    (folder / "study.toml").write_text(STUDY)
    path = folder / "sound.h5"
    (reply,) = worker.run(["sweep", str(folder / "study.toml"), "-o", str(path)])
    assert reply["code"] == 0, reply
    whole = path.read_bytes()
    is_value = np.zeros(len(whole), bool)
    with h5py.File(path) as file:
        for dataset in (*file["designs"].values(), file["progress/commit"]):
            start = dataset.id.get_offset()
            is_value[start : start + dataset.nbytes] = True
    # Damage to unused space has no effect.
    is_used = np.frombuffer(whole, np.uint8) != 0
    return Sound(folder, whole, np.flatnonzero(is_used & ~is_value).tolist(), np.flatnonzero(is_value).tolist())


@st.composite
def damages(draw):
    """A few changes of a file: (kind, share of the place, value)."""
    kinds = st.sampled_from(
        ["flip", "byte", "byte", "byte", "word", "fill", "copy", "insert", "remove", "cut", "value"]
    )
    change = st.tuples(kinds, st.integers(0, 2**20), st.integers(0, 2**20), BYTES)
    return draw(st.lists(change, min_size=1, max_size=5))


WORDS = (0, 1, 2**8, 2**16, 2**31 - 1, 2**32 - 1, 2**60, 2**63, 2**64 - 1)


def damaged(sound, changes):
    """The bytes of the sound file after the changes."""
    metadata, values = sound.metadata, sound.values
    content = bytearray(sound.whole)
    for kind, where, how, byte in changes:
        # A byte of HDF5's structures that is not zero, or one of the two after it.
        place = min(metadata[where % len(metadata)] + how % 3, len(content) - 1)
        if kind == "flip":
            content[place] ^= 1 << how % 8
        elif kind == "byte":
            content[place] = byte
        elif kind == "word":
            content[place : place + 8] = WORDS[how % len(WORDS)].to_bytes(8, "little")
        elif kind == "fill":
            content[place : place + 1 + how % 300] = bytes([byte]) * (1 + how % 300)
        elif kind == "copy":
            source = metadata[how % len(metadata)]
            content[place : place + 64] = content[source : source + 64]
        elif kind == "insert":
            content[place:place] = bytes([byte]) * (1 + how % 16)
        elif kind == "remove":
            del content[place : place + 1 + how % 16]
        elif kind == "cut":
            del content[(where * 2**20 + how) % len(content) :]
        else:
            content[values[where % len(values)] % len(content)] ^= byte or 1
        content = content or bytearray(1)  # there must be a byte to change
    return bytes(content)


KINDS = ("pareto", "map", "parallel", "motion", "mechanism", "ratio")


def commands(sound, name, drawn=KINDS):
    """Every command that reads a results file; the last one, a sweep, continues it."""
    page, table, packed = (str(sound.folder / f"written.{ending}") for ending in ("html", "md", "packed.h5"))
    return [
        ["show", name], ["show", name, "--json"], ["show", name, "--design", "7"],
        ["rank", name], ["rank", name, "--json", "--quality", "-o", table],
        ["rank", name, "--metric", "cv", "--limit", "swing_angle=11", "--where", "crank < 130"],
        ["verify", name], ["verify", name, "--json"],
        ["pack", name, "-o", packed],
        ["report", name, "-o", page],
        *(["plot", kind, name, "-o", str(sound.folder / "written.svg")] for kind in drawn),
        ["sweep", str(sound.folder / "study.toml"), "-o", name, "--workers", "1"],
    ]  # fmt: skip


def assert_survived(worker, sound, content, drawn=KINDS):
    """Every command answers or reports an error; a file that a sweep completed is sound."""
    path = sound.folder / "damaged.h5"
    path.write_bytes(content)
    replies = worker.run(*commands(sound, str(path), drawn))
    for reply in replies:
        assert_answered(reply)
    if replies[-1]["code"] == 0:
        (check,) = worker.run(["damaged blocks", str(path)])
        assert check["damaged"] == []
    for written in sound.folder.glob("written.*"):
        written.unlink()
    names = {file.name for file in sound.folder.iterdir() if not file.name.endswith(".log.jsonl")}
    assert names == {"damaged.h5", "sound.h5", "study.toml"}


def assert_answered(reply):
    """A documented exit code, and no traceback; with an exit code other than 0 an error message."""
    assert "Traceback" not in reply["err"]
    assert "internal error" not in reply["err"], reply["err"]
    assert reply["code"] in (0, 1, 2, 3), reply
    assert len(reply["err"]) < 4000, reply["err"]
    if reply["code"] and '"sound": false' not in reply["out"]:  # `verify --json` has no error message
        assert "error: " in reply["err"], reply


def check_all(worker, sound, all_changes, change, examples):
    """What some examples of changes do; in a short run the figures of one kind are drawn for each."""

    @settings(derandomize=True, deadline=None, max_examples=examples, suppress_health_check=[HealthCheck.too_slow])
    @given(changes=all_changes, kind=st.integers(0, len(KINDS) - 1))
    def check(changes, kind):
        assert_survived(worker, sound, change(sound, changes), KINDS if examples > 100 else KINDS[kind : kind + 1])

    check()


@pytest.mark.parametrize("examples", [20, pytest.param(1_500, marks=pytest.mark.slow)])
def test_damaged_results(worker, sound, examples):
    check_all(worker, sound, damages(), damaged, examples)


# --- attributes of another type --------------------------------------------------------------------------------------

DEEP = "[" * 20_000 + "]" * 20_000
INNER = st.sampled_from([
    "null", "true", "1", "-1", "1e400", "NaN", "-Infinity", "1" + "0" * 400, "9" * 5000, '""', '"min"', '"\\ud800"',
    '"$\\\\frac$"', '"a\\u0000b"', "[]", "[[1]]", "{}", '{"a": 1}', '{"min": 1, "max": null}', '{"min": 1e400}', DEEP,
    "[" * 500 + "]" * 500,
])  # fmt: skip
#: Values of attributes: numbers, texts, lists, nothing, of every type that h5py can write.
OTHER = st.one_of(
    st.sampled_from([
        h5py.Empty("f8"), h5py.Empty("S10"), 0, 1, -1, 2**63 - 1, -(2**63), np.uint64(2**64 - 1), 1.5, np.nan, np.inf,
        -np.inf, np.float32(1), np.int8(-1), True, np.bool_(False), 1j, "", "x", "ω", "$\\frac$", "$x", "%s {x} [bold]",
        "a\nb", "x" * 30_000, np.bytes_(b"\xff\xfe"), np.bytes_(b""), np.bytes_(b"x" * 60_000),
        np.bytes_(DEEP.encode()), np.void(b"abc"), np.array([], "f8"), np.array([1.0]), np.array(["a"], "S1"),
        np.zeros((2, 2)), ["a", "b"],
        np.zeros(2, [("a", "i4"), ("b", "S3")]), np.zeros((), [("a", "i4")]), np.arange(5000),
        "index", "metric", "margin", "parameter", "bookkeeping", "all", "front", "crank-rocker", "test-rig", "speed",
    ]),
    INNER.map(lambda text: np.bytes_(text.encode())),
    st.text(st.characters(exclude_characters="\0", codec="utf-8"), max_size=20),
    st.binary(max_size=20).map(np.bytes_), st.integers(-(2**63), 2**63 - 1), st.floats(),
)  # fmt: skip


@st.composite
def altered_attributes(draw):
    """A few changes of attributes: (position of the object, position of the attribute, change)."""
    place = st.integers(0, 2**20)
    inside = st.tuples(place, INNER).map(lambda where: ("inside", *where))
    outside = OTHER.map(lambda value: ("whole", value))
    change = st.one_of(outside, outside, inside, st.just(("removed",)), st.just(("added", "labels")))
    return draw(st.lists(st.tuples(place, place, change), min_size=1, max_size=3))


def alter(sound, changes):
    """The bytes of the sound file with these attributes."""
    path = sound.folder / "damaged.h5"
    path.write_bytes(sound.whole)
    with h5py.File(path, "r+", libver="latest") as file:
        unseal(file)  # else each would be refused at once
        objects = [file]
        file.visititems(lambda _, member: objects.append(member))
        # Half of the changes are of the file's own attributes, which matter most.
        for where, which, (kind, *how) in changes:
            owner = objects[where // 2 % len(objects)] if where % 2 else file
            names = sorted(owner.attrs)
            name = names[which % len(names)] if names else "added"
            if kind == "removed" and names:
                del owner.attrs[name]
            elif kind == "inside":
                name, text = with_other_inside(owner, names, name, *how)
                owner.attrs[name] = np.bytes_(text.encode())
            elif kind == "added":
                owner.attrs[how[0]] = np.bytes_(b'{"0": "zero", "1": "one"}')
            elif kind == "whole":
                owner.attrs[name] = how[0]
    return path.read_bytes()


def with_other_inside(owner, names, name, where, value):
    """Name and text of an attribute that is JSON, if there is one, with one of its values replaced."""
    texts = {each: owner.attrs[each] for each in names}
    texts = {each: text.decode() for each, text in texts.items() if isinstance(text, bytes) and text[:1] in b"[{"}
    if not texts:
        return name, value
    name = sorted(texts)[where % len(texts)]
    places = [match.span() for match in re.finditer(r'"[^"]*"|[\w.+-]+|\{\}|\[\]', texts[name])]
    start, end = places[where // 16 % len(places)] if places else (0, 0)
    return name, texts[name][:start] + value + texts[name][end:]


@pytest.mark.parametrize("examples", [15, pytest.param(1_500, marks=pytest.mark.slow)])
def test_altered_attributes(worker, sound, examples):
    check_all(worker, sound, altered_attributes(), alter, examples)


JSON = ("objectives", "senses", "speed_powers", "status_sentences", "label_sentences")


@pytest.mark.parametrize("name", JSON)
@pytest.mark.parametrize("text", [b"{", b"1", b"null", b'"a"'])
def test_damaged_json_is_said_to_be_damaged(worker, sound, name, text):
    path = sound.folder / "damaged.h5"
    path.write_bytes(sound.whole)
    with h5py.File(path, "r+") as file:
        file.attrs[name] = np.bytes_(text)
    for reply in worker.run(["show", str(path)], ["rank", str(path)], ["show", str(path), "--design", "1"]):
        assert (reply["code"], reply["out"]) == (1, "")
        assert reply["err"].startswith(f"error: {path} is damaged and cannot be read")


@pytest.mark.parametrize("onto", ["crank", "design"])
def test_columns_over_each_other_are_refused(worker, sound, onto):
    """Computing a block again would overwrite one column by the other, with right checksums."""
    path = sound.folder / "damaged.h5"
    with h5py.File(sound.folder / "sound.h5") as file:
        offset, target = (file["designs"][name].id.get_offset() for name in ("cv", onto))
    content = bytearray(sound.whole)
    assert content.count(offset.to_bytes(8, "little")) == 1
    place = content.index(offset.to_bytes(8, "little"))
    content[place : place + 8] = target.to_bytes(8, "little")
    path.write_bytes(content)
    for reply in worker.run(["show", str(path)], ["sweep", str(sound.folder / "study.toml"), "-o", str(path)]):
        assert (reply["code"], reply["out"]) == (1, "")
        assert "is damaged and cannot be read" in reply["err"]
    assert path.read_bytes() == bytes(content)
