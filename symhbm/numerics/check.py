"""Values at the boundary: their types, and checks of them.

Each error names the argument, its value and what is allowed.
"""

import sys
import warnings
from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from numbers import Integral
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complexfloating[Any, Any]]
Table = dict[str, Any]
"""Arrays by the names of a dataset."""

_Kind = TypeVar("_Kind")

RADIANS = 2 * np.pi
"""Angular frequency [rad/s] of 1 Hz."""

_BOUNDS = {
    "positive": (lambda a: a > 0, "finite and > 0"),
    "non-negative": (lambda a: a >= 0, "finite and >= 0"),
    "any": (lambda a: np.isfinite(a), "finite"),
}
_MANY, _FEW = 8, 3
"""Values that are not shown all, and how many of them are."""
_MOST_NAMES, _NEAREST = 30, 5
"""Allowed names that are listed all, and how many of more are."""


def warn(text: str, category: type[Warning] = UserWarning) -> None:
    """Warn at the line of the user, who called this package by however many functions."""
    frame, depth = sys._getframe(1), 2
    while frame.f_back is not None and _is_inside(frame.f_globals.get("__name__", "")):
        frame, depth = frame.f_back, depth + 1
    warnings.warn(text, category, stacklevel=depth)


def _is_inside(module: str) -> bool:
    """Whether it is of this package, or stands between its functions."""
    return module.partition(".")[0] in (__name__.partition(".")[0], "contextlib")


def shown(value: object) -> str:
    """Short text of a bad value."""
    value = value.item() if isinstance(value, (np.floating, np.integer)) else value
    text = " ".join(repr(value).split())
    return text if len(text) <= 80 else text[:77] + "..."


def brief(value: object, words: str = "values") -> str:
    """Text of a value, of more than eight the first three and how many there are."""
    if isinstance(value, np.ndarray) and value.ndim == 1:
        value = value.tolist()
    if isinstance(value, np.ndarray):
        return f"array of shape {value.shape}"
    if isinstance(value, Mapping):
        texts = [f"{key!r}: {brief(entry)}" for key, entry in value.items()]
        return "{" + _joined(texts, "entries") + "}"
    if isinstance(value, (list, tuple)) and len(value) > _MANY:
        left, right = repr(type(value)())
        return left + _joined([*map(brief, value)], words) + right
    return repr(value.item() if isinstance(value, np.generic) else value)


def _joined(texts: list[str], words: str) -> str:
    if len(texts) > _MANY:
        texts = [*texts[:_FEW], f"... {len(texts)} {words}"]
    return ", ".join(texts)


def array(name: str, value: ArrayLike, bound: str = "any") -> FloatArray:
    """Return ``value`` as a float array whose entries satisfy ``bound``.

    Raises
    ------
    TypeError
        If it does not hold real numbers.
    ValueError
        If an entry is NaN, infinite or out of bound.
    """
    allowed, words = _BOUNDS[bound]
    try:
        result = np.asarray(value)
        if result.dtype.kind not in "iuf":
            raise TypeError
        result = result.astype(float)
    except (TypeError, ValueError):
        raise TypeError(f"{name}={shown(value)}: expected real numbers, {words}") from None
    bad = ~(np.isfinite(result) & allowed(result))
    if bad.any():
        where = "" if result.ndim == 0 else f" (entry {np.argwhere(bad)[0].tolist()} is not)"
        raise ValueError(f"{name}={shown(value)}: expected values {words}{where}")
    return result


def scalar(name: str, value: ArrayLike, bound: str = "any") -> float:
    """Return ``value`` as one float that satisfies ``bound``; raises as `array`."""
    result = array(name, value, bound)
    if result.ndim != 0:
        raise ValueError(f"{name}={shown(value)}: expected one number, got shape {result.shape}")
    return float(result)


def one_or_each(
    name: str, value: ArrayLike, size: int, of_what: str, bound: str = "any"
) -> FloatArray:
    """Return a read-only array of ``size`` values from one value or one per ``of_what``."""
    result = array(name, value, bound)
    if result.ndim > 1 or (result.ndim == 1 and result.size != size):
        raise ValueError(
            f"{name}={shown(value)}: expected one value or {size} (one per {of_what}), "
            f"got shape {result.shape}"
        )
    result = result.copy() if result.ndim else np.full(size, result)
    result.setflags(write=False)
    return result


def integer(name: str, value: object, minimum: int | None = None, maximum: int | None = None):
    """Return ``value`` as an int within the bounds (both included)."""
    words = "an integer"
    if minimum is not None and maximum is not None:
        words += f" from {minimum} to {maximum}"
    elif minimum is not None:
        words += f" >= {minimum}"
    message = f"{name}={shown(value)}: expected {words}"
    if isinstance(value, (bool, str)):
        raise TypeError(message)
    if not isinstance(value, Integral):
        number = array(name, value)  # type: ignore[arg-type]
        if number.ndim or number != np.round(number):
            raise ValueError(message)
    number = int(value)  # type: ignore[call-overload]
    if (minimum is not None and number < minimum) or (maximum is not None and number > maximum):
        raise ValueError(message)
    return number


def text(name: str, value: object) -> str:
    """Return a text; raises TypeError."""
    if not isinstance(value, str):
        raise TypeError(f"{name}={shown(value)}: expected text")
    return value


def instance(name: str, value: object, kind: type[_Kind], words: str) -> _Kind:
    """Return ``value``; raise TypeError unless it is of a type, which ``words`` name."""
    if not isinstance(value, kind):
        raise TypeError(f"{name}={shown(value)}: expected {words}")
    return value


def flag(name: str, value: object) -> bool:
    """Return ``value``; raise TypeError unless it is True or False."""
    if not isinstance(value, (bool, np.bool_)):
        raise TypeError(f"{name}={shown(value)}: expected True or False")
    return bool(value)


def known(name: str, allowed: Iterable[str], what: str = "parameter") -> None:
    """Raise a KeyError that lists the allowed names and the nearest one unless ``name`` is one."""
    allowed = list(allowed)
    if name not in allowed:
        near = get_close_matches(str(name), allowed, n=_NEAREST, cutoff=0.4)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        listed = ", ".join(allowed) or "none"
        if len(allowed) > _MOST_NAMES:
            listed = ", ".join([*(near or allowed[:_NEAREST]), f"... {len(allowed)} names"])
        raise KeyError(f"{name!r} is no {what}; allowed: {listed}{hint}")


def keywords(given: Mapping[str, Any], allowed: Iterable[str], function: str) -> None:
    """Raise a TypeError for a keyword that a function does not take: which it has, the nearest."""
    allowed = list(allowed)
    for name, value in given.items():
        if name in allowed:
            continue
        near = get_close_matches(name, allowed, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise TypeError(
            f"{name}={shown(value)}: unexpected argument of {function}; expected one of "
            f"{', '.join(allowed)}{hint}"
        )


def one_of(name: str, value: object, allowed: Iterable[str]) -> str:
    """Return ``value``; raise a ValueError that lists the allowed words unless it is one."""
    allowed = list(allowed)
    if not isinstance(value, str) or value not in allowed:
        raise ValueError(f"{name}={shown(value)}: expected one of {', '.join(map(repr, allowed))}")
    return str(value)


def told_apart(*values: float) -> list[str]:
    """Short texts of numbers, with enough digits to distinguish different ones."""
    several = [float(value) + 0.0 for value in values]  # no zero has a sign
    texts: list[str] = []
    for digits in range(6, 18):
        texts = [f"{value:.{digits}g}" for value in several]
        if len(set(texts)) == len(set(several)):
            break
    return texts
