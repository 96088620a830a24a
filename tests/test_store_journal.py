"""The journal: acknowledged records survive full disks and damage to other records."""

import contextlib
import itertools
import resource
import zlib
from pathlib import Path

import numpy as np
import pytest
from faults.disks import mounted
from hypothesis import given, settings
from hypothesis import strategies as st

from explore.base.errors import ResultsError
from explore.results.store import journal as journal_module
from explore.results.store.journal import Journal
from explore.results.store.layout import PAGE

HEADER = {
    "determines": '{"mechanism": "crank-rocker", "parameters": {"crank": [1, 2], "ground": 3}}',
    "request_sha256": "ab" * 32,
    "kernel": "four-bar 1",
    "block_size": 1000,
}


def record(number: int) -> tuple[dict, dict[str, np.ndarray]]:
    """Records of different sizes, one of them without any rows."""
    count = number * 37 % 11
    meta = {"block": number, "counts": {"ok": count, "ω": 1}}
    return meta, {
        "design": np.arange(count, dtype="<i8") + number,
        "cv": np.sqrt(np.arange(count) - 1.0, where=np.arange(count) > 0, out=np.full(count, np.nan)),
        "status": np.ones(count // 2, "|i1"),
        "feasible": np.arange(count) % 2 == 0,
    }


def grown(path: Path, count: int) -> Path:
    with Journal(path, HEADER) as journal:
        for number in range(count):
            journal.append(*record(number))
    return path


def numbers_in(path: Path) -> list[int]:
    """Numbers of the records, after a check that each has the content that was written."""
    with Journal(path, HEADER) as journal:
        return check(journal)


def check(journal: Journal) -> list[int]:
    numbers = []
    for meta, arrays in journal.records():
        expected_meta, expected = record(meta["block"])
        assert meta == expected_meta
        assert list(arrays) == list(expected)
        for name, values in expected.items():
            assert arrays[name].dtype == values.dtype
            np.testing.assert_array_equal(arrays[name], values)
        numbers.append(meta["block"])
    return numbers


def test_records_come_back_in_their_order(tmp_path):
    path = grown(tmp_path / "a.h5.journal", 20)
    assert numbers_in(path) == list(range(20))
    with Journal(path, HEADER) as journal:
        journal.append(*record(20))
        reading = journal.records()
        assert next(reading)[0]["block"] == 0
        journal.append(*record(21))  # also while they are read
        assert [meta["block"] for meta, _ in reading] == list(range(1, 22))
    assert [p.name for p in tmp_path.iterdir()] == ["a.h5.journal"]


def test_bytes_depend_on_the_content_only(tmp_path):
    assert grown(tmp_path / "a", 5).read_bytes() == grown(tmp_path / "b", 5).read_bytes()


def test_numbers_of_the_other_byte_order(tmp_path):
    with Journal(tmp_path / "a", HEADER) as journal:
        journal.append({}, {"x": np.array([1.0, 2.0], ">f8"), "y": np.arange(10)[::3]})
        ((_, arrays),) = journal.records()
    assert arrays["x"].dtype.str == "<f8"
    np.testing.assert_array_equal(arrays["x"], [1.0, 2.0])
    np.testing.assert_array_equal(arrays["y"], [0, 3, 6, 9])


@pytest.mark.parametrize("wrong", [np.zeros((2, 2)), np.array(["text"]), np.array([{}]), np.zeros(2, "f8,f8")])
def test_only_numbers_are_kept(tmp_path, wrong):
    with Journal(tmp_path / "a", HEADER) as journal:
        with pytest.raises(ValueError, match="x is not a one-dimensional array of numbers"):
            journal.append({}, {"x": wrong})
        assert list(journal.records()) == []


# --- another study, no journal ---------------------------------------------------------------------------------------


def test_another_study_is_refused_with_a_diff(tmp_path):
    path = grown(tmp_path / "a.journal", 3)
    before = path.read_bytes()
    changed = HEADER | {"kernel": "four-bar 2", "determines": HEADER["determines"].replace("[1, 2]", "[1, 5]")}
    with pytest.raises(ResultsError) as refusal, Journal(path, changed | {"request_sha256": "cd" * 32}):
        pytest.fail("a changed study was accepted")
    assert str(refusal.value).splitlines() == [
        f"{path} holds the results of another study; what changed:",
        "  parameters.crank: [1, 2] -> [1, 5]",
        '  kernel: "four-bar 1" -> "four-bar 2"',
        "use `restart=True` to start over, or name another file with `path`",
    ]
    assert path.read_bytes() == before


@pytest.mark.parametrize("content", [b"", b"my notes", b"explore journal 2", b"explore journal 2\n", bytes(1000)])
def test_files_that_are_no_journal_are_left_alone(tmp_path, content):
    path = tmp_path / "a.journal"
    path.write_bytes(content)
    with pytest.raises(ResultsError, match=r"a\.journal is (not a journal, or )?damaged at its beginning.*move it"):
        numbers_in(path)
    assert path.read_bytes() == content


def test_record_that_claims_too_much(tmp_path):
    """A record with a right checksum may be forged: its lengths and types are checked before arrays are made."""
    path = grown(tmp_path / "a.journal", 0)
    for columns in ('[["x", "<f8", 1000000000000]]', '[["x", "<f8", -1]]', '[["x", "|O", 1]]', '[["x", "<f8"]]', "5"):
        text = f'{{"meta": {{}}, "columns": {columns}}}'.encode()
        content = len(text).to_bytes(8, "little") + text + bytes(8)
        length = len(content).to_bytes(8, "little")
        checksum = zlib.crc32(length + content).to_bytes(4, "little")
        whole = path.read_bytes()
        path.write_bytes(whole.ljust(PAGE, b"\0") + length + checksum + content)
        with (
            pytest.raises(ResultsError, match="was not written by this explore"),
            Journal(path, HEADER) as journal,
        ):
            list(journal.records())
        path.write_bytes(whole)


# --- torn and damaged ------------------------------------------------------------------------------------------------


def test_torn_at_every_byte_of_the_last_record(tmp_path):
    path = grown(tmp_path / "a.journal", 5)
    good = path.stat().st_size
    with Journal(path, HEADER) as journal:
        journal.append(*record(5))
    whole = path.read_bytes()
    begin = record_places(whole)[-1][0]
    for length in (good, good + 1, begin - 1, *range(begin, len(whole))):
        path.write_bytes(whole[:length])
        assert numbers_in(path) == [0, 1, 2, 3, 4]
        assert path.stat().st_size == good, "the incomplete record is cut off"
        # a power cut may also leave the length, but not the bytes
        path.write_bytes(whole[:length] + bytes(len(whole) - length))
        numbers = numbers_in(path)
        assert numbers == [0, 1, 2, 3, 4] or (numbers == [0, 1, 2, 3, 4, 5] and not any(whole[length:]))
    path.write_bytes(whole[:-1])
    with Journal(path, HEADER) as journal:
        journal.append(*record(5))
    assert path.read_bytes() == whole


@pytest.fixture(scope="module")
def sound(tmp_path_factory) -> bytes:
    return grown(tmp_path_factory.mktemp("journal") / "sound.journal", 8).read_bytes()


@settings(max_examples=300, deadline=None)
@given(data=st.data())
def test_damage_costs_the_records_that_it_hits(sound, tmp_path_factory, data):
    """Bits flipped anywhere: all records before a damaged length are read, except for the damaged ones."""
    # Mostly in the records: most bytes are between them, where they do not matter.
    in_record = st.sampled_from(record_places(sound)).flatmap(lambda place: st.integers(8 * place[0], 8 * place[1] - 1))
    flips = data.draw(st.sets(in_record | st.integers(0, 8 * len(sound) - 1), min_size=1, max_size=5))
    damaged = flipped(sound, flips)
    path = tmp_path_factory.getbasetemp() / "flipped.journal"
    path.write_bytes(damaged)
    starts, ends = zip(*record_places(sound), strict=True)
    hit = {n for n in range(len(ends)) for bit in flips if (starts[n] if n else 0) <= bit // 8 < ends[n]}
    if 0 in hit:
        with pytest.raises(ResultsError, match="damaged at its beginning"):
            numbers_in(path)
        assert path.read_bytes() == damaged
        return
    unclear = {n for n in hit if any(starts[n] <= bit // 8 < starts[n] + 8 for bit in flips)}
    kept = [n for n in range(1, min(unclear, default=len(ends))) if n not in hit]
    for _ in range(2):  # damaged records are skipped again when the journal is opened again
        with Journal(path, HEADER) as journal:
            numbers = [number + 1 for number in check(journal)]
            assert numbers[: len(kept)] == kept
            assert not hit & set(numbers)
            if not unclear:  # a wrong length may lead to another record by chance
                assert numbers == kept
                assert journal.n_damaged == sum(n < max(kept, default=0) for n in hit)
        assert path.read_bytes() == damaged[: ends[max(numbers, default=0)]]


def test_one_bit_costs_one_record(sound, tmp_path):
    """Every bit of one record, the third of eight: a wrong length also costs the records that follow."""
    path = tmp_path / "flipped.journal"
    start, end = record_places(sound)[3]
    for bit in range(8 * start, 8 * end):
        path.write_bytes(flipped(sound, {bit}))
        in_length = bit // 8 < start + 8
        with Journal(path, HEADER) as journal:
            length = int.from_bytes(flipped(sound, {bit})[start : start + 8], "little")
            elsewhere = in_length and -(-(start + 12 + length) // PAGE) != -(-end // PAGE)
            numbers = check(journal)
            if elsewhere:  # perhaps to the beginning of a later record
                assert numbers[:2] == [0, 1]
                assert 2 not in numbers
                assert journal.n_damaged == (len(numbers) > 2)
            else:
                assert numbers == [0, 1, 3, 4, 5, 6, 7]
                assert journal.n_damaged == 1
    with Journal(path, HEADER) as journal:
        journal.append(*record(2))  # computed again
        assert check(journal) == [0, 1, 3, 4, 5, 6, 7, 2]
    assert numbers_in(path) == [0, 1, 3, 4, 5, 6, 7, 2]


def flipped(content: bytes, bits: set[int]) -> bytes:
    """The content with some bits flipped."""
    damaged = bytearray(content)
    for bit in bits:
        damaged[bit // 8] ^= 1 << bit % 8
    return bytes(damaged)


def record_places(content: bytes) -> list[tuple[int, int]]:
    """Offsets of the beginning and the end of the header and of each record, as the format is documented."""
    start, places = len(b"explore journal 2\n"), []
    while start < len(content):
        end = start + 12 + int.from_bytes(content[start : start + 8], "little")
        places.append((start, end))
        start = -(-end // PAGE) * PAGE
    assert end == len(content)
    return places


# --- full disks -----------------------------------------------------------------------------------------------------


@contextlib.contextmanager
def limited_file_size(size):
    """Limit the file size of this process, for a short time because pytest's output may go to a file."""
    old = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, old[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, old)


def test_full_disk_leaves_a_usable_journal(tmp_path):
    path = grown(tmp_path / "a.journal", 3)
    good = path.stat().st_size
    with Journal(path, HEADER) as journal:
        for room in (0, 1, 40):
            refused = pytest.raises(ResultsError, match=r"a\.journal cannot be written: File too large; run the sw")
            with refused, limited_file_size(good + room):
                journal.append(*record(3))
            assert path.stat().st_size == good
            assert check(journal) == [0, 1, 2]
        journal.append(*record(3))
        assert check(journal) == [0, 1, 2, 3]
    assert numbers_in(path) == [0, 1, 2, 3]


def test_full_disk_at_the_beginning_leaves_nothing(tmp_path):
    with pytest.raises(ResultsError, match=r"a\.journal needs [\d,]+ bytes .*ulimit"), limited_file_size(100):
        grown(tmp_path / "a.journal", 0)
    assert list(tmp_path.iterdir()) == []


def test_disk_full_for_real(tmp_path):
    with mounted(tmp_path, "16k"):
        with Journal(tmp_path / "a.journal", HEADER) as journal:
            for number in itertools.count():
                try:
                    journal.append(*record(number))
                except ResultsError as error:
                    problem = str(error)  # which record meets the full disk is not known beforehand
                    break
            assert "No space left on device; run the sweep again" in problem
            assert check(journal) == list(range(number))
        assert numbers_in(tmp_path / "a.journal") == list(range(number))


def test_append_is_durable_when_it_returns(tmp_path, monkeypatch):
    """Every byte of a record was written before it was synchronised, and nothing afterwards."""
    path, sizes = tmp_path / "a.journal", []
    sync = journal_module.system_calls.sync_data
    with Journal(path, HEADER) as journal:
        monkeypatch.setattr(
            journal_module.system_calls, "sync_data", lambda fd: (sizes.append(path.stat().st_size), sync(fd))
        )
        for number in range(4):
            journal.append(*record(number))
            assert sizes[-1] == path.stat().st_size
    assert len(sizes) == 4


def test_the_checksum_of_a_record_covers_all_of_it(tmp_path):
    """A record as long as the front of a block can be: half a megabyte, damaged in its last byte."""
    path = tmp_path / "a.journal"
    with Journal(path, HEADER) as journal:
        journal.append({"block": 0}, {"cv": np.arange(65_536.0)})
    content = path.read_bytes()
    assert len(content) > 8 * 65_536
    for byte in (len(content) // 2, len(content) - 1):
        path.write_bytes(flipped(content, {8 * byte}))
        with Journal(path, HEADER) as journal:
            assert list(journal.records()) == []
