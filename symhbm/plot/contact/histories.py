"""What a contact of a dataset does over the period, point by point."""

from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from scipy.interpolate import CubicHermiteSpline

from symhbm.model.contacts import (
    Behaviour,
    ContactLaw,
    Coulomb,
    Ends,
    History,
    MemorylessLaw,
    Motions,
    weights_of,
)
from symhbm.numerics import RADIANS, FloatArray, check
from symhbm.plot.drawing import check_variables, motions_of, moving
from symhbm.plot.picture import Axis
from symhbm.results import Description, law_of

TURN = 2 * np.pi
"""A period [rad]."""
N_ANGLES = 512
"""Points of a period beside its events: more than a figure resolves."""
_PER_HARMONIC = 128
"""Points per period of the highest harmonic, for areas of loops to four digits."""
_AFTER = {
    "onset of slip": Behaviour.SLIPS,
    "end of slip": Behaviour.STICKS,
    "opening": Behaviour.OPENS,
}
"""What a contact does after an event of a stored motion; after closing the next event tells."""


class _Waves(NamedTuple):
    """A displacement of a sector of a disk: complex weights of degrees of freedom by harmonic."""

    weights: dict[int, dict[int, complex]]


class Contact(NamedTuple):
    """One contact of a dataset: its law and where that has its parameters and displacements.

    ``parameters`` is what the dataset calls those of the law, ``number`` that of the contact among
    all, ``within`` that within its ``group``.
    """

    law: ContactLaw
    group: str
    number: int
    within: int
    parameters: dict[str, str]
    directions: list[Ends] | list[_Waves]

    @property
    def rubbing(self) -> list[int]:
        """The directions of its law that dissipate: all but the normal one."""
        smooth = isinstance(self.law, MemorylessLaw)
        return [k for k, n in enumerate(self.law.directions) if smooth or n != "normal"]

    def of_group(self, value: xr.DataArray) -> xr.DataArray:
        """A parameter of this contact, of that of all contacts of its group."""
        dims = [dim for dim in value.dims if dim == "contact" or str(dim).endswith("_contact")]
        return value.isel(dict.fromkeys(dims, self.within), drop=True)

    def values(self, dataset: xr.Dataset) -> dict[str, FloatArray]:
        """Parameters of its law, by their own names."""
        return {own: self.of_group(dataset[n]).values for own, n in self.parameters.items()}

    def relative(self, values: xr.DataArray) -> list[xr.DataArray]:
        """Its displacements, of those of all degrees of freedom."""
        return [
            _in_waves(values, ends) if isinstance(ends, _Waves) else _weighted(values, ends)
            for ends in self.directions
        ]


class Histories(NamedTuple):
    """Histories by their indices along ``dims``, None where a point did not converge.

    ``dataset`` is without the padding of its paths.
    """

    of: dict[tuple[int, ...], History | None]
    dataset: xr.Dataset
    dims: list[str]
    contact: Contact


def contact_of(dataset: xr.Dataset, contact: int) -> Contact:
    """A contact by its number; raises for a dataset without it, or a law that is not known."""
    check_variables(dataset, "frequency")
    check.known("problem", dataset.attrs, "attribute of the dataset")
    for dim in ("dof", "contact"):
        check.known(dim, [str(d) for d in dataset.dims], "dimension of the dataset")
    about, groups = Description(dataset).problem, Description(dataset).groups
    contacts = Description(dataset).contacts
    contact = check.integer("contact", contact, 0, len(contacts) - 1)
    if not groups:
        names = {name: name for name in Coulomb.parameters}
        return Contact(Coulomb(), "friction", contact, contact, names, [contacts[contact]])
    owners = [(name, i) for name, each in groups.items() for i in range(len(each["pairs"][0]))]
    name, within = owners[contact]
    law = law_of(groups[name])
    if law is None or type(law).history is ContactLaw.history:
        raise ValueError(
            f"contact={contact}: expected one of a law that tells its history, it is of "
            f"{groups[name]['law']['of']} in the group {name!r}"
        )
    called, pairs = groups[name]["parameters"], groups[name]["pairs"]
    if "displacements" in about:
        before = [len(each["pairs"]) * len(each["pairs"][0]) for each in groups.values()]
        first = sum(before[: [*groups].index(name)]) + within * len(pairs)
        waves = _waves_of(dataset, about, range(first, first + len(pairs)))
        return Contact(law, name, contact, within, called, waves)
    several = contacts[contact] if len(pairs) > 1 else (contacts[contact],)
    return Contact(law, name, contact, within, called, [*several])


def _waves_of(dataset: xr.Dataset, about: dict[str, Any], rows: range) -> list[_Waves]:
    """Displacements of a sector; ValueError for a dataset of another engine order."""
    if np.any(dataset["engine_order"].values != about["order"]):
        raise ValueError(
            f"engine_order: expected {about['order']}, for which the dataset knows the motion of "
            "contacts; compute the others by themselves"
        )
    return [
        _Waves(
            {
                int(harmonic): {int(dof): complex(*w) for dof, w in each[row].items()}
                for harmonic, each in about["displacements"].items()
            }
        )
        for row in rows
    ]


def histories(dataset: xr.Dataset, contact: Contact) -> Histories:
    """What it does over the period at all points; raises KeyError for what is missing."""
    check_variables(dataset, *contact.parameters.values())
    if "angle" in dataset.dims:
        return Histories({(): _stored(dataset, contact)}, dataset, [], contact)
    check_variables(dataset, "coefficient", "harmonic")
    return _of_motions(dataset, contact)


def _in_waves(values: xr.DataArray, waves: _Waves) -> xr.DataArray:
    """A displacement of a sector, harmonic by harmonic."""
    phasors = values.sel(component="cos") - 1j * values.sel(component="sin")
    each: list[Any] = [
        sum(
            weight * phasors.sel(harmonic=harmonic).isel(dof=dof, drop=True)
            for dof, weight in weights.items()
        )
        for harmonic, weights in waves.weights.items()
    ]
    moved = xr.concat(each, values["harmonic"])
    parts = xr.concat([moved.real, -moved.imag], values["component"])
    return parts.transpose(*(dim for dim in values.dims if dim != "dof"))


def _weighted(values: xr.DataArray, ends: Ends) -> xr.DataArray:
    each = zip(*weights_of(ends), strict=True)
    return sum(weight * values.isel(dof=dof, drop=True) for dof, weight in each)  # type: ignore


def _stored(dataset: xr.Dataset, contact: Contact) -> History | None:
    """Of a motion stored over its period, with its events among the points."""
    law, rubs = contact.law, "tangential" in contact.law.directions
    presses = "normal" in law.directions
    needed = ["event_angle", *["friction_force"] * rubs, *["normal_force"] * presses]
    needed = [] if isinstance(law, MemorylessLaw) else needed
    check_variables(dataset, "displacement", "velocity", *needed)
    angle, period = dataset["angle"].values, 2 * np.pi
    closed = np.append(angle, angle[0] + period)
    omega = RADIANS * float(dataset["frequency"])
    y, velocity = (
        _wrapped(np.array([each.values for each in contact.relative(dataset[name])]))
        for name in ("displacement", "velocity")
    )
    if not np.isfinite(y).all():
        return None
    values, limit = contact.values(dataset), np.zeros(len(closed))
    if isinstance(law, MemorylessLaw):
        along = {own: np.full(len(closed), value) for own, value in values.items()}
        force = law.at_instants(y.T, velocity.T, omega, along).force.T
        return History(closed, y, force, limit, limit.astype(int))
    chosen = dataset["event_contact"].values == contact.number
    event = angle[0] + (dataset["event_angle"].values[chosen] - angle[0]) % period
    order = np.argsort(event, kind="stable")
    event, kinds = event[order], dataset["event_kind"].values[chosen][order].tolist()
    motion = CubicHermiteSpline(closed, y.T, velocity.T / omega)

    def of_contact(name: str) -> FloatArray:
        return _wrapped(dataset[name].isel(contact=contact.number).values)

    def at_events(name: str) -> FloatArray:
        return np.interp(event, closed, of_contact(name))

    forces, at = [], []
    borders = np.isin(kinds, ("opening", "closing"))
    if presses:
        forces.append(of_contact("normal_force"))
        at.append(np.where(borders, 0.0, at_events("normal_force")))
    limits = np.zeros(len(event))
    if rubs and presses:
        limit, limits = (values["friction_coefficient"] * part for part in (forces[0], at[0]))
    elif rubs:
        constant = values["friction_coefficient"] * values["normal_load"]
        limit, limits = limit + constant, limits + constant
    if rubs:
        names = ["friction_force", *["friction_force_across"] * ("across" in law.directions)]
        forces[:0] = [of_contact(name) for name in names]
        # At its events the slider is at its limit, on the side of the force nearby.
        nearby = np.array([at_events(name) for name in names])
        size = np.linalg.norm(nearby, axis=0)
        nearby = nearby * limits / np.where(size > 0, size, 1.0)
        if len(names) > 1:
            spring = float(values["contact_stiffness"])
            points = closed, y, np.array(forces[:2])
            nearby = _by_spring(nearby, kinds, (event, motion(event).T), points, spring)
        at[:0] = [*nearby]
    points = np.concatenate([closed, event])
    place = np.argsort(points, kind="stable")

    def joined(around: Any, here: Any) -> FloatArray:
        return np.concatenate([np.asarray(around), here], axis=-1)[..., place]

    never = Behaviour.OPENS if presses and not np.any(forces[-1]) else Behaviour.STICKS
    after = np.array(_states_after(kinds, rubs) or [never])
    state = after[np.searchsorted(event, points[place], side="right") - 1]
    displacement, force = joined(y, motion(event).T), joined(forces, np.array(at))
    return History(points[place], displacement, force, joined(limit, limits), state)


def _by_spring(
    nearby: FloatArray,
    kinds: list[str],
    events: tuple[FloatArray, FloatArray],
    points: tuple[FloatArray, FloatArray, FloatArray],
    stiffness: float,
) -> FloatArray:
    """Forces (2, n) of planar events, exact where the contact sticks on one side, else ``nearby``.

    ``events`` are angles and displacements, ``points`` those around them and their forces. The
    direction of the force turns at an event, which the points around it do not tell.
    """
    (event, moved_there), (angle, moved, force) = events, points
    before = np.searchsorted(angle, event, side="right") - 1
    onset = np.array([kind == "onset of slip" for kind in kinds], dtype=bool)
    sticks = onset | np.array([kind == "end of slip" for kind in kinds], dtype=bool)
    beside = np.where(onset, before, np.minimum(before + 1, len(angle) - 1))
    low, high = np.minimum(angle[beside], event), np.maximum(angle[beside], event)
    alone = [((event >= a) & (event <= b)).sum() == 1 for a, b in zip(low, high, strict=True)]
    known = sticks & np.array(alone, dtype=bool)
    by_spring = force[:, beside] + stiffness * (moved_there - moved[:, beside])[:2]
    return np.where(known, by_spring, nearby)


def _wrapped(values: FloatArray) -> FloatArray:
    """Values over a period, the first once more at its end."""
    return np.concatenate([values, values[..., :1]], axis=-1)


def _states_after(kinds: list[str], rubs: bool) -> list[int]:
    """What a contact does after each of its events, which are cyclic."""
    following = kinds[1:] + kinds[:1]
    # What closes and then opens, or ends to slip, has slipped in between where it rubs.
    closing = [
        Behaviour.SLIPS if rubs and kind != "onset of slip" else Behaviour.STICKS
        for kind in following
    ]
    return [_AFTER.get(kind, state) for kind, state in zip(kinds, closing, strict=True)]


def _of_motions(dataset: xr.Dataset, contact: Contact) -> Histories:
    parameter = moving(dataset)
    if dataset.sizes.get("solution") == 1:
        dataset = dataset.isel(solution=0)
    if "point" in dataset["coefficient"].dims and dataset[parameter.name].dims == ("point",):
        dataset = dataset.isel(point=np.isfinite(dataset[parameter.name].values))
        dataset = dataset.swap_dims(point=parameter.name)
    each = contact.relative(dataset["coefficient"])
    dims = [str(dim) for dim in each[0].dims if dim not in ("harmonic", "component")]
    tables = [one.transpose(*dims, "harmonic", "component").values for one in each]
    shape, inner = tables[0].shape[:-2], tables[0].shape[-2:]
    found_of = [motions_of(dataset, table.reshape(-1, *inner)) for table in tables]
    basis, motion = found_of[0][0], np.concatenate([motions for _, motions in found_of], axis=1)
    like = each[0].isel(harmonic=0, component=0, drop=True)

    def flat(value: xr.DataArray) -> Any:
        return value.broadcast_like(like).transpose(*dims).values.ravel()

    given = {own: flat(_of_contact(dataset, n, contact)) for own, n in contact.parameters.items()}
    frequency = RADIANS * flat(dataset["frequency"])
    is_solution = dataset[parameter.name].notnull()
    if "solution" in dims and "n_solutions" in dataset:
        number = xr.DataArray(np.arange(dataset.sizes["solution"]), dims="solution")
        is_solution = is_solution & (number < dataset["n_solutions"])
    finite = np.flatnonzero(np.isfinite(motion).all(axis=1))
    values = {own: value[finite] for own, value in given.items()}
    n_angles = max(N_ANGLES, _PER_HARMONIC * basis.highest)
    at = Motions(basis, motion[finite], frequency[finite], values)
    found: list[History | None] = [None] * len(motion)
    for number, history in zip(finite, contact.law.history(at, n_angles) or [], strict=True):
        found[number] = history
    # The padding of a table is no point.
    every = zip(np.ndindex(*shape), found, flat(is_solution), strict=True)
    of = {index: history for index, history, point in every if point}
    return Histories(of, dataset, dims, contact)


def _of_contact(dataset: xr.Dataset, name: str, contact: Contact) -> xr.DataArray:
    """A parameter of the contact, as it is where another contact's is followed."""
    followed = Description(dataset).request
    value = dataset[name]
    if followed.get("name") == name and followed["index"] not in (None, contact.within):
        value = dataset[f"{name}_nominal"]
    return contact.of_group(value)


def from_zero(history: History) -> History:
    """The same with points that lie around one period from 0 on."""
    turned = history.angle[:-1] % TURN
    order = np.argsort(turned, kind="stable")
    order = np.concatenate([order[-1:], order, order[:1]])
    angle = turned[order] - TURN * (np.arange(len(order)) == 0)
    angle[-1] += TURN
    sides = history.displacement[:, order], history.force[:, order]
    return History(angle, *sides, history.limit[order], history.state[order])


def angle_axis() -> Axis:
    """The axis of a period."""
    ticks = [f"${each}$" for each in ("0", r"\pi/2", r"\pi", r"3\pi/2", r"2\pi")]
    label = r"angle of the period $\omega t$ [rad]"
    return Axis(label, limits=(0, TURN), ticks=(np.arange(5) * np.pi / 2, ticks))
