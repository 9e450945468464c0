"""The request behind a dataset: what to follow, its JSON, and checks of its arguments."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from symhbm.balance import HarmonicBalance
from symhbm.numerics import RADIANS, FloatArray, check

Peaks = Literal["largest", "each"]
Angles = Literal["newton", "rootfinder", "ipopt"]
_NUMBERED = re.compile(r"(.+)\[(.*)\]")
"""A name of a parameter with the number of one contact or blade."""
_ROUND_OFF = 1e-9
"""Distance from an end of the band, relative to its largest value, that is round-off."""
OF_PEAKS = ("coefficient", "amplitude", "dof")
"""Variables that verify peaks, without ``peak_``, beside the parameter at the peak."""
_STABILITY = frozenset({"growth_rate", "stability", "stability_method"})
_JSON_KEYS = {"per_dof": "each"}
"""Keys of fields in JSON where they differ: those of archives that exist."""
_OF_UNFORCED = ("unforced", "mode", "nodal_diameter", "dof", "amplitudes", "amplitude")
"""Fields that responses to a force do not have, nor their archives."""


@dataclass(frozen=True)
class Request:
    """What to follow: the parameter ``name`` over a ``band``, from its first to its last value.

    ``name`` is ``"frequency"`` (in Hz) or a parameter, set for all blades or contacts or for that
    at ``index`` alone, at a constant ``frequency`` [Hz]. ``at``: values at which solutions are
    wanted instead of the points of the path. ``per_dof``: peaks of every degree of freedom.
    ``may_fold``: whether there may be several solutions at one value. ``stability``: whether the
    stability of every solution is wanted. ``phase_resonances``: whether they are located and become
    points. ``accuracy``: largest relative error of the displacements
    by truncation of the harmonics.
    ``keep``: names of the dataset to keep, None for all. ``angles``: the solver where the switching
    angles are unknowns too. ``machine_code``: whether that evaluates the equations, to the same
    bits, and no part of what is asked for.

    ``unforced``: what is followed without a force, a key of `symhbm.results.variables.OF_UNFORCED`,
    None for responses. Of a nonlinear mode, ``name`` is ``"amplitude"``, that [m] of the first
    harmonic at the degree of freedom ``dof``, or a parameter, at a constant ``amplitude``; ``mode``
    counts from the lowest, in the wave of a ``nodal_diameter`` where there is one. Of limit cycles,
    several modes may be searched, over ``amplitudes`` [m]; ``name`` is ``"amplitude"`` where no
    parameter moves.
    """

    name: str
    band: tuple[float, float]
    at: FloatArray | None = None
    frequency: float | None = None
    index: int | None = None
    per_dof: bool = False
    may_fold: bool = False
    stability: bool = False
    phase_resonances: bool = False
    max_points: int = 5000
    accuracy: float | None = None
    keep: tuple[str, ...] | None = None
    angles: str | None = None
    machine_code: bool = False
    unforced: str | None = None
    mode: int | tuple[int, ...] | None = None
    nodal_diameter: int | None = None
    dof: int | None = None
    amplitudes: tuple[float, float] | None = None
    amplitude: float | None = None

    @property
    def unit(self) -> float:
        """The value in continuation (rad/s for a frequency) over that of the user (Hz)."""
        return RADIANS if self.name == "frequency" else 1.0

    @property
    def tells_stability(self) -> bool:
        """Whether stability is wanted, and kept: it takes longer than all else at a point."""
        return self.stability and (self.keep is None or not _STABILITY.isdisjoint(self.keep))

    @property
    def _in_decades(self) -> bool:
        """Whether continuation follows the common logarithm: of amplitudes it does."""
        return self.name == "amplitude"

    def followed(self, values: Sequence[float] | FloatArray) -> FloatArray:
        """Values in continuation from those of the user."""
        array = np.array(values, dtype=float)
        return np.log10(array) if self._in_decades else self.unit * array

    def shown(self, values: Sequence[float]) -> FloatArray:
        """Values in the user's unit; the ends of the band come back without round-off."""
        array = np.array(values, dtype=float)
        shown = 10.0**array if self._in_decades else array / self.unit
        for edge, end in zip(self.band, self.followed(self.band), strict=True):
            shown[array == end] = edge
        return shown

    def to_json(self, harmonics: tuple[int, ...]) -> dict[str, Any]:
        """Entries of the attribute ``followed`` but the grid, which is a coordinate.

        ``harmonics`` are those of the problem.
        """
        entries = {
            _JSON_KEYS.get(entry.name, entry.name): getattr(self, entry.name)
            for entry in fields(self)
            if entry.name not in ("at", "machine_code")
        }
        for name in _OF_UNFORCED:
            if entries[name] is None:
                del entries[name]
        return entries | {
            "peaks": "each" if self.per_dof else "largest",
            "grid": self.at is not None,
            "harmonics": harmonics,
        }

    @classmethod
    def of(cls, entries: Mapping[str, Any], at: FloatArray | None) -> "Request":
        """The request of the entries that `to_json` gives, with values ``at`` a grid."""
        keys = {entry.name: _JSON_KEYS.get(entry.name, entry.name) for entry in fields(cls)}
        values = {name: entries[key] for name, key in keys.items() if key in entries}
        for name, value in values.items():
            values[name] = tuple(value) if isinstance(value, list) else value
        values["at"] = at
        return cls(**values)


def check_axis(
    problem: HarmonicBalance, parameter: str, band: Any, at: ArrayLike | None
) -> dict[str, Any]:
    """The fields of a request that say which parameter moves, between which values.

    ``parameter`` is a name, or with a number one of a contact or blade: ``"normal_load[2]"``.
    """
    numbered = _NUMBERED.fullmatch(parameter) if isinstance(parameter, str) else None
    name = problem.parameter_name(numbered[1] if numbered else parameter)
    if isinstance(problem.parameters[name], int):
        raise ValueError(f"parameter={parameter!r}: expected a parameter that is no integer")
    index, last = None, np.size(problem.parameters[name]) - 1
    if numbered:
        if not problem.model.dims_of(name):
            raise ValueError(f"parameter={parameter!r}: expected {name!r}, it has one value")
        index = int(numbered[2]) if numbered[2].isdecimal() else -1
        if not 0 <= index <= last:
            raise ValueError(f"parameter={parameter!r}: expected a number from 0 to {last} in []")
    about = problem.model.about(name)
    edges = check_band("band", band, about.followed, f" [{about.units}]")
    return dict(name=name, band=edges, at=check_grid(at, edges), index=index)


def check_band(name: str, band: Any, bound: str, unit: str) -> tuple[float, float]:
    """Two different values within a ``bound`` of `symhbm.numerics.check`."""
    expected = f"{name}={check.shown(band)}: expected two different values (first, last){unit}"
    if band is None:
        raise TypeError(expected)
    edges = check.array(name, band, bound)
    if edges.shape != (2,) or edges[0] == edges[1]:
        grid = edges.ndim == 1 and edges.size > 2
        hint = "; at= asks for given ones between them" if grid else ""
        raise ValueError(f"{expected}{hint}")
    return float(edges[0]), float(edges[1])


def check_grid(at: ArrayLike | None, band: tuple[float, float]) -> FloatArray | None:
    """Ascending values within a band, None for None; values at an end to round-off become it."""
    if at is None:
        return None
    grid = check.array("at", at)
    for end in band:
        grid = np.where(np.abs(grid - end) <= _ROUND_OFF * max(map(abs, band)), end, grid)
    if grid.ndim != 1 or grid.size == 0 or np.any(np.diff(grid) <= 0):
        raise ValueError(f"at={check.shown(at)}: expected a sequence of strictly ascending values")
    low, high = sorted(band)
    if grid[0] < low or grid[-1] > high:
        edges = check.told_apart(low, high, float(grid[0]), float(grid[-1]))
        raise ValueError(
            f"at={check.shown(at)}: expected values within the band "
            f"{edges[0]} to {edges[1]}, got {edges[2]} to {edges[3]}"
        )
    return grid


def check_keep(
    keep: Iterable[str] | None, verifiable: bool, name: str, accuracy: float | None
) -> tuple[str, ...] | None:
    """Names to keep, sorted, None for all; TypeError unless they are names.

    ``verifiable`` adds those that verify the peaks of a response along ``name``.
    """
    verifiable = check.flag("verifiable", verifiable)
    if keep is None:
        return None
    names = [keep] if isinstance(keep, str) or not isinstance(keep, Iterable) else [*keep]
    if isinstance(keep, str) or not all(isinstance(name, str) for name in names):
        raise TypeError(f"keep={check.shown(keep)}: expected a sequence of names")
    if verifiable:
        more = () if accuracy is None else ("highest_harmonic",)
        names += [f"peak_{variable}" for variable in (name, *OF_PEAKS, *more)]
    return tuple(sorted(set(names)))
