"""Results of the random problems, and those of another version, which a file holds.

The file is made by the library that is imported. That of another version in ``../before``:
``PYTHONPATH=../before:. python -P -m tests.stored.results tests/stored/before_speed.npz``
"""

import sys
import warnings
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

import symhbm as sh
from tests.stored.problems import KINDS, OF_EACH, Case, case

BEFORE_SPEED = Path(__file__).parent / "before_speed.npz"
"""Results of the last version before loops were compiled: commit 147a5cb."""


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


def write(path: Path) -> None:
    """Compute all problems and write what is found along their paths."""
    columns: dict[str, list[np.ndarray]] = {field.name: [] for field in fields(Found)}
    for kind in KINDS:
        for number in range(OF_EACH):
            of_path, _ = found(case(kind, number))
            for name, values in columns.items():
                values.append(getattr(of_path, name))
    arrays: dict[str, Any] = {name: np.concatenate(values) for name, values in columns.items()}
    arrays |= {f"{name}_size": [len(v) for v in values] for name, values in columns.items()}
    np.savez_compressed(path, **arrays)


def read(path: Path) -> dict[tuple[str, int], Found]:
    """Stored results by kind and number."""
    with np.load(path) as file:
        parts = [
            np.split(file[field.name], np.cumsum(file[f"{field.name}_size"])[:-1])
            for field in fields(Found)
        ]
    names = [(kind, number) for kind in KINDS for number in range(OF_EACH)]
    return {name: Found(*each) for name, each in zip(names, zip(*parts, strict=True), strict=True)}


if __name__ == "__main__":
    write(Path(sys.argv[1]))
