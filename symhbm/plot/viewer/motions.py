"""Loops of contacts and shapes at peaks and events, stored in advance."""

import json
from collections import Counter
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from symhbm.model.contacts import History
from symhbm.numerics import FloatArray, largest_displacement
from symhbm.plot.contact import contact_of, histories
from symhbm.plot.drawing import motions_of
from symhbm.plot.viewer.packing import packed, plain
from symhbm.results import Description

MOST_MOTIONS, MOST_CHARACTERS = 900, 2_500_000
"""Most motions at peaks and events that a page holds, and most characters that they take."""
_OF_PEAK, _OF_EVENT, _OF_ALL = 16, 4, 400
"""Most contacts whose loops a peak and an event have, and most contacts of all curves together."""
_N_ANGLES = 96
"""About how many points a loop has beside its events."""
_INNER = ("dof", "harmonic", "component")
_FULL = "there is room for those of the highest peaks and the first events alone"


class Motions(NamedTuple):
    """Motions by the number of the mark, and why others are missing, each with a count."""

    of: dict[int, dict[str, Any]]
    missing: Counter[str]


class Budget:
    """What is left of the motions and their characters that a page may hold, in equal parts."""

    def __init__(self, curves: int, share: float = 1.0):
        self._curves, self._motions = curves, int(share * MOST_MOTIONS)
        self._characters = int(share * MOST_CHARACTERS)
        self.contacts = max(2, min(_OF_PEAK, _OF_ALL // max(1, curves)))

    def next(self) -> tuple[int, int]:
        """The motions and characters that the next curve may take."""
        self._curves -= 1
        parts = self._curves + 1
        return -(-self._motions // parts), self._characters // parts

    def take(self, motions: int, characters: int) -> None:
        """Count those that a curve took."""
        self._motions -= motions
        self._characters -= characters


def _size(motion: dict[str, Any]) -> int:
    """About how many characters a motion takes."""
    loops = [side for loop in motion["loops"].values() for side in (*loop["u"], *loop["f"])]
    return sum(map(len, [*loops, motion["shape"]["amplitude"], motion["shape"]["instant"]]))


def motions_at(
    one: xr.Dataset, x: str, marks: list[dict[str, Any]], blades: list[int] | None, budget: Budget
) -> Motions:
    """Motions at the marks of one curve, peaks from the highest on, then events."""
    of: dict[int, dict[str, Any]] = {}
    missing: Counter[str] = Counter()
    stored = [(k, *_coefficient(one, mark)) for k, mark in enumerate(marks)]
    known = [(k, at, part) for k, at, part in stored if part is not None]
    if len(known) < len(marks):
        why = "the archive does not hold the Fourier coefficients there"
        missing[why] += len(marks) - len(known)
    known.sort(key=lambda entry: _first(marks[entry[0]]))
    most, characters = budget.next()
    if len(known) > most:
        missing[_FULL] += len(known) - most
        known = known[:most]
    if not known:
        return Motions(of, missing)
    together = _rows(one, x, [at for _, at, _ in known], [part for *_, part in known])
    loops, why_not = _loops(together, _busiest(one, budget.contacts))
    missing += why_not
    taken = 0
    for row, (k, _, part) in enumerate(known):
        chosen = _contacts(marks[k], loops, row)
        motion = shape_of(one, part, blades)
        motion["loops"] = {str(c): _packed(history) for c, history in chosen.items()}
        if taken + _size(motion) > characters:
            missing[_FULL] += 1
            continue
        taken += _size(motion)
        of[k] = motion
    budget.take(len(of), taken)
    return Motions(of, missing)


def _first(mark: dict[str, Any]) -> tuple[bool, float]:
    """The order in which motions are stored: peaks by their height, then events."""
    return mark["what"] != "peak", -(mark.get("y") or 0.0)


def _coefficient(
    one: xr.Dataset, mark: dict[str, Any]
) -> tuple[tuple[float, float], FloatArray | None]:
    """Value of the moving parameter, frequency and coefficients [m] at a mark, None if unknown."""
    name = "peak_coefficient"
    if mark["what"] == "peak" and name in one.variables and "peak" in one[name].dims:
        part = one[name].transpose("peak", *_INNER).values[mark["number"]]
        if np.isfinite(part).all() and part.size:
            return (mark["x"], mark["x"]), part
    name = "coefficient"
    if mark.get("row", -1) >= 0 and name in one.variables and "point" in one[name].dims:
        part = one[name].transpose("point", *_INNER).values[mark["row"]]
        frequency = one["frequency"].values
        at = float(frequency[mark["row"]]) if frequency.ndim == 1 else float(frequency)
        if np.isfinite(part).all() and part.size:
            return (mark["x"], at), part
    return (mark["x"], np.nan), None


def _rows(
    one: xr.Dataset, x: str, at: list[tuple[float, float]], parts: list[FloatArray]
) -> xr.Dataset:
    """A dataset whose points are some motions of a curve."""
    own = {"point", "peak", "event", "solution", x}
    names = [str(name) for name, v in one.variables.items() if own & {*map(str, v.dims)}]
    rest = _whatever_drives(one.drop_vars(names))
    values = np.array(at)
    rest["coefficient"] = ("point", *_INNER), np.array(parts)
    if x != "frequency" and "frequency" not in rest.variables:
        rest = rest.assign_coords(frequency=("point", values[:, 1]))
    return rest.assign_coords({x: ("point", values[:, 0])})


def _whatever_drives(one: xr.Dataset) -> xr.Dataset:
    """The same motions as if a force drove them: loops follow from the motion alone."""
    followed = Description(one).request
    followed.pop("unforced", None)
    return one.assign_attrs(followed=json.dumps(followed))


def _busiest(one: xr.Dataset, most: int) -> list[int]:
    """The contacts that have loops: those that dissipate the most, else the first ones."""
    n_contacts = one.sizes.get("contact", 0)
    order = np.arange(n_contacts)
    name = "dissipation"
    if name in one.variables and one[name].dtype.kind == "f" and "contact" in one[name].dims:
        spent = np.nan_to_num(one[name].transpose("contact", ...).values.reshape(n_contacts, -1))
        order = np.argsort(-spent.max(axis=1, initial=0.0), kind="stable")
    return sorted(order[:most].tolist())


def _loops(
    together: xr.Dataset, contacts: list[int]
) -> tuple[dict[int, list[History | None]], Counter[str]]:
    """Histories of contacts at all points, and why those of others are not known."""
    loops: dict[int, list[History | None]] = {}
    missing: Counter[str] = Counter()
    for contact in contacts:
        try:
            which = contact_of(together, contact)
            found = histories(together, which).of
        except (KeyError, TypeError, ValueError, NotImplementedError) as error:
            missing[f"loops of contacts: {plain(error.args[0] if error.args else error)}"] += 1
            continue
        loops[contact] = [found.get((row,)) for row in range(together.sizes["point"])]
    return loops, missing


def _contacts(
    mark: dict[str, Any], loops: dict[int, list[History | None]], row: int
) -> dict[int, History]:
    """The contacts whose loops a mark has: its own, and the first ones."""
    most = _OF_PEAK if mark["what"] == "peak" else _OF_EVENT
    own = [c for c in (mark.get("contact", -1),) if c in loops]
    chosen = sorted([*dict.fromkeys([*own, *sorted(loops)])][:most])
    found = {c: loops[c][row] for c in chosen}
    # A contact of a spring alone has no force here.
    return {c: h for c, h in found.items() if h is not None and np.any(h.force)}


def _is_straight(history: History) -> bool:
    """Whether the force is in proportion to the one displacement, as of a contact that sticks."""
    if len(history.displacement) > 1 or len(history.force) > 1:
        return False
    moved, force = (side - side.mean() for side in (history.displacement[0], history.force[0]))
    slope = (moved @ force) / (moved @ moved or 1.0)
    return bool(np.abs(force - slope * moved).max() <= 1e-6 * np.abs(force).max())


def _packed(history: History) -> dict[str, Any]:
    """A history with as few points as its loops need: its events, and some beside them."""
    n_angles = len(history.angle)
    kept = np.zeros(n_angles, dtype=bool)
    kept[:: max(1, n_angles // _N_ANGLES)] = True
    kept[-1] = True
    kept[1:] |= history.state[1:] != history.state[:-1]
    if not kept.all() and _is_straight(history):
        ends = np.argmin(history.displacement[0]), np.argmax(history.displacement[0])
        kept = np.isin(np.arange(n_angles), ends)
    limit = None if np.ptp(history.limit) else float(history.limit[0])
    return {
        "u": [packed(side[kept], "f4") for side in history.displacement],
        "f": [packed(side[kept], "f4") for side in history.force],
        "limit": limit or None,
    }


def shape_of(one: xr.Dataset, part: FloatArray, blades: list[int] | None) -> dict[str, Any]:
    """Amplitudes, and displacements at the instant of the largest, of all degrees of freedom."""
    basis, motions = motions_of(one, part)
    amplitude, when = largest_displacement(basis, motions)
    leading = int(np.argmax(amplitude))
    instant = motions @ basis.values(float(when[leading]))
    shape = {"amplitude": packed(amplitude), "instant": packed(instant)}
    return {"shape": shape | ({"blades": blades} if blades else {})}


def directions_of(one: xr.Dataset) -> list[list[str]]:
    """Names of the directions of each contact, none of those that tell no history."""
    names: list[list[str]] = []
    if "problem" not in one.attrs or not Description(one).problem.get("contacts"):
        return names
    one = _whatever_drives(one)
    for contact in range(one.sizes.get("contact", 0)):
        try:
            names.append([plain(name, 40) for name in contact_of(one, contact).law.directions])
        except (KeyError, TypeError, ValueError):
            names.append([])
    return names
