"""Records of arrays as one row of real numbers, and a layout that tells what they are."""

import json
from collections.abc import Collection
from hashlib import sha256
from typing import Any

import numpy as np
import scipy.sparse as sp

from symhbm.numerics import FloatArray

_TYPES = {"b": bool, "i": int, "f": float}
_SPARSE = "data", "indices", "indptr"
_MATRICES = {"csc": sp.csc_array, "csr": sp.csr_array}


def to_numbers(record: Any) -> tuple[FloatArray, Any]:
    """Numbers (n,) of a named tuple, and their layout for JSON.

    It is of such tuples, of tuples, sparse matrices, arrays, numbers and None.
    """
    parts: list[FloatArray] = []
    layout = _layout(record, parts)
    return np.concatenate(parts), layout


def _layout(record: Any, parts: list[FloatArray]) -> Any:
    if record is None:
        return None
    if hasattr(record, "_asdict"):
        fields = {name: _layout(value, parts) for name, value in record._asdict().items()}
        return {"of": type(record).__name__, "fields": fields}
    if isinstance(record, tuple):
        return {"each": [_layout(value, parts) for value in record]}
    if sp.issparse(record):
        arrays = [_layout(getattr(record, name), parts) for name in _SPARSE]
        return {"sparse": record.format, "size": list(record.shape), "arrays": arrays}
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
        each = []
        for part in layout.get("each", layout.get("arrays", ())):
            value, first = read(part, first)
            each.append(value)
        if "each" in layout:
            return tuple(each), first
        if "sparse" in layout:
            matrix = _MATRICES[layout["sparse"]](tuple(each), shape=layout["size"])
            return matrix, first
        kind, shape = layout["kind"], layout["shape"]
        last = first + int(np.prod(shape)) * (2 if kind == "c" else 1)
        part = np.array(numbers[first:last])
        values = part.view(complex) if kind == "c" else part.astype(_TYPES[kind])
        values = values.reshape(shape)
        return (values if shape else values.item()), last

    return read(layout, 0)[0]


def stored(record: Any, told: dict[str, Any]) -> tuple[FloatArray, dict[str, Any]]:
    """Numbers (n,) of a record, and what is ``told`` with their layout and a checksum."""
    numbers, layout = to_numbers(record)
    told = told | {"layout": layout}
    return numbers, told | {"numbers": digest_of(numbers, told)}


def recalled(numbers: FloatArray, told: dict[str, Any], kinds: Collection[Any]) -> Any:
    """The record of `stored`; ValueError where numbers or what is ``told`` are damaged."""
    given = {name: value for name, value in told.items() if name != "numbers"}
    if digest_of(numbers, given) != told["numbers"]:
        raise ValueError("the structure is not as it was stored")
    return from_numbers(numbers, told["layout"], kinds)


def digest_of(numbers: FloatArray, told: Any) -> str:
    """Checksum of numbers and of what JSON tells of them."""
    digest = sha256(np.ascontiguousarray(numbers).tobytes())
    digest.update(json.dumps(told).encode())
    return digest.hexdigest()
