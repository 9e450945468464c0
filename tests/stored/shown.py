"""What is shown, as plain data: pictures, pages and texts, and how far they are from stored ones.

``python -m tests.stored.shown`` writes what is shown now into the files beside this one, whose
difference tells what has changed.
"""

import json
import re
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.colors import Colormap

from tests.pages import PACKED, unpacked

FOLDER = Path(__file__).parent
FEW = 8
"""Numbers of an array that are stored one by one; of longer ones the ends, or places of a line."""
ALONG = np.linspace(0, 1, 9)
NEAR, NEAR_A_LINE = 1e-6, 2e-3
"""Relative differences that are allowed, the second of lines, whose points may be others."""
ROUND_OFF = 1e-9
"""Numbers of texts below it are round-off."""
CHANGING = re.compile(
    r"symhbm \d.*|at most (?:0\.0e\+00|[\d.]+e-1\d)[^\n]*|(?:\d+ of )?\d+ (?:stored )?points"
    r"|points +\d+|\d+, all converged|(?:machine code and )?the virtual machine of CasADi"
    r"|machine code"
)
"""Parts of texts that tell versions, round-off, what evaluates, and how many points a path has."""
PLACES = {"n", "row", "point", "n_points", "rejected_steps", "linear_solves", "iterations"}
"""Names of numbers and counts of points, and of work."""
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")


def told(value: Any) -> Any:
    """A value as lists, mappings, texts and numbers."""
    if is_dataclass(value) and not isinstance(value, type):
        return {one.name: told(getattr(value, one.name)) for one in fields(value)}
    if hasattr(value, "_asdict"):
        named = value._asdict()
        if named.get("kind") in ("line", "band") and np.size(named["data"][0]) > FEW:
            named["data"] = [along(named["data"][0], y) for y in named["data"][1:]]
        if named.get("kind") == "cells":
            named["mean"] = {"drawn": float(np.nanmean(named["data"][2]))}
        return told(named)
    if isinstance(value, Colormap):
        return told(value(np.linspace(0, 1, 3)))
    if isinstance(value, dict):
        return {str(key): told(one) for key, one in value.items() if key not in PLACES}
    if isinstance(value, str) and PACKED.match(value):
        return ends(unpacked(value))
    if isinstance(value, str):
        return " ".join(CHANGING.sub("", value).split())
    if isinstance(value, bool | None):
        return value
    if isinstance(value, tuple):
        return [told(one) for one in value]
    try:
        array = np.asarray(value)
    except ValueError:  # parts of other lengths
        return [told(one) for one in value]
    if array.dtype.kind not in "iufb" or (array.ndim == 0 and array.dtype.kind == "O"):
        return repr(value) if array.ndim == 0 else [told(one) for one in value]
    if array.ndim == 0:
        return float(f"{float(array):.9g}")
    return ends(array) if array.size > FEW else [told(one) for one in array.tolist()]


def ends(array: np.ndarray) -> dict[str, Any]:
    """The least and the largest number, of places each of both, and whether all are known."""
    if array.ndim > 1 and array.shape[-1] == 2 and array.size:
        return {"places": [ends(array[..., i]) for i in (0, 1)]}
    known = array[np.isfinite(array)].astype(float)
    both = [known.min(), known.max()] if known.size else []
    return {"broken": known.size < array.size, "drawn": told(both)}


def along(x: Any, y: Any) -> Any:
    """Places that divide a line evenly, in the size that it has, and whether it is broken."""
    if np.ndim(y) == 2:
        return [along(x, each) for each in np.transpose(y)]
    points = np.stack(np.broadcast_arrays(x, y), axis=-1).astype(float)
    known = points[np.isfinite(points).all(axis=1)]
    if not len(known):
        return {"broken": True, "drawn": []}
    scale = np.ptp(known, axis=0)
    steps = np.hypot(*(np.diff(known, axis=0) / np.where(scale > 0, scale, 1)).T)
    length = np.append(0.0, np.cumsum(steps))
    places = [told(np.interp(ALONG * length[-1], length, of)) for of in known.T]
    return {"broken": len(known) < len(points), "drawn": places}


def same(now: Any, before: Any, where: str = "", near: float = NEAR) -> None:
    """Assert that what is told is what was, numbers up to small differences."""
    if isinstance(before, dict):
        assert isinstance(now, dict), where
        assert sorted(now) == sorted(before), (where, {*now} ^ {*before})
        for key, one in before.items():
            same(now[key], one, f"{where}.{key}", NEAR_A_LINE if key == "drawn" else near)
    elif isinstance(before, list) and before and all(isinstance(one, float) for one in before):
        np.testing.assert_allclose(
            np.array(now, dtype=float), before, rtol=near, err_msg=where,
            atol=near * np.nanmax(np.abs(before), initial=0, where=np.isfinite(before)) + 1e-12,
        )  # fmt: skip
    elif isinstance(before, list):
        assert len(now) == len(before), where
        for i, (one, other) in enumerate(zip(now, before, strict=True)):
            same(one, other, f"{where}[{i}]", near)
    elif isinstance(before, str):
        assert NUMBER.sub("#", now) == NUMBER.sub("#", before), where
        pairs = zip(NUMBER.findall(now), NUMBER.findall(before), strict=True)
        for one, other in (map(float, pair) for pair in pairs):
            small = max(abs(one), abs(other)) < ROUND_OFF
            assert small or np.isclose(one, other, rtol=1e-4, atol=0), (where, one, other)
    elif isinstance(before, float):
        np.testing.assert_allclose(now, before, rtol=near, atol=1e-12, err_msg=where)
    else:
        assert now == before, where


def read(name: str) -> dict[str, Any]:
    """What was told under the names of cases."""
    return json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))


def write(name: str, cases: dict[str, Any]) -> None:
    """Store what is told of cases, a line each."""
    lines = [
        f"{json.dumps(key)}: {json.dumps(one, separators=(',', ':'))}" for key, one in cases.items()
    ]
    text = "{\n" + ",\n".join(lines) + "\n}\n"
    (FOLDER / f"{name}.json").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    from tests.battery import test_every_result as results
    from tests.plot import test_same_pictures as pictures

    write("results", {name: results.shown(name) for name in results.RESULTS})
    write("pictures", {name: pictures.shown(name) for name in pictures.PICTURES})
