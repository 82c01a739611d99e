"""Reads an HDF5 file, also one that its writer has not closed: it still runs or was killed.

HDF5 marks such a file in its first bytes, and then refuses it or, in its mode for readers (SWMR),
waits for ever wherever the file is damaged. What the writer has flushed is sound all the same. So
HDF5 is shown the file without the mark and without an end, and a read past the true end is an error
instead of zeros.

The first bytes of the superblock, version 3: signature (8), version (1), sizes of addresses and
lengths (2), marks (1), base and extension address (16), end of file (8), root address (8),
checksum (4). The checksum is `lookup3` of Bob Jenkins (2006, public domain).
"""

from __future__ import annotations

import io
import struct
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from _typeshed import WriteableBuffer

SIGNATURE = b"\x89HDF\r\n\x1a\n"
_SIZE = 48
_END = 2**62  # beyond every address that a file can hold
_WORD = 0xFFFFFFFF


def is_unclosed(head: bytes | bytearray) -> bool:
    """True if a file that begins with these bytes is marked as open for writing."""
    return len(head) >= _SIZE and head.startswith(SIGNATURE + b"\x03\x08\x08") and head[11] != 0


class HDF5Source(io.RawIOBase):
    """The file at `path`, to be read by `h5py.File(HDF5Source(path), "r")`; it changes nothing.

    Raises:
        OSError: the file cannot be opened, or ends before what is asked for.
    """

    def __init__(self, path: Path) -> None:
        self._file = path.open("rb", buffering=0)
        self._head = b""
        self._position = 0
        self._end = self._file.seek(0, io.SEEK_END)
        self._file.seek(0)
        head = bytearray(self._file.read(_SIZE))
        if is_unclosed(head):
            head[11] = 0
            struct.pack_into("<Q", head, 28, _END)
            struct.pack_into("<I", head, 44, _lookup3(bytes(head[:44])))
            self._head, self._end = bytes(head), _END

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        origin = {io.SEEK_SET: 0, io.SEEK_CUR: self._position, io.SEEK_END: self._end}[whence]
        self._position = origin + offset
        return self._position

    def readinto(self, buffer: WriteableBuffer) -> int:
        view = memoryview(buffer).cast("B")
        start, size = self._position, len(view)
        self._file.seek(start)
        done = 0
        while done < size:
            got = self._file.readinto(view[done:])
            if not got:
                raise OSError(f"the file ends {size - done} bytes too early")
            done += got
        if start < len(self._head):
            stop = min(len(self._head), start + size)
            view[: stop - start] = self._head[start:stop]
        self._position = start + size
        return size

    def close(self) -> None:
        if not self.closed:
            self._file.close()
        super().close()


def _lookup3(data: bytes) -> int:
    """Jenkins' hash `hashlittle` of `data`, which must not be empty, with seed 0."""
    a = b = c = (0xDEADBEEF + len(data)) & _WORD
    while len(data) > 12:
        x, y, z = _words(data[:12])
        data = data[12:]
        a, b, c = (a + x) & _WORD, (b + y) & _WORD, (c + z) & _WORD
        for bits in (4, 6, 8, 16, 19, 4):
            a = ((a - c) & _WORD) ^ _rotated(c, bits)
            c = (c + b) & _WORD
            a, b, c = b, c, a
    x, y, z = _words(data.ljust(12, b"\0"))
    a, b, c = (a + x) & _WORD, (b + y) & _WORD, (c + z) & _WORD
    for bits in (14, 11, 25, 16, 4, 14, 24):
        c = ((c ^ b) - _rotated(b, bits)) & _WORD
        a, b, c = b, c, a
    # After seven rotations of the names the last result, c, is called b.
    return b


def _words(block: bytes) -> tuple[int, int, int]:
    x, y, z = (int.from_bytes(block[i : i + 4], "little") for i in (0, 4, 8))
    return x, y, z


def _rotated(word: int, bits: int) -> int:
    return ((word << bits) | (word >> (32 - bits))) & _WORD
