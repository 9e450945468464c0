"""Records of arrays as one row of real numbers, and a layout that tells what they are."""

import json
from collections.abc import Collection
from hashlib import sha256
from typing import Any

import numpy as np

from symhbm.numerics import FloatArray

_TYPES = {"b": bool, "i": int, "f": float}


def to_numbers(record: Any) -> tuple[FloatArray, Any]:
    """Numbers (n,) of a named tuple of such, of arrays and numbers, and their layout for JSON."""
    parts: list[FloatArray] = []
    layout = _layout(record, parts)
    return np.concatenate(parts), layout


def _layout(record: Any, parts: list[FloatArray]) -> Any:
    if record is None:
        return None
    if hasattr(record, "_asdict"):
        fields = {name: _layout(value, parts) for name, value in record._asdict().items()}
        return {"of": type(record).__name__, "fields": fields}
    array = np.asarray(record)
    kind, numbers = array.dtype.kind, np.ascontiguousarray(array).ravel()
    parts.append(numbers.view(float) if kind == "c" else numbers.astype(float))
    return {"shape": list(array.shape), "kind": kind}


def from_numbers(numbers: FloatArray, layout: Any, kinds: Collection[Any]) -> Any:
    """The record of `to_numbers`, whose named tuples are of some ``kinds``."""
    by_name = {kind.__name__: kind for kind in kinds}

    def read(layout: Any, first: int) -> tuple[Any, int]:
        if layout is None:
            return None, first
        if "of" in layout:
            values = {}
            for name, part in layout["fields"].items():
                values[name], first = read(part, first)
            return by_name[layout["of"]](**values), first
        kind, shape = layout["kind"], layout["shape"]
        last = first + int(np.prod(shape)) * (2 if kind == "c" else 1)
        part = np.array(numbers[first:last])
        values = part.view(complex) if kind == "c" else part.astype(_TYPES[kind])
        values = values.reshape(shape)
        return (values if shape else values.item()), last

    return read(layout, 0)[0]


def digest_of(numbers: FloatArray, told: Any) -> str:
    """Checksum of numbers and of what JSON tells of them."""
    digest = sha256(np.ascontiguousarray(numbers).tobytes())
    digest.update(json.dumps(told).encode())
    return digest.hexdigest()
