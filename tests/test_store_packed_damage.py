"""Damaged and hostile packed files."""

import contextlib
import random
import zlib

import h5py
import numpy as np
import pytest
from store_files import BLOCK, COLUMNS, N_BLOCKS, N_DESIGNS, assert_random_damage_is_told, flip

from explore.base.errors import ResultsError
from explore.results.store import layout_reader
from explore.results.store.chunks import compress_chunk, decompress_chunk, read_chunk_table
from explore.results.store.open_results import open_results


def test_every_flipped_bit_of_a_chunk_is_found(packed_copy):
    whole = packed_copy.read_bytes()
    chance = random.Random(5)
    with h5py.File(packed_copy) as file:
        places = {
            (name, number): file["designs"][name].id.get_chunk_info(number)
            for name in ("design", "crank", "status") for number in (0, 4, 9)
        }  # fmt: skip
    for (name, number), info in places.items():
        for _ in range(8):
            packed_copy.write_bytes(whole)
            flip(packed_copy, info.byte_offset + chance.randrange(info.size))
            results = open_results(packed_copy)
            assert results.verify() in ([number], []), name
            if results.verify():
                with contextlib.suppress(ResultsError):  # deflate has its own checksum, so reading fails too
                    results.to_pandas()
                    pytest.fail("damaged bytes were read")
            else:
                results.to_pandas()  # a bit of the header that the content does not depend on


def test_damaged_chunk_says_where(packed_copy):
    with h5py.File(packed_copy) as file:
        info = file["designs/crank"].id.get_chunk_info(4)
    flip(packed_copy, info.byte_offset + info.size - 1)
    results = open_results(packed_copy)
    with pytest.raises(ResultsError, match="crank in rows 4000 to 4999 cannot be decompressed .*pack the original ag"):
        results.to_pandas()
    with pytest.raises(ResultsError, match="crank in rows 4000 to 4999 cannot be decompressed"):
        results.to_pandas(["nodes"])
    assert len(results.designs(range(BLOCK))) == BLOCK, "the other blocks can be read"


def replaced(**changes):
    """Replace the crank column by one created with other options."""

    def change(file: h5py.File) -> None:
        options = {"chunks": (BLOCK,), "compression": "gzip", "compression_opts": 1, "shuffle": True} | changes
        del file["designs/crank"]
        file["designs"].create_dataset("crank", (N_DESIGNS,), "<f8", **options)[...] = 1.0

    return change


def vast_columns(file: h5py.File) -> None:
    """Columns of 8 TB without chunks."""
    for column in COLUMNS:
        del file["designs"][column.name]
        file["designs"].create_dataset(
            column.name, (10**12,), column.dtype, chunks=(BLOCK,), compression="gzip", shuffle=True
        )
    file.attrs["n_designs"] = 10**12


def bomb(file: h5py.File) -> None:
    """A chunk of a few bytes that should decompress to 8 GB."""
    for column in COLUMNS:
        del file["designs"][column.name]
        plain = file["designs"].create_dataset(
            column.name, (4 * 10**8,), column.dtype, chunks=(4 * 10**8,), compression="gzip", shuffle=True
        )
        plain.id.write_direct_chunk((0,), b"x\x9c\x03\x00\x00\x00\x00\x01")
    file.attrs["n_designs"] = file.attrs["block_size"] = 4 * 10**8
    del file["progress/commit"]
    file["progress"]["commit"] = np.array([2**32], "<u8")


def missing_chunk(file: h5py.File) -> None:
    del file["designs/crank"]
    column = file["designs"].create_dataset(
        "crank", (N_DESIGNS,), "<f8", chunks=(BLOCK,), compression="gzip", shuffle=True
    )
    column[: 9 * BLOCK] = 1.0


def skipped_filter(file: h5py.File) -> None:
    file["designs/crank"].id.write_direct_chunk((0,), bytes(8 * BLOCK), filter_mask=2)


def shared_chunks(file: h5py.File) -> None:
    """A thousand columns of the same bytes: each is sound, but together they are larger than the file."""
    names = [f"same{i:03}" for i in range(1000)]
    for name in names:
        file["designs"][name] = file["designs/rocker_velocity_max"]
    old = [name.encode() for name in (column.name for column in COLUMNS[1:])]
    del file["frame/axis0"]
    file["frame"]["axis0"] = np.array(old + [name.encode() for name in names])


HOSTILE = {
    "another chunk shape": replaced(chunks=(BLOCK // 2,)),
    "no shuffle": replaced(shuffle=False),
    "no compression": replaced(compression=None, compression_opts=None),
    "a checksum filter": replaced(fletcher32=True),
    "another filter": replaced(compression="lzf", compression_opts=None),
    "not chunked": replaced(chunks=None, shuffle=False, compression=None, compression_opts=None),
    "an unlimited column": replaced(chunks=(BLOCK + 1,), maxshape=(None,)),
    "columns of 8 TB": vast_columns,
    "a bomb": bomb,
    "a missing chunk": missing_chunk,
    "a chunk without its filters": skipped_filter,
    "chunks used more than once": shared_chunks,
}


@pytest.mark.parametrize("change", HOSTILE.values(), ids=HOSTILE)
def test_hostile_headers_are_refused(packed_copy, change):
    with h5py.File(packed_copy, "r+") as file:
        change(file)
    with pytest.raises(ResultsError, match=r"copy\.h5 is damaged"):
        open_results(packed_copy)


def test_no_chunk_becomes_longer_than_it_may(packed_copy):
    """A chunk that is a megabyte of zeros in a kilobyte, where eight kilobytes are expected."""
    with h5py.File(packed_copy, "r+") as file:
        file["designs/crank"].id.write_direct_chunk((0,), zlib.compress(bytes(1 << 20)))
    results = open_results(packed_copy)
    assert results.verify() == [0]
    with pytest.raises(ResultsError, match="crank in rows 0 to 999 cannot be decompressed .its length is not 8000 byt"):
        results.design(5)


def test_random_damage_never_gives_another_error(packed_copy):
    with h5py.File(packed_copy) as file:
        chunks = [info for column in file["designs"].values() for info in chunk_infos(column)]
    is_structure = np.ones(packed_copy.stat().st_size, bool)
    for info in chunks:
        is_structure[info.byte_offset : info.byte_offset + info.size] = False
    places = np.flatnonzero(is_structure).tolist()
    assert_random_damage_is_told(packed_copy, places, lambda: open_results(packed_copy).to_pandas())


def chunk_infos(dataset: h5py.Dataset) -> list:
    infos: list = []
    dataset.id.chunk_iter(infos.append)
    return infos


def test_a_chunk_without_its_end_is_refused():
    """All values can be there without the checksum at the end of the stream."""
    values = np.arange(1000.0)
    stored = compress_chunk(values, 1000)
    np.testing.assert_array_equal(decompress_chunk(stored, "<f8", 1000), values)
    for missing in (1, 4):
        with pytest.raises(ValueError, match="its length is not 8000 bytes"):
            decompress_chunk(stored[:-missing], "<f8", 1000)


def test_a_chunk_must_end_within_the_file(packed):
    with h5py.File(packed) as file:
        dataset = file["designs/crank"]
        table = read_chunk_table(dataset, N_DESIGNS, BLOCK, packed.stat().st_size)
        end = int(table.sum(axis=1).max())
        np.testing.assert_array_equal(read_chunk_table(dataset, N_DESIGNS, BLOCK, end), table)
        with pytest.raises(ValueError, match="reaches beyond the end of the file"):
            read_chunk_table(dataset, N_DESIGNS, BLOCK, end - 1)


def test_chunks_that_share_their_bytes_are_refused(packed_copy, monkeypatch):
    """Two columns of which each takes more than half of the file."""
    size = packed_copy.stat().st_size
    half = np.array([[0, size // (2 * N_BLOCKS)]] * N_BLOCKS)
    monkeypatch.setattr(layout_reader, "read_chunk_table", lambda *_: half)
    with pytest.raises(ResultsError, match="chunks overlap"):
        open_results(packed_copy)
