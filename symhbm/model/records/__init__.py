"""Records: what archives, copies and checksums hold of an object, and the object made again."""

from symhbm.model.records.record import (
    NotRebuiltError,
    NotStoredError,
    Record,
    copied,
    digest_of,
    joined,
    pack,
    packed,
    plain,
    record,
    unpack,
)

__all__ = [
    "NotRebuiltError",
    "NotStoredError",
    "Record",
    "copied",
    "digest_of",
    "joined",
    "pack",
    "packed",
    "plain",
    "record",
    "unpack",
]
