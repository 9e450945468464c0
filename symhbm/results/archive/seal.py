"""Checksum at the end of a file, which detects damaged archives.

Readers of NetCDF ignore bytes after their data; a program that changes the file cuts them off.
"""

import os
import re
import zlib
from pathlib import Path
from typing import BinaryIO

_MARK = b"\nsymhbm crc32 "
_LENGTH = len(_MARK) + 9
_BLOCK = 2**22
_HDF5 = b"\x89HDF\r\n\x1a\n"
_END_ADDRESS = {0: 40, 1: 44, 2: 28, 3: 28}
"""Offset of the length of an HDF5 file, by the version of its first block."""


def seal(path: Path) -> None:
    """Append the checksum of a file to it, and wait for the disk."""
    with path.open("rb+") as file:
        checksum = _checksum(file, path.stat().st_size)
        file.write(_MARK + b"%08x\n" % checksum)
        file.flush()
        # Before the file gets its final name, which would outlive a loss of power.
        os.fsync(file.fileno())


def is_damaged(path: Path) -> bool:
    """Whether a file differs from what was written; reads all of it.

    A file without a seal is damaged if its length is not that of its data, as far as it tells.
    """
    size = path.stat().st_size
    with path.open("rb") as file:
        file.seek(max(0, size - 2 * _LENGTH))
        end = file.read()
        if _MARK not in end:
            # A seal lost with the last block of the disk leaves other bytes in its place.
            return _end_of_data(file) not in (None, size)
        match = re.search(re.escape(_MARK) + rb"([0-9a-f]{8})\n\Z", end)
        if match is None:
            return True
        file.seek(0)
        return _checksum(file, size - _LENGTH) != int(match[1], 16)


def _end_of_data(file: BinaryIO) -> int | None:
    """Length that the header of an HDF5 file states, None for any other file."""
    file.seek(0)
    head = file.read(64)
    if len(head) < 64 or not head.startswith(_HDF5) or head[8] not in _END_ADDRESS:
        return None
    offset = _END_ADDRESS[head[8]]
    return int.from_bytes(head[offset : offset + 8], "little")


def _checksum(file: BinaryIO, size: int) -> int:
    checksum = 0
    while size > 0:
        block = file.read(min(_BLOCK, size))
        if not block:
            break
        checksum, size = zlib.crc32(block, checksum), size - len(block)
    return checksum
