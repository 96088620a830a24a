"""Results files that a disk, a copy or a foe has damaged: read, refused in words or computed again, never a crash."""

from pathlib import Path

import h5py
import numpy as np
import pytest
from damage_worker import Worker
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

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


@pytest.fixture(scope="module")
def worker():
    worker = Worker()
    yield worker
    worker.close()


class Sound:
    """A finished sweep of 36 designs, and where HDF5's own bytes and the values are in its file."""

    # No dataclass: Hypothesis would print all the bytes of one with a failure.
    def __init__(self, folder: Path, whole: bytes, metadata: list[int], values: list[int]):
        self.folder, self.whole, self.metadata, self.values = folder, whole, metadata, values


@pytest.fixture(scope="module")
def sound(tmp_path_factory, worker):
    folder = tmp_path_factory.mktemp("damage")
    (folder / "study.toml").write_text(STUDY)
    path = folder / "sound.h5"
    (done,) = worker.ask(["sweep", str(folder / "study.toml"), "-o", str(path)])
    assert done["code"] == 0, done
    whole = path.read_bytes()
    values = np.zeros(len(whole), bool)
    with h5py.File(path) as file:
        for dataset in (*file["designs"].values(), file["progress/commit"]):
            start = dataset.id.get_offset()
            values[start : start + dataset.nbytes] = True
    # Unused space between the pieces is of no interest.
    used = np.frombuffer(whole, np.uint8) != 0
    return Sound(folder, whole, np.flatnonzero(used & ~values).tolist(), np.flatnonzero(values).tolist())


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
        # One of HDF5's own bytes that is not zero, or one close by.
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


def assert_survived(worker, sound, content):
    """Every command gives an answer or one clear line; what a sweep calls complete is sound."""
    path = sound.folder / "damaged.h5"
    path.write_bytes(content)
    name, study = str(path), str(sound.folder / "study.toml")
    replies = worker.ask(
        ["show", name], ["show", name, "--json"], ["show", name, "--design", "7"],
        ["rank", name], ["rank", name, "--json"],
        ["sweep", study, "-o", name, "--workers", "1"],
    )  # fmt: skip
    for reply in replies:
        assert "Traceback" not in reply["err"]
        assert "this should not have happened" not in reply["err"], reply["err"]
        assert reply["code"] in (0, 1, 2, 3), reply
        if reply["code"]:
            # A column may have come to lie over HDF5's own bytes, which shows when its block is written again.
            error = reply["err"].removeprefix("damaged blocks are computed again: 1; check the disk\n")
            assert error.startswith("error: "), reply["err"]
            assert str(path) in error or reply["code"] == 2, reply["err"]
            assert reply["out"] == ""
    if replies[-1]["code"] == 0:
        (check,) = worker.ask(["verify", name])
        assert check["damaged"] == []
    left = {file.name for file in sound.folder.iterdir() if not file.name.endswith(".log.jsonl")}
    assert left == {"damaged.h5", "sound.h5", "study.toml"}


SHORT = settings(derandomize=True, deadline=None, max_examples=300,
                 suppress_health_check=[HealthCheck.too_slow])  # fmt: skip
LONG = settings(SHORT, max_examples=10_000)


@SHORT
@given(changes=damages())
def test_damaged_results(worker, sound, changes):
    assert_survived(worker, sound, damaged(sound, changes))


@pytest.mark.slow
@LONG
@given(changes=damages())
def test_damaged_results_long(worker, sound, changes):
    assert_survived(worker, sound, damaged(sound, changes))


JSON = ("objectives", "senses", "speed_powers", "status_sentences")


@pytest.mark.parametrize("name", JSON)
@pytest.mark.parametrize("text", [b"{", b"1", b"null", b'"a"'])
def test_damaged_json_is_said_to_be_damaged(worker, sound, name, text):
    path = sound.folder / "damaged.h5"
    path.write_bytes(sound.whole)
    with h5py.File(path, "r+") as file:
        file.attrs[name] = np.bytes_(text)
    for reply in worker.ask(["show", str(path)], ["rank", str(path)], ["show", str(path), "--design", "1"]):
        assert (reply["code"], reply["out"]) == (1, "")
        assert reply["err"].startswith(f"error: {path} is damaged and cannot be read")


@pytest.mark.parametrize("onto", ["crank", "design"])
def test_columns_over_each_other_are_refused(worker, sound, onto):
    """Computing a block again would write one column over the other, and say that all is well."""
    path = sound.folder / "damaged.h5"
    with h5py.File(sound.folder / "sound.h5") as file:
        offset, target = (file["designs"][name].id.get_offset() for name in ("cv", onto))
    content = bytearray(sound.whole)
    assert content.count(offset.to_bytes(8, "little")) == 1
    place = content.index(offset.to_bytes(8, "little"))
    content[place : place + 8] = target.to_bytes(8, "little")
    path.write_bytes(content)
    for reply in worker.ask(["show", str(path)], ["sweep", str(sound.folder / "study.toml"), "-o", str(path)]):
        assert (reply["code"], reply["out"]) == (1, "")
        assert "is damaged and cannot be read" in reply["err"]
    assert path.read_bytes() == bytes(content)
