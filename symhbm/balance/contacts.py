"""The contacts of a balance, group by group: their motions, events, margins and sliders."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from symhbm.balance.evaluation import ContactStates, UnknownLayout
from symhbm.model import Structure, Symmetry
from symhbm.model.contacts import (
    ContactLaw,
    FixedValues,
    Motions,
    NormalLaw,
    SliderContacts,
    graph_of,
)
from symhbm.numerics import Compiled, FloatArray, FourierBasis


class BalancedGroup(NamedTuple):
    """A group of contacts as it is balanced: all of its contacts, or those of one sector.

    ``law`` may march over samples what the structure's locates. ``contacts`` (n,) and ``rows``
    (n, m) number contacts and displacements among those balanced; ``parameters`` names the values
    of the law in the structure; ``events`` is the input that tells its events.
    """

    name: str
    law: ContactLaw
    contacts: NDArray[np.intp]
    rows: NDArray[np.intp]
    parameters: dict[str, str]

    @property
    def n(self) -> int:
        """Number of contacts."""
        return len(self.contacts)

    @property
    def n_switches(self) -> int:
        """Number of switches of all its contacts."""
        return self.n * len(self.law.switches)

    @property
    def events(self) -> str:
        """The name of the input that holds the events of its contacts."""
        return f"{self.name}.events"


def balanced_groups(
    model: Structure, symmetry: Symmetry | None, samples: int | None
) -> tuple[BalancedGroup, ...]:
    """The groups of a structure as they are balanced, friction over ``samples`` where given."""
    contacts = np.arange(model.n_contacts) if symmetry is None else symmetry.contacts
    position = np.full(model.n_contacts, -1)
    position[contacts] = np.arange(len(contacts))
    first_row = np.concatenate([[0], np.cumsum([len(model.groups.rows[j]) for j in contacts])])
    result = []
    for group in model.groups:
        own = np.sort(position[group.contacts][position[group.contacts] >= 0])
        rows = first_row[own][:, None] + np.arange(group.rows.shape[1])
        law = group.law if samples is None else group.law.sampled(samples)
        result.append(BalancedGroup(group.name, law, own, rows.astype(int), group.parameters))
    return tuple(result)


@dataclass(frozen=True)
class BalancedContacts:
    """The contacts that a balance compiles, with their values.

    ``values`` are those of the parameters by group and by names of its law, (n,) each. Switches are
    numbered group by group and contact by contact.
    """

    layout: UnknownLayout
    groups: tuple[BalancedGroup, ...]
    values: dict[str, dict[str, FloatArray]]
    _packed: dict[str, FloatArray] = field(default_factory=dict, init=False)

    @classmethod
    def of(
        cls,
        layout: UnknownLayout,
        groups: tuple[BalancedGroup, ...],
        values: dict[str, dict[str, FloatArray]],
    ) -> "BalancedContacts":
        """Those whose laws keep what they make of the values."""
        return cls(layout, groups, {name: FixedValues(own) for name, own in values.items()})

    def values_of(self, group: BalancedGroup) -> dict[str, FloatArray]:
        """Values of the parameters of the contacts of a group."""
        return self.values[group.name]

    def packed(self, group: BalancedGroup) -> FloatArray:
        """The same contact by contact, as the functions of a law take them."""
        if group.name not in self._packed:
            values = self.values[group.name]
            rows = np.array([values[name] for name in group.law.parameters])
            self._packed[group.name] = rows.T.ravel()
        return self._packed[group.name]

    def motions(self, group: BalancedGroup, relative: FloatArray) -> FloatArray:
        """Of displacements (..., n_rows, n_components) a group's, (..., n, m n_components)."""
        if group.rows.size != self.layout.n_rows:
            relative = relative[..., group.rows.ravel(), :]
        size = group.rows.shape[1] * self.layout.basis.n_components
        return relative.reshape(*relative.shape[:-2], group.n, size)

    def at(self, group: BalancedGroup, relative: FloatArray, frequency: float) -> Motions:
        """Motions of a group, from the displacements (n_rows, n_components) of all."""
        motion = self.motions(group, relative)
        return Motions(self.layout.basis, motion, frequency, self.values_of(group))

    def locate(
        self, unknowns: FloatArray, frequency: float, held: NDArray[np.bool_] | None = None
    ) -> ContactStates:
        """Events of all contacts at the unknowns; ``held`` (n_switches,) imposes states."""
        relative, located, first = self.layout.relative(unknowns), {}, 0
        for group in self.groups:
            own, q = None, len(group.law.switches)
            if held is not None:
                own = held[first : first + group.n_switches].reshape(group.n, q)
            first += group.n_switches
            located[group.name] = group.law.locate(self.at(group, relative, frequency), own)
        return ContactStates(located)

    def sliders(self, frequency: float = 0.0) -> SliderContacts:
        """The contacts that are springs in series with sliders, at a frequency [rad/s]."""
        return SliderContacts.of(((g, self.values[g.name]) for g in self.groups), frequency)

    def margins_within(
        self,
        unknowns: FloatArray,
        frequency: FloatArray,
        error: FloatArray,
        values: Sequence["BalancedContacts"],
        known: FloatArray | None = None,
    ) -> FloatArray:
        """Margins (n, s, n_switches) of unknowns (n, s, n_unknowns), see `ContactLaw`.

        ``error`` (n, s, n_switches) [m] is that of the motions; ``frequency`` (n,) in rad/s;
        ``values`` (n,) are these contacts with the values of their parameters. Margins ``known``
        (n, n_switches) are not asked for, but where those of the same contact are NaN.
        """
        shape, parts = unknowns.shape[:2], [np.zeros((*unknowns.shape[:2], 0))]
        for group, own, at in self._motions_at(unknowns, frequency, values):
            errors = error[..., own].reshape(-1, len(group.law.switches))
            if known is None:
                each = group.law.margins_within(at, errors)
            else:
                each = np.repeat(known[:, None, own], shape[1], axis=1).reshape(errors.shape)
                asked = np.isnan(each).any(axis=1)
                if asked.any():
                    each[asked] = group.law.margins_within(at.of(asked), errors[asked])
            parts.append(each.reshape(*shape, -1))
        return np.concatenate(parts, axis=-1)

    def margin_changes(
        self,
        unknowns: FloatArray,
        frequency: FloatArray,
        change: FloatArray,
        margins: FloatArray,
        values: Sequence["BalancedContacts"],
    ) -> FloatArray:
        """Bounds (n, n_switches) of how far margins (n, n_switches) move, see `ContactLaw`.

        ``change`` (n, n_rows, n_components) [m] is that of the displacements along contacts;
        others as of `margins_within`.
        """
        parts = [np.zeros((len(unknowns), 0))]
        for group, own, at in self._motions_at(unknowns[:, None], frequency, values):
            moved = self.motions(group, change).reshape(at.motion.shape)
            bounds = group.law.margin_changes(at, moved, margins[:, own].reshape(len(moved), -1))
            parts.append(bounds.reshape(len(unknowns), -1))
        return np.concatenate(parts, axis=-1)

    def _motions_at(
        self, unknowns: FloatArray, frequency: FloatArray, values: Sequence["BalancedContacts"]
    ) -> Iterator[tuple[BalancedGroup, slice, Motions]]:
        """Groups with switches, the places of these, and motions as of `margins_within`."""
        relative, first = self.layout.relative(unknowns.reshape(-1, unknowns.shape[-1])), 0
        for group in self.groups:
            own = slice(first, first := first + group.n_switches)
            if group.n_switches:
                repeated = np.repeat(frequency, unknowns.shape[1])
                yield group, own, motions_at_each(values, group, relative, repeated)

    def switch(self, number: int) -> tuple[BalancedGroup, int, int]:
        """The group of a switch, the contact within, and which of the law's switches it is."""
        for group in self.groups:
            if number < group.n_switches:
                return group, *divmod(number, len(group.law.switches))
            number -= group.n_switches
        raise IndexError(f"number={number}: expected one of the switches of all contacts")

    @property
    def of_switches(self) -> NDArray[np.intp]:
        """The contact of each switch, (n_switches,)."""
        each = [np.repeat(group.contacts, len(group.law.switches)) for group in self.groups]
        return np.concatenate([np.zeros(0, dtype=int), *each])

    @cached_property
    def places_of_springs(self) -> tuple[tuple[int, ...], list[NDArray[np.intp]]]:
        """Shape of springs by displacement, and where those of each group are, m^2 a contact.

        (n_rows,), or (n_rows, n_rows) where a law couples displacements.
        """
        rows, n_rows = [group.rows for group in self.groups], self.layout.n_rows
        if all(of_group.shape[1] == 1 for of_group in rows):
            return (n_rows,), [of_group[:, 0] for of_group in rows]
        return (n_rows, n_rows), [(n_rows * r[:, :, None] + r[:, None]).ravel() for r in rows]

    def sizes_at_switches(self, by_row: FloatArray) -> FloatArray:
        """Norms of the motion of the contact of each switch from those of rows (..., n_rows)."""
        each = [np.zeros((*by_row.shape[:-1], 0))]
        for group in self.groups:
            size = np.linalg.norm(by_row[..., group.rows], axis=-1)
            each.append(np.repeat(size, len(group.law.switches), axis=-1))
        return np.concatenate(each, axis=-1)

    def by_unknowns(self, group: BalancedGroup, contact: int, by_motion: FloatArray) -> FloatArray:
        """Derivatives (..., n_unknowns) from those by a contact's motion, (..., m n_components)."""
        rows = group.rows[contact].tolist()
        parts = np.split(by_motion, len(rows), axis=-1)
        each = [self.layout.by_unknowns(row, part) for row, part in zip(rows, parts, strict=True)]
        return each[0] if len(each) == 1 else np.sum(each, axis=0)

    def margin_gradient(self, states: ContactStates, switch: int) -> FloatArray:
        """Derivative of the margin of one switch by the unknowns, (n_unknowns,)."""
        group, contact, place = self.switch(switch)
        by_motion = states.groups[group.name].margins_by_motion[contact, place]
        return self.by_unknowns(group, contact, by_motion)

    def margin_rate(self, states: ContactStates, direction: FloatArray) -> FloatArray:
        """Derivative of all margins along a direction of the unknowns, (n_switches,)."""
        relative, rates = self.layout.relative(direction), []
        for group in self.groups:
            by_motion = states.groups[group.name].margins_by_motion
            motion, n_switches = self.motions(group, relative), by_motion.shape[1]
            each = [np.einsum("cm,cm->c", by_motion[:, q], motion) for q in range(n_switches)]
            rates += each if n_switches < 2 else [np.stack(each, axis=1).ravel()]
        return rates[0] if len(rates) == 1 else np.concatenate([np.zeros(0), *rates])

    def springs(self, unknowns: FloatArray, frequency: float, states: ContactStates) -> FloatArray:
        """Springs equivalent to contacts in a motion, see `symhbm.laws.ContactLaw.springs`.

        Stiffness and loss [N/m] by harmonic above 0, (2, n_harmonics, m^2 of each contact).
        """
        basis, relative = self.layout.basis, self.layout.relative(unknowns)
        n_harmonics = sum(n > 0 for n in basis.harmonics)
        parts: list[list[FloatArray]] = [[], []]
        for group in self.groups:
            if not group.n:
                continue
            given = (
                self.motions(group, relative).ravel(),
                frequency,
                self.packed(group),
                states.groups[group.name].events.ravel(),
            )
            springs = _springs(group.law, basis, group.n)(*given)
            for part, found in zip(parts, springs, strict=True):
                # Contact by contact, and by harmonic within.
                by_contact = found.reshape(group.n, n_harmonics, -1)
                part.append(by_contact.transpose(1, 0, 2).reshape(n_harmonics, -1))
        nothing = np.zeros((n_harmonics, 0))
        return np.array([np.concatenate([nothing, *part], axis=1) for part in parts])

    def by_row(self, springs: FloatArray) -> FloatArray:
        """Springs (n_harmonics, m^2 of each contact) by the displacements that they act on.

        (n_harmonics, n_rows), or (n_harmonics, n_rows, n_rows) where a law couples displacements.
        """
        size, places = self.places_of_springs
        result, first = np.zeros((len(springs), math.prod(size))), 0
        for of_group in places:  # groups may act on the same displacements
            result[:, of_group] += springs[:, first : first + len(of_group)]
            first += len(of_group)
        return result.reshape(len(springs), *size)

    def largest_load(self, frequency: float) -> float:
        """Largest load [N] of contacts that a normal force presses, 0 without, at [rad/s]."""
        loads = [
            np.abs(group.law.load(frequency, self.values_of(group))).max(initial=0.0)
            for group in self.groups
            if isinstance(group.law, NormalLaw)
        ]
        return float(max(loads, default=0.0))

    @property
    def margins_move(self) -> bool:
        """Whether margins of switches depend on the frequency at a given motion."""
        return any(group.law.margins_move for group in self.groups)

    def margin_slopes(
        self, states: ContactStates, frequency: float
    ) -> tuple[FloatArray, dict[str, FloatArray]]:
        """Derivatives of the margins at the motion of ``states``: by frequency and parameters.

        (n_switches,), and by name (n_switches, n) for the n contacts of the parameter.
        """
        n_switches, first = sum(group.n_switches for group in self.groups), 0
        by_frequency, by_values = np.zeros(n_switches), {}
        for group in self.groups:
            at = first + np.arange(group.n_switches)
            first += group.n_switches
            located = states.groups[group.name]
            slopes = group.law.margin_slopes(located, frequency, self.values_of(group))
            by_frequency[at] = slopes[0].ravel()
            owner = np.repeat(np.arange(group.n), len(group.law.switches))
            for name, values in zip(group.parameters.values(), slopes[1], strict=True):
                by_values[name] = np.zeros((n_switches, group.n))
                by_values[name][at, owner] = values.ravel()
        return by_frequency, by_values


@lru_cache(maxsize=64)
def _springs(law: ContactLaw, basis: FourierBasis, n_contacts: int) -> Compiled:
    return Compiled(graph_of(law, basis).springs.map(n_contacts))


def motions_at_each(
    contacts: Sequence[BalancedContacts],
    group: BalancedGroup,
    relative: FloatArray,
    frequencies: FloatArray,
) -> Motions:
    """Motions of a group at several points, one after another.

    ``relative`` (n_points, n_rows, n_components) are the displacements of all contacts, and
    ``frequencies`` (n_points,) in rad/s; each of the ``contacts`` is of as many points in a row.
    """
    first, times = contacts[0], len(frequencies) // len(contacts)
    if all(each is first for each in contacts):
        values = {name: np.tile(v, len(frequencies)) for name, v in first.values_of(group).items()}
    else:
        each = [one.values_of(group) for one in contacts for _ in range(times)]
        values = {name: np.concatenate([v[name] for v in each]) for name in each[0]}
    motion = first.motions(group, relative)
    motion = motion.reshape(-1, motion.shape[-1])
    return Motions(first.layout.basis, motion, np.repeat(frequencies, group.n), values)
