"""Records: what archives, copies and checksums hold of an object, which its class makes again.

An object is its fields. JSON tells them, their arrays are one row of real numbers. Classes are
looked up among those that are registered, so that an archive runs no code of its own.
"""

import json
from collections.abc import Mapping
from functools import cached_property
from hashlib import sha256
from inspect import signature
from typing import Any, ClassVar, Self, TypeVar

import numpy as np
import scipy.sparse as sp

from symhbm.numerics import FloatArray

Kind = TypeVar("Kind", bound=type)
_TYPES = {"b": bool, "i": int, "u": int, "f": float}
_SPARSE = "data", "indices", "indptr"
_MATRICES = {"csc": sp.csc_array, "csr": sp.csr_array}
_LIBRARY = __name__.partition(".")[0]
_KINDS: dict[str, dict[str, Any]] = {}
"""Classes by their names, then by the modules that define them."""


class NotStoredError(TypeError):
    """A value that archives do not hold."""


class NotRebuiltError(LookupError):
    """An object that its record alone does not make again."""


def record(kind: Kind) -> Kind:
    """Register a class, a named tuple for example, whose objects archives hold."""
    _KINDS.setdefault(kind.__name__, {})[kind.__module__] = kind
    return kind


class Record:
    """An object that archives hold by its fields. A class derived from this one is registered."""

    stored_as: ClassVar[Any] = None
    """The class that makes it again, where that is another one."""

    def __init_subclass__(cls, **options: Any):
        super().__init_subclass__(**options)
        record(cls)

    def fields(self) -> dict[str, Any]:
        """Attributes, without those that are computed from others."""
        computed = {
            name
            for kind in type(self).__mro__
            for name, value in vars(kind).items()
            if isinstance(value, cached_property)
        }
        return {name: value for name, value in vars(self).items() if name not in computed}

    @classmethod
    def of_fields(cls, **fields: Any) -> Self:
        """The object of its `fields`, by its constructor where that takes them."""
        if {*fields} <= {*signature(cls).parameters}:
            return cls(**fields)
        made = object.__new__(cls)
        vars(made).update(fields)
        return made


def pack(value: Any, parts: list[FloatArray]) -> Any:
    """What JSON tells of a value, whose arrays follow the ``parts`` of a row of numbers.

    Raises NotStoredError for what archives do not hold.
    """
    if isinstance(value, np.generic):
        value = value.item()
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    if isinstance(value, complex):
        return {"complex": [value.real, value.imag]}
    kind = getattr(value, "stored_as", None) or type(value)
    if kind.__module__ in _KINDS.get(kind.__name__, ()):
        fields = value._asdict() if hasattr(value, "_asdict") else value.fields()
        told = {"of": kind.__name__, "fields": {n: pack(v, parts) for n, v in fields.items()}}
        return told if _is_of_library(kind.__module__) else told | {"from": kind.__module__}
    if isinstance(value, (tuple, list)):
        return [pack(each, parts) for each in value]
    if isinstance(value, Mapping):
        return {"keys": pack([*value], parts), "values": pack([*value.values()], parts)}
    if sp.issparse(value) and value.format in _MATRICES:
        arrays = [pack(getattr(value, name), parts) for name in _SPARSE]
        return {"sparse": value.format, "size": list(value.shape), "arrays": arrays}
    if isinstance(value, np.ndarray) and value.dtype.kind == "U":
        texts, numbers = np.unique(value, return_inverse=True)
        return {"texts": texts.tolist(), "at": pack(numbers.reshape(value.shape), parts)}
    if isinstance(value, np.ndarray) and value.dtype.kind in "biufc":
        numbers = np.ascontiguousarray(value).ravel()
        first = sum(map(len, parts))
        whole = value.dtype.kind == "c"
        parts.append(numbers.view(float) if whole else numbers.astype(float))
        return {"kind": value.dtype.kind, "shape": list(value.shape), "first": first}
    raise NotStoredError(f"{type(value).__name__} is nothing that archives hold")


def unpack(told: Any, numbers: FloatArray) -> Any:
    """The value of `pack`, by its row of numbers; NotRebuiltError for classes that are missing."""
    if isinstance(told, list):
        return tuple(unpack(each, numbers) for each in told)
    if not isinstance(told, dict):
        return told
    if "of" in told:
        kind = _kind_of(told)
        fields = {name: unpack(each, numbers) for name, each in told["fields"].items()}
        return getattr(kind, "of_fields", kind)(**fields)
    if "keys" in told:
        keys, values = unpack(told["keys"], numbers), unpack(told["values"], numbers)
        return dict(zip(keys, values, strict=True))
    if "complex" in told:
        return complex(*told["complex"])
    if "texts" in told:
        return np.array(told["texts"], dtype=str)[unpack(told["at"], numbers)]
    if "sparse" in told:
        arrays = unpack(told["arrays"], numbers)
        return _MATRICES[told["sparse"]](arrays, shape=told["size"])
    size = int(np.prod(told["shape"])) * (2 if told["kind"] == "c" else 1)
    part = np.array(numbers[told["first"] : told["first"] + size])
    values = part.view(complex) if told["kind"] == "c" else part.astype(_TYPES[told["kind"]])
    return values.reshape(told["shape"])


def _kind_of(told: Mapping[str, Any]) -> Any:
    """The class of a record: of the library, or of the user, from its module or the only one."""
    if "lacks" in told:
        raise NotRebuiltError(f"of {told['of']}: {told['lacks']}")
    name, kinds = told["of"], _KINDS.get(told["of"], {})
    known = {of: kind for of, kind in kinds.items() if _is_of_library(of) != ("from" in told)}
    module = told.get("from", "")
    if module in known or len(known) == 1:
        return known.get(module, next(iter(known.values())))
    raise NotRebuiltError(
        f"of the class {name} of {module or _LIBRARY}, which is not defined here; import "
        "the file that defines it first"
    )


def _is_of_library(module: str) -> bool:
    return module.partition(".")[0] == _LIBRARY


def packed(value: Any, parts: list[FloatArray]) -> Any:
    """As `pack`, of a record; of one that archives do not hold its class and the reason."""
    before = len(parts)
    try:
        return pack(value, parts)
    except NotStoredError as error:
        del parts[before:]
        return {"of": type(value).__name__, "fields": {}, "lacks": str(error)}


def plain(told: Any) -> Any:
    """What a record tells without its classes: mappings from names, with ``type``."""
    if isinstance(told, list):
        return [plain(each) for each in told]
    if not isinstance(told, dict):
        return told
    if "of" in told:
        return {"type": told["of"]} | {n: plain(each) for n, each in told["fields"].items()}
    if "keys" in told:
        return dict(zip(told["keys"], map(plain, told["values"]), strict=True))
    return complex(*told["complex"]) if "complex" in told else told


def copied(value: Any) -> Any:
    """A value as an archive gives it back, to the layout in memory, which rounds sums."""
    parts: list[FloatArray] = []
    told = pack(value, parts)
    return unpack(told, joined(parts))


def joined(parts: list[FloatArray]) -> FloatArray:
    """The row of numbers of its parts."""
    return np.concatenate([np.zeros(0), *parts])


def digest_of(numbers: FloatArray, told: Any) -> str:
    """Checksum of numbers and of what JSON tells of them."""
    digest = sha256(np.ascontiguousarray(numbers).tobytes())
    digest.update(json.dumps(told).encode())
    return digest.hexdigest()
