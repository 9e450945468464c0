"""`campbell`: natural frequencies over the speed of rotation, and where engine orders meet them."""

from collections.abc import Callable, Iterable
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from symhbm.model import Structure
from symhbm.model.cyclic import RotatingModel
from symhbm.model.linear import natural_modes_of
from symhbm.numerics import ComplexArray, FloatArray, bracketed_root, check
from symhbm.response.disks.natural_modes import both_senses, waves_of

_SPARE = 3
"""Modes above those asked for, which may change places with them."""
_ALIKE = 0.8
"""MAC of modes at neighbouring speeds from which on they are the same; between others more are."""
_NEARER = 1e-3
"""Share of the MAC that a distance of frequencies is worth."""
_HALVED = 7
"""Most halvings of an interval of speeds: a veering may be sharper than any grid."""


class _Modes(NamedTuple):
    """Frequencies (n,) [Hz] and modes (n_dof, n) of a wave, and the momentum ``M x`` of each.

    ``senses`` (n,) are -1 of whirls that the rotation has overtaken: their shapes are the conjugate
    ones, those of the same motion at a negative frequency.
    """

    frequencies: FloatArray
    shapes: ComplexArray
    momentum: ComplexArray
    senses: FloatArray

    def rank(self, mode: int) -> int:
        """How many frequencies are below that of a mode."""
        return int(np.count_nonzero(self.frequencies < self.frequencies[mode]))

    def chosen(self, order: np.ndarray) -> "_Modes":
        shapes, momentum = self.shapes[:, order], self.momentum[:, order]
        return _Modes(self.frequencies[order], shapes, momentum, self.senses[order])

    def seen(self, senses: FloatArray) -> "_Modes":
        """The same with these senses, of modes of positive ones."""
        shapes = np.where(senses > 0, self.shapes, self.shapes.conj())
        momentum = np.where(senses > 0, self.momentum, self.momentum.conj())
        return _Modes(self.frequencies, shapes, momentum, senses)


def campbell(
    structure: Structure,
    speeds: Iterable[float],
    *,
    orders: Iterable[int] = (),
    nodal_diameter: int | Iterable[int] | None = None,
    count: int | None = None,
    stuck: bool = False,
) -> xr.Dataset:
    """Natural frequencies over the speed of rotation, mode by mode, and their critical speeds.

    Parameters
    ----------
    structure
        A `RotatingModel`, a `Sector` of one, or any structure with matrices, which speed leaves as
        they are.
    speeds
        Speeds [1/min], two or more. Some are added where modes change quickly, so that each can be
        followed by its shape.
    orders
        Engine orders whose lines ``order * speed / 60`` are looked for crossings with. In a sector
        an order meets the waves it drives alone, those of ``order mod n_sectors``.
    nodal_diameter
        Waves of a sector; None for 0 to N / 2, and where Coriolis forces act for those of the
        other sense, too, which are negative: their modes differ then.
    count
        Number of modes at the first speed, from the lowest, that are followed; None for 5, or all
        of a smaller structure.
    stuck
        With contacts stuck and closed, as springs, see `natural_modes`; without they are open.

    Returns
    -------
    Dataset with ``frequency`` (speed, mode) [Hz], of a sector (speed, nodal_diameter, mode);
    ``mac``, by how much each mode is that at the speed before, 1 for equal shapes (NaN at the
    first); along ``crossing``, ascending, ``crossing_speed`` [1/min], ``crossing_frequency`` [Hz],
    ``crossing_order``, ``crossing_mode`` and ``crossing_nodal_diameter``. `symhbm.plot.campbell`
    and `symhbm.plot.interference` draw it.

    Raises
    ------
    TypeError, ValueError
        For bad arguments, and at the first speed whose modes cannot be computed, as some motion
        grows there for example.

    Notes
    -----
    A mode is followed by the modal assurance criterion in the mass matrix. Where shapes change or
    modes seem to cross, intervals of speeds are halved, seven times at most: two modes that veer
    away from each other exchange their shapes and keep their order. A veering that is sharper than
    that is a crossing here, each mode keeps its shape. A line that meets one mode twice between
    neighbouring speeds is not seen there: give more of them.

    Examples
    --------
    A blade that stiffens with the speed, and its critical speeds under two engine orders:

    >>> import symhbm as sh
    >>> blade = sh.Model([[1.0]], [[0.5]], [[1e4]])
    >>> rotor = sh.RotatingModel(blade, stiffness={0: [[1e4]], 600: [[2e4]]})
    >>> lines = sh.campbell(rotor, [0, 300, 600], orders=[2, 3], count=1)
    >>> lines.crossing_speed.values.round(2)
    array([375.51])
    """
    check.instance("structure", structure, Structure, "a Model or a Sector")
    structure = structure.without_rule()
    at = np.unique(check.array("speeds", [*speeds], "non-negative"))
    if len(at) < 2:
        raise ValueError(f"speeds={check.shown(at)}: expected two or more different ones")
    size = structure.n_dof
    count = min(5, size) if count is None else check.integer("count", count, 1, size)
    wanted = [check.integer("orders", order, 1) for order in orders]
    stuck = check.flag("stuck", stuck)
    both = both_senses(_at(structure, at[-1]))
    waves = waves_of(structure, nodal_diameter, both)
    n_modes = min(count + _SPARE, structure.n_dof)

    def modes(speed: float, wave: int | None) -> _Modes:
        try:
            return _modes(_at(structure, speed), wave, n_modes, stuck)
        except ValueError as error:
            of_wave = "" if wave is None else f" and {wave} nodal diameters"
            raise ValueError(f"speeds: at {speed:.6g} 1/min{of_wave} {error}") from error

    least = min(len(modes(at[0], wave).frequencies) for wave in waves)
    if least < count:
        raise ValueError(f"count={count}: expected at most {least}, there are no more modes")
    found, alike = _followed(at.tolist(), waves, modes, count)
    crossings = [
        crossing
        for order in wanted
        for k, wave in enumerate(waves)
        if _drives(structure, order, wave, both)
        for crossing in _crossings(found, k, wave, order, count, modes)
    ]
    dataset = _dataset(found, alike, waves, count, sorted(crossings))
    dataset = dataset.assign_coords(order=("order", wanted, _about("engine order", "1")))
    return dataset if waves == [None] else dataset.assign_attrs(n_sectors=structure.n_sectors)  # type: ignore[attr-defined]


def _at(structure: Structure, speed: float) -> Structure:
    turning = structure if isinstance(structure, RotatingModel) else None
    inside = getattr(structure, "structure", None)
    turning = structure if isinstance(inside, RotatingModel) else turning
    return structure if turning is None else turning.at(speed)  # type: ignore[attr-defined]


def _drives(structure: Structure, order: int, wave: int | None, both: bool) -> bool:
    if wave is None:
        return True
    senses = (wave,) if both else (wave, -wave)
    return any((order - n) % structure.n_sectors == 0 for n in senses)  # type: ignore[attr-defined]


def _modes(structure: Structure, wave: int | None, n: int, stuck: bool) -> _Modes:
    frequencies, shapes = natural_modes_of(structure, wave, n, stuck)
    own = shapes if structure.kept is None else shapes[structure.kept]
    momentum = structure.matrices(wave).mass_matrix @ own
    return _Modes(frequencies, own, momentum, np.ones(len(frequencies)))


def _followed(
    speeds: list[float],
    waves: list[int | None],
    modes: Callable[[float, int | None], _Modes],
    count: int,
) -> tuple[list[tuple[float, list[_Modes]]], list[np.ndarray]]:
    """Modes at all speeds, in one order throughout, and how alike each is to the one before."""
    found = [(speeds[0], [modes(speeds[0], wave) for wave in waves])]
    alike = [np.full((len(waves), count), np.nan)]
    # The last is the next; what is halved stays beyond it.
    ahead = [(speed, 0) for speed in reversed(speeds[1:])]
    while ahead:
        speed, halved = ahead.pop()
        last_speed, last = found[-1]
        new = [modes(speed, wave) for wave in waves]
        pairs = [_paired(*each) for each in zip(last, new, waves, strict=True)]
        mac = np.array([of_wave[:count] for _, of_wave, _ in pairs])
        ordered = [
            after.chosen(order).seen(senses)
            for after, (order, _, senses) in zip(new, pairs, strict=True)
        ]
        # Modes that seem to cross may veer in between.
        crosses = any(map(_changes_order, last, ordered))
        if (mac.min() < _ALIKE or crosses) and halved < _HALVED:
            ahead += [(speed, halved + 1), ((last_speed + speed) / 2, halved + 1)]
            continue
        found.append((speed, ordered))
        alike.append(mac)
    return found, alike


def _paired(
    before: _Modes, after: _Modes, wave: int | None
) -> tuple[np.ndarray, FloatArray, FloatArray]:
    """Which mode after each one before is, how alike both are, and in which sense."""
    from scipy.optimize import linear_sum_assignment  # slow to import

    senses = (1.0, -1.0) if wave is None else (1.0,)
    shapes = [after.shapes, after.shapes.conj()][: len(senses)]
    mac = [np.abs(before.momentum.conj().T @ of) ** 2 for of in shapes]
    signed = (before.senses * before.frequencies)[:, None]
    far = [np.abs(signed - sense * after.frequencies) for sense in senses]
    # A mode and its conjugate may be alike: the nearer one goes on.
    worth = np.array(mac) - _NEARER * np.array(far) / max(np.max(far), 1e-300)
    row, column = linear_sum_assignment(-worth.max(axis=0))
    chosen = worth.argmax(axis=0)[row, column]
    return column, np.array(mac)[chosen, row, column], np.array(senses)[chosen]


def _changes_order(before: _Modes, after: _Modes) -> bool:
    return bool(np.any(np.argsort(before.frequencies) != np.argsort(after.frequencies)))


def _crossings(
    found: list[tuple[float, list[_Modes]]],
    k: int,
    wave: int | None,
    order: int,
    count: int,
    modes: Callable[[float, int | None], _Modes],
) -> list[tuple]:
    """Crossings of a line with the modes of one wave: speed, frequency, order, mode, wave."""
    result = []
    for (low, before), (high, after) in pairwise(found):
        for mode in range(count):
            ends = before[k].chosen(np.array([mode])), after[k].chosen(np.array([mode]))
            ranks = before[k].rank(mode), after[k].rank(mode)

            def excess(speed: float, ends: tuple = ends, ranks: tuple = ranks):
                between = modes(speed, wave)
                # Frequencies in their order are continuous; only modes that cross go by shape.
                chosen = between if ranks[0] == ranks[1] else _nearest(between, ends)
                own = chosen.frequencies[ranks[0] if chosen is between else 0]
                return own - order * speed / 60

            first, last = (
                end.frequencies[0] - order * at / 60
                for end, at in zip(ends, (low, high), strict=True)
            )
            if first >= 0 > last or first < 0 <= last:
                speed = bracketed_root(excess, low, high)
                result.append((speed, order * speed / 60, order, mode, wave))
    return result


def _nearest(modes: _Modes, ends: tuple[_Modes, _Modes]) -> _Modes:
    """The mode that is most alike to one between two others."""
    shapes = modes.shapes
    mac = sum(
        np.maximum(*(np.abs(end.momentum.conj().T @ of)[0] for of in (shapes, shapes.conj()))) ** 2
        for end in ends
    )
    return modes.chosen(np.array([int(np.argmax(mac))]))


def _dataset(
    found: list[tuple[float, list[_Modes]]],
    alike: list[np.ndarray],
    waves: list[int | None],
    count: int,
    crossings: list[tuple],
) -> xr.Dataset:
    whole = waves == [None]
    dims = ("speed", "mode") if whole else ("speed", "nodal_diameter", "mode")
    frequency = np.array([[wave.frequencies[:count] for wave in each] for _, each in found])
    mac = np.array(alike)
    coordinates: dict[str, Any] = {
        "speed": ("speed", [speed for speed, _ in found], _about("speed of rotation", "min-1")),
        "mode": ("mode", np.arange(count), _about("mode, counted at the lowest speed", "1")),
    }
    if not whole:
        about = _about("nodal diameters, negative in the other sense", "1")
        coordinates["nodal_diameter"] = ("nodal_diameter", np.array(waves), about)
    variables = {
        "frequency": (dims, frequency[:, 0] if whole else frequency, _about(_NATURAL, "Hz")),
        "mac": (dims, mac[:, 0] if whole else mac, _about(_MAC, "1")),
    }
    columns = list(zip(*crossings, strict=True)) or [[]] * len(_CROSSING)
    for (name, kind, long_name, units), column in zip(_CROSSING, columns, strict=True):
        if name != "nodal_diameter" or not whole:
            about = _about(long_name, units)
            variables[f"crossing_{name}"] = ("crossing", np.array(column, dtype=kind), about)
    return xr.Dataset(variables, coordinates)


_NATURAL = "natural frequency"
_MAC = "modal assurance criterion with the mode at the speed before"
_CROSSING = (
    ("speed", float, "speed at which an engine order meets a mode", "min-1"),
    ("frequency", float, "natural frequency there", "Hz"),
    ("order", int, "engine order", "1"),
    ("mode", int, "mode that it meets", "1"),
    ("nodal_diameter", int, "nodal diameters of the mode", "1"),
)


def _about(long_name: str, units: str) -> dict[str, str]:
    return {"long_name": long_name, "units": units}
