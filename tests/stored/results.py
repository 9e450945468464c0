"""Results of the random problems, and those of another version, which a file holds.

The file is made by the library that is imported. That of another version in ``../before``:
``PYTHONPATH=../before:. python -P -m tests.stored.results tests/stored/before_speed.npz``
"""

import sys
import warnings
from collections.abc import Iterable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

import symhbm as sh
from tests.stored.problems import KINDS, OF_EACH, Case, case

BEFORE_SPEED = Path(__file__).parent / "before_speed.npz"
"""Results of the last version before loops were compiled: commit 147a5cb."""
Name = tuple[str, int]
"""The kind and the number of a problem."""
ALL: list[Name] = [(kind, number) for kind in KINDS for number in range(OF_EACH)]


@dataclass(frozen=True)
class Found:
    """What one response is: its peaks, its events and its amplitudes on a grid.

    Frequencies [Hz] and amplitudes [m]; ``amplitude`` (n,) of all values of the grid, all solutions
    there (NaN where there are fewer) and all degrees of freedom, the last ones fastest.
    """

    status: np.ndarray
    peak_frequency: np.ndarray
    peak_amplitude: np.ndarray
    peak_kind: np.ndarray
    event_frequency: np.ndarray
    event_kind: np.ndarray
    event_contact: np.ndarray
    amplitude: np.ndarray


def found(given: Case) -> tuple[Found, Found]:
    """What the library finds with all points of the path, and on the grid alone."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="the curve is incomplete")
        path = sh.frf(given.problem, given.band, progress=False)
        grid = sh.frf(given.problem, given.band, at=given.at, progress=False)
    inner = [dim for dim in ("frequency", "solution", "dof") if dim in grid.amplitude.dims]
    amplitude = grid.amplitude.transpose(*inner).values.ravel()
    return _found(path, amplitude), _found(grid, amplitude)


def _found(response: Any, amplitude: np.ndarray) -> Found:
    names = [field.name for field in fields(Found)]
    given = {name: response[name].values for name in names[1:-1]}
    for name in ("peak_kind", "event_kind"):
        given[name] = given[name].astype(str)
    return Found(np.array([str(response.status.item())]), **given, amplitude=amplitude)


def write(path: Path, names: Iterable[Name] = ALL) -> None:
    """Compute problems and write what is found along their paths."""
    names = [*names]
    results = [found(case(*name))[0] for name in names]
    arrays: dict[str, Any] = dict(zip(("kind", "number"), zip(*names, strict=True), strict=True))
    for field in fields(Found):
        values = [getattr(each, field.name) for each in results]
        arrays[field.name] = np.concatenate(values)
        arrays[f"{field.name}_size"] = [len(each) for each in values]
    np.savez_compressed(path, **arrays)


def read(path: Path) -> dict[Name, Found]:
    """Stored results by kind and number."""
    with np.load(path) as file:
        names = [*zip(file["kind"].tolist(), file["number"].tolist(), strict=True)]
        parts = [
            np.split(file[field.name], np.cumsum(file[f"{field.name}_size"])[:-1])
            for field in fields(Found)
        ]
    return {name: Found(*each) for name, each in zip(names, zip(*parts, strict=True), strict=True)}


if __name__ == "__main__":
    write(Path(sys.argv[1]))
