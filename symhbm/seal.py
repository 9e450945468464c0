"""A checksum at the end of a file, so that a damaged archive is not believed.

Readers of NetCDF pass over what follows their data; a program that changes the file cuts it off.
"""

import re
import zlib
from pathlib import Path
from typing import BinaryIO

_MARK = b"\nsymhbm crc32 "
_LENGTH = len(_MARK) + 9
_BLOCK = 2**22


def seal(path: Path) -> None:
    """Append the checksum of a file to it."""
    with path.open("rb+") as file:
        checksum = _checksum(file, path.stat().st_size)
        file.write(_MARK + b"%08x\n" % checksum)


def is_damaged(path: Path) -> bool:
    """Whether a sealed file is not as it was written; False for one without a seal."""
    size = path.stat().st_size
    with path.open("rb") as file:
        file.seek(max(0, size - 2 * _LENGTH))
        end = file.read()
        if _MARK not in end:
            return False
        found = re.search(re.escape(_MARK) + rb"([0-9a-f]{8})\n\Z", end)
        if found is None:
            return True
        file.seek(0)
        return _checksum(file, size - _LENGTH) != int(found[1], 16)


def _checksum(file: BinaryIO, size: int) -> int:
    checksum = 0
    while size > 0:
        block = file.read(min(_BLOCK, size))
        if not block:
            break
        checksum, size = zlib.crc32(block, checksum), size - len(block)
    return checksum
