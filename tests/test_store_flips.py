"""Every byte of a results file, flipped: each way of reading gives what it gave before, or refuses in one line."""

import random

import h5py
import numpy as np
import pytest
from doors import DOORS
from studies import sweep_text
from test_fuzz_results import STUDY

import explore
from explore.base.errors import ResultsError
from explore.results.store.packing import pack
from explore.results.store.sealing import COMMIT_OFFSET, SEAL

#: Ways that every other pair of flips, of one bit and of two, is tried on.
OTHERS = [name for name in DOORS if name not in ("read_results", "report")]
#: Flips of each class of bytes.
FLIPS = [4, pytest.param(400, marks=pytest.mark.slow)]


@pytest.fixture(scope="module", params=["plain", "packed"])
def whole(tmp_path_factory, worker, request):
    """The path, the bytes and what each way hands out of a finished sweep of 36 designs, or of its packed copy."""
    folder = tmp_path_factory.mktemp("flips")
    path = sweep_text(folder, STUDY, "whole").path
    if request.param == "packed":
        pack(path, folder / "packed.h5")
        path = folder / "packed.h5"
    content, target = path.read_bytes(), folder / "flipped.h5"
    target.write_bytes(content)
    answers = knock(worker, target, DOORS)
    assert not any(text.startswith("refused") for text in answers.values()), answers
    return path, content, answers


def knock(worker, path, doors):
    """What each way hands out, one after the other, in a process of its own: damage may crash HDF5."""
    replies = worker.run(*(["door", str(path), door] for door in doors))
    return {door: reply["found"] for door, reply in zip(doors, replies, strict=True)}


def byte_classes(path, content):
    """Offsets of the bytes of a file by what they are."""
    kind = np.where(np.frombuffer(content, np.uint8) != 0, "structures", "zeros of structures and gaps").astype("<U40")
    with h5py.File(path) as file:
        commit = file["progress/commit"]
        first = commit.id.get_offset()
        kind[first : first + commit.nbytes] = "page of a commit word"
        kind[first : first + 8] = "commit word"
        for name, dataset in file["designs"].items():
            start, length = dataset.id.get_offset(), dataset.nbytes
            if dataset.chunks:
                chunk = dataset.id.get_chunk_info(0)
                start, length = chunk.byte_offset, chunk.size
            kind[start : start + length] = f"column {name}"
        for owner in (file, *file["designs"].values()):
            for value in owner.attrs.values():
                text = value if isinstance(value, bytes) else b""
                start = content.find(text) if len(text) > 4 else -1
                kind[start : start + len(text) if start >= 0 else start] = "text of an attribute"
    return {name: np.flatnonzero(kind == name) for name in np.unique(kind)}


@pytest.mark.parametrize("count", FLIPS)
def test_a_flipped_bit_never_changes_what_is_read(worker, whole, count):
    """All classes of bytes, with seeded flips of one bit, and of two bits at places of the same class."""
    path, content, expected = whole
    target, chance = path.with_name("flipped.h5"), random.Random(7)
    trials = refused = 0
    for name, places in byte_classes(path, content).items():
        for number in range(count):
            changed = bytearray(content)
            for place in chance.choices(places.tolist(), k=1 + number % 2):
                changed[place] ^= 1 << chance.randrange(8)
            target.write_bytes(changed)
            # the report takes a tenth of a second
            doors = ["read_results", *OTHERS[number // 2 % 2 :: 2], *(["report"] if number % 10 == 0 else [])]
            answers = knock(worker, target, doors)
            for door, text in answers.items():
                is_refusal = text.startswith("refused: ") and "\n" not in text
                assert is_refusal or text == expected[door], (name, number, door, text[:300])
            trials += 1
            refused += answers["read_results"].startswith("refused")
    assert trials >= 10 * count
    assert refused > trials / 4


@pytest.mark.parametrize(("old", "new"), [(b"cv:min", b"cv:max"), (b"\x00deg", b"\x00rad"), (b"= 10", b"= 19")])
def test_changed_attributes_are_refused(whole, old, new):
    path, content, _ = whole
    assert old in content
    target = path.with_name("changed.h5")
    target.write_bytes(content.replace(old, new, 1))
    with pytest.raises(ResultsError, match="do not have the checksum that they were written with"):
        explore.open_results(target)


@pytest.mark.parametrize("name", [SEAL, "format_version"])
def test_a_checksum_that_is_gone_is_noticed(whole, name):
    path, content, _ = whole
    target = path.with_name("changed.h5")
    target.write_bytes(content)
    with h5py.File(target, "r+") as file:
        if name == SEAL:
            del file.attrs[SEAL]
        else:
            file.attrs.modify(name, 2)
    with pytest.raises(ResultsError, match="checksum"):
        explore.open_results(target)


def test_commit_words_elsewhere_are_noticed(whole):
    """A damaged address of the commit words would show all blocks as pending."""
    path, content, _ = whole
    with h5py.File(path) as file:
        offset = int(file.attrs[COMMIT_OFFSET])
        assert offset == file["progress/commit"].id.get_offset()
    address = offset.to_bytes(8, "little")
    places = [place for place in range(len(content) - 8) if content[place : place + 8] == address]
    target = path.with_name("changed.h5")
    empty = len(content).to_bytes(8, "little")
    for place in places:
        target.write_bytes(content[:place] + empty + content[place + 8 :] + bytes(4096))
        with pytest.raises(ResultsError, match="damaged"):
            explore.open_results(target)


def test_each_block_is_checked_once(whole, monkeypatch):
    from explore.results.store import rows

    checked = []
    is_sound = rows.is_sound
    monkeypatch.setattr(rows, "is_sound", lambda *block: checked.append(block[2]) or is_sound(*block))
    results = explore.open_results(whole[0])
    results.to_pandas()
    results.design(3)
    list(results.blocks())
    explore.xarray(results)["cv"].to_numpy()
    assert checked == [0]
