"""CRC-32 of bytes: that of zlib, or the same number from isal, which takes an eighth of the time."""

from collections.abc import Callable

try:
    from isal.isal_zlib import crc32 as _crc32
except ImportError:
    from zlib import crc32 as _crc32

#: Function of bytes, or of an object with a buffer, and the checksum of the bytes before them.
crc32: Callable[..., int] = _crc32
