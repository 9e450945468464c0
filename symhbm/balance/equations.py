"""The equations of Eq. (9) as CasADi functions, shared by all parameter sets of one structure."""

from collections.abc import Callable, Collection
from typing import Any

import casadi as ca
import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from symhbm.balance.contacts import BalancedGroup
from symhbm.balance.evaluation import ContactStates, UnknownLayout
from symhbm.balance.linear_part import OfHarmonics, OfMatrices
from symhbm.model import Structure, Symmetry
from symhbm.model.contacts import FREE, Located, Motions, graph_of
from symhbm.numerics import Assembly, Compiled, FloatArray, FourierBasis, check, constant, is_full

FORCE_INPUTS = ("force_amplitude", "force_shape", "static_force")


def identifier(name: str) -> str:
    """What an input is called in CasADi functions, whose names hold no points."""
    group, point, own = name.partition(".")
    return f"{own}_of_{group}" if point else group


class Equations:
    """Symbols of one structure and harmonic set, and the functions compiled from them.

    ``residual`` maps the named inputs (unknowns, frequency, ``parameter_names`` and the events of
    each group of contacts) to the forces [N]. Calling the object evaluates residual, magnitude,
    stored entries of the Jacobian and the derivative by frequency. ``groups`` are those of the
    contacts that do something: the others cost time. With a ``symmetry`` the equations are those
    of one sector: its unknowns, its equations and its contacts.

    ``layout`` tells what the unknowns are. ``powers`` of the frequency go with as many shapes of
    the force. ``assemble`` makes the stored entries of the Jacobian a
    matrix, full up to a size, sparse above. ``located_form`` is the function of a call, from
    unknowns, frequency, parameters and the events of the groups of ``located``. ``closed`` tells
    that the events of contacts are closed forms, found in the same call: ``closed_form`` maps
    unknowns, frequency, parameters and imposed states of switches to residual, magnitude, Jacobian,
    derivative by frequency and what `ContactLaw.event_graph` gives of each group, a contact a
    column; ``conservative`` maps the first three to the Jacobian of elastic less inertia forces and
    the inertia forces (n_unknowns,).
    """

    def __init__(
        self,
        model: Structure,
        basis: FourierBasis,
        groups: Collection[BalancedGroup],
        symmetry: Symmetry | None = None,
        powers: tuple[int, ...] = (0,),
    ):
        self.basis, self.groups, self.powers = basis, tuple(groups), powers
        size = basis.n_components
        dofs, contacts = np.arange(model.n_dof), np.arange(model.n_contacts)
        self.expansion: Any = sp.eye_array(model.n_dof * size, format="csr")
        displacements: Any = model.displacements(basis)
        if symmetry is not None:
            dofs, contacts = dofs[: symmetry.n_dof], symmetry.contacts
            self.expansion = symmetry.expansion(basis)
            rows = model.groups.rows_of(contacts)[:, None] * size + np.arange(size)
            displacements = displacements.tocsr()[rows.ravel()]
        self.dofs: NDArray[np.intp] = dofs
        self.contacts: NDArray[np.intp] = contacts
        spread = (displacements @ self.expansion).tocsr()
        spread.eliminate_zeros()
        sizes = len(dofs), model.n_dof, displacements.shape[0] // size
        self.layout = UnknownLayout(basis, *sizes, self.expansion, spread)
        self._sizes = (abs(displacements) @ abs(self.expansion)).tocsr()
        names = [name for group in self.groups for name in group.parameters.values()]
        terms = model.matrix_terms if model.has_matrices else {}
        of_matrices = model.has_matrices
        self.linear = OfMatrices(model, basis, dofs) if of_matrices else OfHarmonics(model, basis)
        counts = dict(self.linear.counts)
        self.parameter_names = (*counts, *terms, *names, *FORCE_INPUTS)
        n_dof = len(self.dofs)
        counts |= {name: next(iter(by.values())).shape[1] for name, (_, by) in terms.items()}
        counts |= {name: g.n for g in self.groups for name in g.parameters.values()}
        n_static = n_dof if 0 in basis.harmonics else 0
        counts |= {"force_amplitude": 1, "static_force": n_static}
        counts["force_shape"] = n_dof * size * len(powers)
        symbol: dict[str, Any] = {
            "unknowns": ca.SX.sym("unknowns", n_dof * size),
            "frequency": ca.SX.sym("omega"),
        }
        for name in self.parameter_names:
            symbol[name] = ca.SX.sym(name, counts[name])
        self.located = tuple(group for group in self.groups if group.law.n_events(basis))
        for group in self.located:
            symbol[group.events] = ca.SX.sym(group.events, group.law.n_events(basis), group.n)
        self._symbol = symbol
        entries = {name: symbol[name] for name in self.linear.counts}
        for name, (of, by_power) in terms.items():
            for power, places in by_power.items():
                entries[of] += ca.mtimes(constant(places), symbol[name] ** power)
        spread_absolute, expansion = constant(self._sizes), constant(self.expansion)
        shape = self.shape_at(symbol["force_shape"], symbol["frequency"])
        force = symbol["force_amplitude"] * ca.reshape(shape, size, n_dof).T
        if n_static:
            force[:, basis.component(0)] += symbol["static_force"]
        omega = symbol["frequency"]
        travel = ca.mtimes(spread_absolute, ca.fabs(symbol["unknowns"]))
        whole = ca.mtimes(expansion, symbol["unknowns"])
        self._balance, total = ca.SX(n_dof * size, 1), ca.vec(ca.fabs(force).T)
        jacobian = conservative = ca.SX(n_dof * size, n_dof * size)
        slope = inertia = ca.SX(n_dof * size, 1)
        # Derivatives of what is bilinear by rule: tracing it takes longer than factorising it.
        for power, matrix in self.linear.matrices(entries).items():
            factor, pushes = omega**power, ca.mtimes(matrix, whole)
            own = factor * (matrix if symmetry is None else ca.mtimes(matrix, expansion))
            self._balance += factor * pushes
            total += factor * ca.mtimes(ca.fabs(matrix), ca.fabs(whole))
            jacobian += own
            slope += power * omega ** (power - 1) * pushes if power else 0
            conservative += own if power in self.linear.conservative else 0
            # Of springs and masses, -omega / 2 times the slope is the inertia.
            inertia -= power / 2 * factor * pushes if power > 1 else 0
        largest_difference = ca.SX(0)
        for group in (group for group in self.groups if group.n):
            spread, spread_absolute = (constant(part) for part in self.spreads(group))
            pushes, sizes, differences, slopes, by_frequency = self._contacts(group, travel)
            self._balance += ca.mtimes(spread.T, pushes)
            total += ca.mtimes(spread_absolute.T, sizes)
            jacobian += ca.mtimes([spread.T, slopes, spread])
            largest_difference = ca.fmax(largest_difference, ca.mmax(differences))
            if by_frequency.nnz():
                slope += ca.mtimes(spread.T, by_frequency)
        self._balance -= ca.vec(force.T)
        if any(powers):
            slope -= ca.jacobian(ca.vec(force.T), omega)

        names, inputs = [identifier(name) for name in symbol], list(symbol.values())
        self.residual = ca.Function("residual", inputs, [self._balance], names, ["residual"])
        self._known = {"unknowns": jacobian, "frequency": slope}
        magnitude = ca.mmax(total) + largest_difference
        outputs = [self._balance, magnitude, jacobian, ca.densify(slope)]
        self.located_form = ca.Function("evaluate", inputs, outputs)
        self._evaluate = Compiled(self.located_form)
        pattern = jacobian.sparsity()
        self.assemble = Assembly(pattern, is_full(n_dof * size, pattern.nnz()))
        graphs = [graph_of(group.law, basis).events for group in self.groups]
        self.closed = all(
            graph is not None or not group.law.n_events(basis)
            for graph, group in zip(graphs, self.groups, strict=True)
        )
        if self.closed:
            self._close(inputs, outputs)
        given = inputs[: len(inputs) - len(self.located)]
        self.conservative = ca.Function("conservative", given, [conservative, inertia])
        self._inertia = Compiled(ca.Function("inertia", given, [ca.mmax(ca.fabs(inertia))]))
        self._derivatives: dict[str, ca.Function] = {}
        self._made: dict[tuple, Any] = {}

    def once(self, key: tuple, make: Callable[[], Any]) -> Any:
        """What is made of these equations once for all copies of their problem, by a ``key``."""
        if key not in self._made:
            self._made[key] = make()
        return self._made[key]

    def shape_at(self, shapes: Any, frequency: Any) -> Any:
        """Force coefficients of unit amplitude at a frequency [rad/s], from those of all powers."""
        if not any(self.powers):
            return shapes
        factors = ca.vertcat(*(frequency**power for power in self.powers))
        return ca.mtimes(ca.reshape(shapes, -1, len(self.powers)), factors)

    def spreads(self, group: BalancedGroup) -> tuple[Any, Any]:
        """Coefficients of a group's displacements from the unknowns, and from their sizes."""
        size = self.basis.n_components
        rows = (group.rows.ravel()[:, None] * size + np.arange(size)).ravel()
        if group.rows.size == self.layout.n_rows:
            return self.layout.directions, self._sizes
        return self.layout.directions[rows], self._sizes[rows]

    def _motions(self, group: BalancedGroup, all_rows: Any) -> Any:
        """Of all coefficients of displacements those of a group, a contact a column."""
        size = self.basis.n_components
        by_row = ca.reshape(all_rows, size, self.layout.n_rows)
        columns = by_row[:, group.rows.ravel().tolist()]
        return ca.reshape(columns, size * group.rows.shape[1], group.n)

    def motions_of(self, group: BalancedGroup, inputs: dict[str, Any]) -> list[Motions]:
        """Those of the contacts of a group, of symbols by their names in CasADi functions."""
        moved = ca.mtimes(constant(self.spreads(group)[0]), inputs["unknowns"])
        motion, frequency = ca.reshape(moved, -1, group.n), inputs["frequency"]
        values = {own: inputs[identifier(name)] for own, name in group.parameters.items()}
        each = [{own: of[j] for own, of in values.items()} for j in range(group.n)]
        return [Motions(self.basis, motion[:, j], frequency, own) for j, own in enumerate(each)]

    def values(self, group: BalancedGroup, inputs: dict[str, Any] | None = None) -> Any:
        """Parameters of the contacts of a group, a contact a column."""
        symbol = self._symbol if inputs is None else inputs
        return ca.vertcat(*(symbol[name].T for name in group.parameters.values()))

    def _contacts(self, group: BalancedGroup, travel: Any) -> tuple[Any, ...]:
        """Forces of a group, their sizes, largest differences, Jacobian and slope by frequency."""
        kernel, symbol = graph_of(group.law, self.basis).force, self._symbol
        omega = symbol["frequency"]
        relative = ca.mtimes(constant(self.layout.directions), symbol["unknowns"])
        data = (
            self._motions(group, relative),
            self._motions(group, travel),
            self.values(group),
            symbol.get(group.events, ca.SX(0, group.n)),
        )
        columns = [
            kernel(motion, path, omega, values, events)
            for motion, path, values, events in zip(*map(ca.horzsplit, data), strict=True)
        ]
        forces, sizes, differences, slopes = zip(*columns, strict=True)
        pushes = ca.vertcat(*forces)
        by_frequency = ca.jacobian(pushes, omega)
        return (
            pushes,
            ca.vertcat(*sizes),
            ca.vertcat(*differences),
            ca.diagcat(*slopes),
            by_frequency,
        )

    def _close(self, inputs: list[Any], outputs: list[Any]) -> None:
        """The functions of equations whose events are closed forms."""
        symbol = self._symbol
        imposed = ca.SX.sym("imposed", sum(group.n_switches for group in self.groups))
        relative = ca.mtimes(constant(self.layout.directions), symbol["unknowns"])
        packed, first = [], 0
        for group in self.groups:
            graph, q = graph_of(group.law, self.basis).events, len(group.law.switches)
            if graph is None or not group.n:
                continue
            motions = ca.horzsplit(self._motions(group, relative))
            columns = []
            for motion, values in zip(motions, ca.horzsplit(self.values(group)), strict=True):
                held = imposed[first : first + q]
                columns.append(graph(motion, symbol["frequency"], values, held))
                first += q
            parts = [ca.horzcat(*map(ca.vec, part)) for part in zip(*columns, strict=True)]
            outputs = ca.substitute(outputs, [symbol[group.events]], [parts[0]])
            packed += parts
        self._closed_inputs = [*inputs[: len(inputs) - len(self.located)], imposed]
        outputs = [*outputs, *packed]
        self.closed_form = ca.Function("closed_form", self._closed_inputs, outputs)
        self._evaluate_closed = Compiled(self.closed_form)

    def derivative(self, name: str) -> ca.Function:
        """CasADi function of the sparse derivative of the residual by one of its inputs."""
        data = {"force_shape", "static_force", *(group.events for group in self.groups)}
        allowed = [n for n in self._symbol if n not in data]
        check.known(name, allowed, "input with a derivative")
        if name not in self._derivatives:
            derivative = self._known.get(name)
            if derivative is None:
                derivative = ca.jacobian(self._balance, self._symbol[name])
            self._derivatives[name] = ca.Function(
                f"derivative_by_{identifier(name)}",
                list(self._symbol.values()),
                [derivative],
                [identifier(n) for n in self._symbol],
                ["jacobian"],
            )
        return self._derivatives[name]

    def __call__(
        self,
        unknowns: FloatArray,
        frequency: float,
        arguments: list[FloatArray],
        contacts: ContactStates,
    ) -> list[FloatArray]:
        """Residual, magnitude, stored entries of the Jacobian, derivative by frequency."""
        events = [contacts.groups[group.name].events.ravel() for group in self.located]
        return self._evaluate(unknowns, frequency, *arguments, *events)

    def inertia(self, unknowns: FloatArray, frequency: float, arguments: list[FloatArray]) -> float:
        """The largest inertia force [N]."""
        return float(self._inertia(unknowns, frequency, *arguments)[0][0])

    def in_closed_form(
        self,
        unknowns: FloatArray,
        frequency: float,
        arguments: list[FloatArray],
        held: NDArray[np.bool_] | None,
    ) -> tuple[list[FloatArray], ContactStates]:
        """The same where events are closed forms, and the events; ``held`` imposes states."""
        imposed = FREE if held is None else held
        found = self._evaluate_closed(unknowns, frequency, *arguments, imposed)
        return found[:4], self.unpack(found[4:])

    def closed_groups(self, packed: list[Any]) -> list[tuple[BalancedGroup, list[Any]]]:
        """The groups that have events, with what `ContactLaw.event_graph` gives of each."""
        result, first = [], 0
        for group in self.groups:
            graph = graph_of(group.law, self.basis).events
            if graph is not None and group.n:
                result.append((group, packed[first : first + graph.n_out()]))
                first += graph.n_out()
        return result

    def unpack(self, packed: list[FloatArray], n_points: int = 1) -> ContactStates:
        """Events of all contacts in closed form, of one point or of several."""
        size = self.basis.n_components
        located = {}
        for group, parts in self.closed_groups(packed):
            n, q = n_points * group.n, len(group.law.switches)
            by_contact = [part.reshape(n, -1) for part in parts]
            # CasADi stores columns one after the other.
            by_contact[3] = by_contact[3].reshape(n, -1, q).transpose(0, 2, 1)
            own = [*by_contact[:4], *by_contact[5:]]
            located[group.name] = group.law.unpack(self.basis, own)
        return ContactStates(
            {
                group.name: located.get(group.name) or _nothing(group, n_points * group.n, size)
                for group in self.groups
            }
        )


def _nothing(group: BalancedGroup, n: int, size: int) -> Located:
    """Contacts without events."""
    q, none = len(group.law.switches), np.zeros((n, 0))
    states, by_motion = np.zeros((n, q)), np.zeros((n, q, size * group.rows.shape[1]))
    return Located(none, states > 0, states, by_motion)
