"""Checksums are those of zlib whichever library computes them."""

import subprocess
import sys
import zlib

import numpy as np
import pytest

from explore.base import checksums


@pytest.mark.parametrize("size", [0, 1, 7, 64, 1000, 524_288, 524_289])
def test_isal_is_used_and_agrees_with_zlib(size):
    data = np.random.default_rng(size).bytes(size)
    assert checksums.crc32.__module__.startswith("isal")
    assert checksums.crc32(data) == zlib.crc32(data)
    assert checksums.crc32(data, 0xDEADBEEF) == zlib.crc32(data, 0xDEADBEEF)


def test_without_isal_zlib_computes_them():
    program = (
        "import sys, zlib\nsys.modules['isal'] = None\n"
        "from explore.base import checksums\nprint(checksums.crc32 is zlib.crc32)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout == "True\n"
