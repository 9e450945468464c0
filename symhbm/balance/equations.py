"""The equations of Eq. (9) as CasADi functions, shared by all parameter sets of one structure."""

from typing import Any

import casadi as ca
import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from symhbm.model import FRICTION_PARAMETERS, Structure, Symmetry
from symhbm.model.contacts import (
    FREE,
    ContactState,
    cubic_kernel,
    friction_kernel,
    layout,
    one_harmonic_kernel,
    packed_size,
    slip_limit,
    unpack,
)
from symhbm.numerics import (
    Assembly,
    Compiled,
    FloatArray,
    FourierBasis,
    check,
    constant,
    sparsity_of,
)

MATRIX_INPUTS = ("mass", "damping", "stiffness")
FORCE_INPUTS = ("force_amplitude", "force_shape")


class Equations:
    """Symbols of one structure and harmonic set, and the functions compiled from them.

    ``residual`` maps the named inputs (unknowns, frequency, ``parameter_names`` and the contact
    data ``matrix`` and ``vector``) to the forces [N]. Calling the object evaluates residual,
    magnitude, stored entries of the Jacobian and the derivative by frequency. ``cubic`` adds the
    cubic springs and their parameter, which cost time where there are none. With a ``symmetry``
    they are those of one sector: its unknowns, its equations and its contacts.

    ``expansion`` (sparse) gives the unknowns of the whole structure, ``directions`` (sparse) the
    coefficients of the relative displacements from the unknowns, contact by contact. ``assemble``
    makes the stored entries of the Jacobian a matrix, full up to a size, sparse above. ``closed``
    tells that the events of contacts are closed forms, found in the same call: ``closed_form`` maps
    unknowns, frequency, parameters and imposed contact states to residual, magnitude, Jacobian,
    derivative by frequency and packed events, and ``conservative`` maps the first three to the
    Jacobian of elastic less inertia forces and the inertia forces (n_dof, n_components).
    """

    def __init__(
        self,
        model: Structure,
        basis: FourierBasis,
        cubic: bool = False,
        symmetry: Symmetry | None = None,
    ):
        self.cubic, self.basis = cubic, basis
        size = basis.n_components
        self.dofs, self.contacts = np.arange(model.n_dof), np.arange(model.n_contacts)
        self.expansion: Any = sp.eye_array(model.n_dof * size, format="csr")
        if symmetry is not None:
            self.dofs, self.contacts = self.dofs[: symmetry.n_dof], symmetry.contacts
            self.expansion = symmetry.expansion(basis)
        directions = model.directions[self.contacts]
        each = sp.eye_array(size)
        self.directions = (sp.kron(directions, each) @ self.expansion).tocsr()
        self.directions.eliminate_zeros()
        self.directions_absolute = (sp.kron(abs(directions), each) @ abs(self.expansion)).tocsr()
        springs = ("cubic_stiffness",) if cubic else ()
        contact_names = (*FRICTION_PARAMETERS, *springs)
        self.parameter_names = (*MATRIX_INPUTS, *contact_names, *FORCE_INPUTS)
        n_dof, n_contacts = len(self.dofs), len(self.contacts)
        sparsity = {name: sparsity_of(self.rows(model, name)) for name in MATRIX_INPUTS}
        counts = {name: pattern.nnz() for name, pattern in sparsity.items()}
        counts |= dict.fromkeys(contact_names, n_contacts)
        counts |= {"force_amplitude": 1, "force_shape": n_dof * size}
        symbol: dict[str, Any] = {
            "unknowns": ca.SX.sym("unknowns", n_dof * size),
            "frequency": ca.SX.sym("omega"),
        }
        for name in self.parameter_names:
            symbol[name] = ca.SX.sym(name, counts[name])
        symbol["matrix"] = ca.SX.sym("matrix", size, n_contacts * size)
        symbol["vector"] = ca.SX.sym("vector", size, n_contacts)
        self._symbol = symbol

        matrix = {name: ca.SX(sparsity[name], symbol[name]) for name in MATRIX_INPUTS}
        kernel = friction_kernel(size)

        def forces(x, y, matrices, contact, vector, omega, derivative):
            """Inertia, damping, elastic and friction terms, ``(n_dof, size)`` each."""
            omega_n = omega * ca.DM(basis.order).T
            inertia = ca.mtimes(matrices["mass"], x) * ca.repmat(omega_n**2, n_dof, 1)
            viscous = omega * ca.mtimes([matrices["damping"], x, ca.DM(derivative).T])
            elastic = ca.mtimes(matrices["stiffness"], x)
            columns = [
                kernel(
                    y[j, :].T,
                    *(symbol[name][j] for name in FRICTION_PARAMETERS),
                    contact[:, j * size : (j + 1) * size],
                    vector[:, j],
                )
                for j in range(n_contacts)
            ]
            friction = ca.horzcat(*columns) if columns else ca.SX(size, 0)
            return inertia, viscous, elastic, friction

        spread, spread_absolute = constant(self.directions), constant(self.directions_absolute)
        whole = ca.mtimes(constant(self.expansion), symbol["unknowns"])
        x = ca.reshape(whole, size, model.n_dof).T
        relative = ca.reshape(ca.mtimes(spread, symbol["unknowns"]), size, n_contacts).T
        force = symbol["force_amplitude"] * ca.reshape(symbol["force_shape"], size, n_dof).T
        omega = symbol["frequency"]
        inertia, viscous, elastic, friction = forces(
            x,
            relative,
            matrix,
            symbol["matrix"],
            symbol["vector"],
            omega,
            basis.derivative_matrix,
        )
        springs, springs_total = self._springs(basis, relative)
        smooth = ca.vec((elastic - inertia + viscous).T) + ca.mtimes(spread.T, ca.vec(springs))
        self._balance = smooth + ca.mtimes(spread.T, ca.vec(friction)) - ca.vec(force.T)
        travel = ca.mtimes(spread_absolute, ca.fabs(symbol["unknowns"]))
        terms = forces(
            ca.fabs(x),
            ca.reshape(travel, size, n_contacts).T,
            {name: ca.fabs(value) for name, value in matrix.items()},
            ca.fabs(symbol["matrix"]),
            ca.fabs(symbol["vector"]),
            omega,
            np.abs(basis.derivative_matrix),
        )
        total = ca.vec((terms[0] + terms[1] + terms[2] + ca.fabs(force)).T)
        total += ca.mtimes(spread_absolute.T, ca.vec(terms[3] + springs_total))

        names = list(symbol)
        inputs = list(symbol.values())
        self.residual = ca.Function("residual", inputs, [self._balance], names, ["residual"])
        # Derivatives of what is bilinear by rule: tracing it takes longer than factorising it.
        turned = basis.derivative_matrix
        stiffness, damping, mass = (
            self._spread_out(model, name, factor)
            for name, factor in (
                ("stiffness", np.eye(size)),
                ("damping", turned),
                ("mass", -turned @ turned),
            )
        )
        conservative = stiffness - omega**2 * mass
        jacobian = conservative + omega * damping + self._friction_jacobian(spread.T)
        if cubic and n_contacts:
            of_springs = ca.jacobian(ca.vec(springs), symbol["unknowns"])
            jacobian += ca.mtimes(spread.T, of_springs)
        slope = ca.mtimes(damping - 2 * omega * mass, symbol["unknowns"])
        by_parameter = ca.densify(slope)
        self._known = {"unknowns": jacobian, "frequency": slope}
        outputs = [self._balance, ca.mmax(total), jacobian, by_parameter]
        self._evaluate = Compiled(ca.Function("evaluate", inputs, outputs))
        self.assemble = Assembly(jacobian.sparsity())
        self.closed = basis.highest == 1
        if self.closed:
            imposed = ca.SX.sym("imposed", n_contacts)
            events = self._events(relative, imposed)
            if n_contacts:
                located = [symbol["matrix"], symbol["vector"]]
                outputs = ca.substitute(outputs, located, _split(events, size))
            outputs[1] += self._stretches(travel, events, size)
            inputs = [*inputs[:-2], imposed]
            self.closed_form = ca.Function("closed_form", inputs, [*outputs, events])
            self._evaluate_closed = Compiled(self.closed_form)
            self.conservative = ca.Function("conservative", inputs[:-1], [conservative, inertia])
        self._derivatives: dict[str, ca.Function] = {}

    def rows(self, model: Structure, name: str) -> Any:
        """The rows of a matrix of the structure that are balanced here, by columns."""
        if not model.has_matrices:
            return sp.csc_array((model.n_dof, model.n_dof))  # `DynamicStiffness` has them
        matrix = getattr(model, f"{name}_matrix")
        return matrix if len(self.dofs) == model.n_dof else matrix[self.dofs].tocsc()

    def _spread_out(self, model: Structure, name: str, factor: FloatArray) -> Any:
        """A matrix of the structure that acts on components as ``factor`` does, by the unknowns."""
        rows = self.rows(model, name)
        layout = sp.csc_array((np.arange(rows.nnz) + 1.0, rows.indices, rows.indptr), rows.shape)
        one, other = sp.coo_array(factor), sp.coo_array(factor != 0)
        place = sp.csc_array(sp.kron(layout, other))
        stored = sp.csc_array((np.ones(rows.nnz), rows.indices, rows.indptr), rows.shape)
        values = sp.csc_array(sp.kron(stored, one)).data
        entries = ca.vec(self._symbol[name][(place.data - 1).astype(int).tolist()])
        whole = ca.SX(sparsity_of(place), entries * ca.DM(values))
        if len(self.dofs) == model.n_dof:
            return whole
        return ca.mtimes(whole, constant(self.expansion))

    def _friction_jacobian(self, spread: Any) -> Any:
        """Derivative of the friction forces by the unknowns: bilinear forces need no tracing."""
        n_contacts, size = len(self.contacts), self._symbol["vector"].shape[0]
        stiffness, matrix = self._symbol["contact_stiffness"], self._symbol["matrix"]
        blocks = [stiffness[j] * matrix[:, j * size : (j + 1) * size] for j in range(n_contacts)]
        return ca.mtimes([spread, ca.diagcat(*blocks), spread.T]) if blocks else 0

    def _events(self, relative: Any, imposed: Any) -> Any:
        """The events of all contacts under one harmonic, packed, a column each."""
        kernel = one_harmonic_kernel(relative.shape[1])
        columns = []
        for j in range(relative.shape[0]):
            stiffness, friction, load = (self._symbol[name][j] for name in FRICTION_PARAMETERS)
            columns.append(
                kernel(relative[j, :].T, stiffness, slip_limit(friction, load), imposed[j])
            )
        return ca.horzcat(*columns) if columns else ca.SX(packed_size(relative.shape[1]), 0)

    def _stretches(self, travel: Any, events: Any, size: int) -> Any:
        """Largest of the two terms of stretches of stick, ``k_d`` times where they begin and end.

        Their difference is the force: where a contact slips far, two large terms.
        """
        state, stick = (events[layout(size)[name], :] for name in ("slip", "stick_fraction"))
        farthest = [ca.mmax(part) for part in ca.vertsplit(travel, size)]
        spring = self._symbol["contact_stiffness"].T
        largest = 2 * spring * ca.horzcat(*farthest) * state * stick
        return ca.mmax(largest) if farthest else 0

    def _springs(self, basis: FourierBasis, y: Any) -> tuple[Any, Any]:
        """Forces of the cubic springs and their magnitudes, ``(size, n_contacts)`` each."""
        size, n_contacts = basis.n_components, y.shape[0]
        if not self.cubic or not n_contacts:
            return ca.SX(size, n_contacts), ca.SX(size, n_contacts)
        kernel, stiffness = cubic_kernel(basis), self._symbol["cubic_stiffness"]
        columns = [kernel(y[j, :].T, stiffness[j]) for j in range(n_contacts)]
        forces, magnitudes = zip(*columns, strict=True)
        return ca.horzcat(*forces), ca.horzcat(*magnitudes)

    def derivative(self, name: str) -> ca.Function:
        """CasADi function of the sparse derivative of the residual by one of its inputs."""
        allowed = [n for n in self._symbol if n not in ("matrix", "vector", "force_shape")]
        check.known(name, allowed, "input with a derivative")
        if name not in self._derivatives:
            derivative = self._known.get(name)
            if derivative is None:
                derivative = ca.jacobian(self._balance, self._symbol[name])
            self._derivatives[name] = ca.Function(
                f"derivative_by_{name}",
                list(self._symbol.values()),
                [derivative],
                list(self._symbol),
                ["jacobian"],
            )
        return self._derivatives[name]

    def __call__(
        self,
        unknowns: FloatArray,
        frequency: float,
        arguments: list[FloatArray],
        friction: ContactState,
    ) -> list[FloatArray]:
        """Residual, magnitude, stored entries of the Jacobian, derivative by frequency."""
        # CasADi stores columns one after the other.
        matrix = friction.matrix.transpose(0, 2, 1).ravel()
        return self._evaluate(unknowns, frequency, *arguments, matrix, friction.vector.ravel())

    def in_closed_form(
        self,
        unknowns: FloatArray,
        frequency: float,
        arguments: list[FloatArray],
        slip: NDArray[np.bool_] | None,
    ) -> tuple[list[FloatArray], ContactState]:
        """The same under one harmonic, and the events; ``slip`` imposes states."""
        imposed = FREE if slip is None else slip
        *found, events = self._evaluate_closed(unknowns, frequency, *arguments, imposed)
        return found, self.unpack(events)

    def packed(
        self, unknowns: FloatArray, frequency: float, arguments: list[FloatArray]
    ) -> list[FloatArray]:
        """The same in states that the motion asks for, with the events as `unpack` takes them."""
        return self._evaluate_closed(unknowns, frequency, *arguments, FREE)

    def unpack(self, events: FloatArray) -> ContactState:
        """Events of all contacts, under one harmonic, of one point or of several."""
        size = self._symbol["vector"].shape[0]
        return unpack(events.reshape(-1, packed_size(size)), size)


def _split(events: Any, size: int) -> list[Any]:
    """Matrices side by side and vectors of packed events."""
    place = layout(size)
    columns = ca.horzsplit(events[place["matrix"], :])
    matrices = [ca.reshape(column, size, size) for column in columns]
    return [ca.horzcat(*matrices), events[place["vector"], :]]
