"""The multi-harmonic balance equations, Eq. (9), compiled once for every parameter set."""

import threading
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from symhbm import check
from symhbm.contact import locate
from symhbm.excitation import Excitation
from symhbm.fourier import FloatArray, FourierBasis, check_harmonics
from symhbm.friction import LocatedFriction, friction_kernel
from symhbm.linear import DENSE_LIMIT
from symhbm.model import CONTACT_PARAMETERS, Model

MATRIX_INPUTS = ("mass", "damping", "stiffness")


@dataclass(frozen=True)
class Evaluation:
    """The equations at one point: residual and derivatives.

    ``residual`` (n_unknowns,) [N]; ``magnitude``, the largest sum of the absolute force terms of
    one equation [N]; ``jacobian`` by the unknowns [N/m], dense or sparse by size;
    ``by_parameter`` (n_unknowns,), the derivative by the moving parameter, for
    `HarmonicBalance.evaluate` the angular frequency [N s]; ``friction``,
    the events of the contacts.
    """

    residual: FloatArray
    magnitude: float
    jacobian: Any
    by_parameter: FloatArray
    friction: LocatedFriction

    @property
    def norm(self) -> float:
        """Largest residual relative to the largest sum of absolute force terms."""
        largest = float(np.max(np.abs(self.residual)))
        return largest / self.magnitude if self.magnitude > 0 else largest


class HarmonicBalance:
    """Multi-harmonic balance of a model under an excitation, Eq. (9).

    Parameters
    ----------
    model, excitation
        What vibrates, and what drives it.
    harmonics
        Harmonics of the response, for example ``(1,)``, ``(1, 3, 5)`` or ``(0, 1, 2, 3)``.

    Raises
    ------
    TypeError, ValueError
        For a bad harmonic set, or an excitation that does not fit the model or the set.

    Notes
    -----
    The unknowns are the Fourier coefficients [m], degree of freedom by degree of freedom,
    component by component within one. ``residual`` is one CasADi function of the unknowns, the
    angular frequency [rad/s] and all physical parameters; ``mass``, ``damping`` and ``stiffness``
    are the stored entries of the matrices in column order, which for a lumped model is one value
    per blade. Its inputs ``matrix`` and ``vector`` are the located contact events.
    """

    def __init__(self, model: Model, excitation: Excitation, harmonics: Iterable[int] = (1,)):
        if not isinstance(model, Model):
            raise TypeError(f"model={check.shown(model)}: expected a Model")
        if not callable(getattr(excitation, "shape", None)):
            raise TypeError(f"excitation={check.shown(excitation)}: expected an excitation")
        self.model = model
        self.excitation = excitation
        self.basis = FourierBasis(check_harmonics(harmonics))
        self._compiled = _CompiledBalance(model, self.basis)
        self._set_arguments()

    @property
    def harmonics(self) -> tuple[int, ...]:
        """The harmonics of the response."""
        return self.basis.harmonics

    @property
    def n_unknowns(self) -> int:
        """Number of Fourier coefficients."""
        return self.model.n_dof * self.basis.n_components

    @property
    def parameters(self) -> dict[str, Any]:
        """The named parameters of model and excitation and their values."""
        return self.model.parameters | self.excitation.parameters

    @property
    def residual(self) -> ca.Function:
        """CasADi function of Eq. (9): unknowns, frequency and parameters to forces [N]."""
        return self._compiled.residual

    def derivative(self, name: str) -> ca.Function:
        """CasADi function of the sparse exact derivative of the residual by one of its inputs.

        ``name`` is ``unknowns``, ``frequency`` or a parameter; KeyError lists the names.
        """
        return self._compiled.derivative(name)

    def arguments(
        self, unknowns: FloatArray, frequency: float, slip: NDArray[np.bool_] | None = None
    ) -> dict[str, FloatArray]:
        """Named inputs of `residual` and `derivative` at a point, its contact events located.

        ``unknowns`` (n_unknowns,) [m], ``frequency`` in rad/s; ``slip`` (n_contacts,) imposes
        contact states, see `symhbm.contact.locate`.
        """
        friction = self.locate(unknowns, slip)
        named = dict(zip(self._compiled.parameter_names, self._arguments, strict=True))
        n_contacts, size = friction.vector.shape
        named["matrix"] = friction.matrix.transpose(1, 0, 2).reshape(size, n_contacts * size)
        named["vector"] = friction.vector.T
        return {"unknowns": unknowns, "frequency": np.array([frequency])} | named

    def with_parameters(self, **values: Any) -> "HarmonicBalance":
        """Copy with other values of named parameters, sharing the compiled equations.

        Raises KeyError for a name that is no parameter, ValueError or TypeError for bad values.
        """
        for name in values:
            check.known(name, self.parameters)
        of_model = {k: v for k, v in values.items() if k in self.model.parameters}
        of_force = {k: v for k, v in values.items() if k not in of_model}
        other = object.__new__(HarmonicBalance)
        other.__dict__.update(self.__dict__)
        if of_model:
            other.model = self.model.with_parameters(**of_model)
        if of_force:
            other.excitation = self.excitation.with_parameters(**of_force)
        other._set_arguments()
        return other

    def coefficients(self, unknowns: FloatArray) -> FloatArray:
        """Unknowns as ``(n_dof, n_components)``."""
        return unknowns.reshape(self.model.n_dof, self.basis.n_components)

    def relative(self, unknowns: FloatArray) -> FloatArray:
        """Coefficients of the relative displacements, ``(n_contacts, n_components)`` [m]."""
        return self._directions @ self.coefficients(unknowns)

    def expand(self, contact: int, coefficients: FloatArray) -> FloatArray:
        """Derivative by the unknowns from that by one contact's coefficients (n_components,)."""
        direction = self._directions[[contact]].toarray()[0]
        return (direction[:, None] * coefficients).ravel()

    def locate(self, unknowns: FloatArray, slip: NDArray[np.bool_] | None = None):
        """Events of all contacts at the unknowns, see `symhbm.contact.locate`."""
        return locate(
            self.basis,
            self.relative(unknowns),
            self.model.contact_stiffness,
            self._slip_limit,
            slip,
        )

    def evaluate(
        self, unknowns: FloatArray, frequency: float, slip: NDArray[np.bool_] | None = None
    ) -> Evaluation:
        """Residual and derivatives at ``unknowns`` [m] and angular ``frequency`` [rad/s].

        ``slip`` (n_contacts,) imposes contact states, see `symhbm.contact.locate`.
        """
        friction = self.locate(unknowns, slip)
        compiled = self._compiled
        residual, magnitude, values, by_parameter = compiled(
            unknowns, frequency, self._arguments, friction
        )
        return Evaluation(
            residual, float(magnitude[0]), compiled.assemble(values), by_parameter, friction
        )

    def amplification(self, unknowns: FloatArray, frequency: float) -> float:
        """Largest inertia force over the largest exciting force (0 without one)."""
        force = abs(self.excitation.amplitude) * np.abs(self._arguments[-1]).max()
        inertia = self.model.mass_matrix @ (self.coefficients(unknowns) * self.basis.order**2)
        return float(frequency**2 * np.abs(inertia).max() / force) if force > 0 else 0.0

    def _set_arguments(self) -> None:
        model, excitation = self.model, self.excitation
        self._slip_limit = model.friction_coefficient * model.normal_load
        self._directions = model.directions
        named = {name: getattr(model, f"{name}_matrix").data for name in MATRIX_INPUTS}
        named |= {name: getattr(model, name) for name in CONTACT_PARAMETERS}
        named["force_amplitude"] = np.array([excitation.amplitude])
        named["force_shape"] = excitation.shape(model.n_dof, self.basis).ravel()
        self._arguments = [
            np.ascontiguousarray(named[name], dtype=float)
            for name in self._compiled.parameter_names
        ]

    def __reduce__(self):
        return HarmonicBalance, (self.model, self.excitation, self.harmonics)

    def __repr__(self) -> str:
        return (
            f"HarmonicBalance: harmonics {self.harmonics}, {self.n_unknowns} unknowns\n"
            f"{self.model!r}\n{self.excitation!r}"
        )


class _CompiledBalance:
    """Symbols and CasADi functions shared by all parameter sets of one structure."""

    parameter_names = (*MATRIX_INPUTS, *CONTACT_PARAMETERS, "force_amplitude", "force_shape")

    def __init__(self, model: Model, basis: FourierBasis):
        n_dof, n_contacts, size = model.n_dof, model.n_contacts, basis.n_components
        sparsity = {name: _sparsity(getattr(model, f"{name}_matrix")) for name in MATRIX_INPUTS}
        counts = {name: pattern.nnz() for name, pattern in sparsity.items()}
        counts |= dict.fromkeys(CONTACT_PARAMETERS, n_contacts)
        counts |= {"force_amplitude": 1, "force_shape": n_dof * size}
        symbol: dict[str, ca.SX] = {
            "unknowns": ca.SX.sym("unknowns", n_dof * size),
            "frequency": ca.SX.sym("omega"),
        }
        symbol |= {name: ca.SX.sym(name, counts[name]) for name in self.parameter_names}
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
                    *(symbol[name][j] for name in CONTACT_PARAMETERS),
                    contact[:, j * size : (j + 1) * size],
                    vector[:, j],
                )
                for j in range(n_contacts)
            ]
            friction = ca.horzcat(*columns) if columns else ca.SX(size, 0)
            return inertia, viscous, elastic, friction

        directions = _constant(model.directions)
        x = ca.reshape(symbol["unknowns"], size, n_dof).T
        force = symbol["force_amplitude"] * ca.reshape(symbol["force_shape"], size, n_dof).T
        omega = symbol["frequency"]
        inertia, viscous, elastic, friction = forces(
            x,
            ca.mtimes(directions, x),
            matrix,
            symbol["matrix"],
            symbol["vector"],
            omega,
            basis.derivative_matrix,
        )
        balance = elastic - inertia + viscous + ca.mtimes(friction, directions).T - force
        terms = forces(
            ca.fabs(x),
            ca.mtimes(ca.fabs(directions), ca.fabs(x)),
            {name: ca.fabs(value) for name, value in matrix.items()},
            ca.fabs(symbol["matrix"]),
            ca.fabs(symbol["vector"]),
            omega,
            np.abs(basis.derivative_matrix),
        )
        total = terms[0] + terms[1] + terms[2] + ca.fabs(force)
        total += ca.mtimes(terms[3], ca.fabs(directions)).T
        self._equations = ca.reshape(balance.T, -1, 1)

        names = list(symbol)
        inputs = list(symbol.values())
        self.residual = ca.Function("residual", inputs, [self._equations], names, ["residual"])
        jacobian = ca.jacobian(self._equations, symbol["unknowns"])
        self._evaluate = ca.Function(
            "evaluate",
            inputs,
            [
                self._equations,
                ca.mmax(total),
                jacobian,
                ca.densify(ca.jacobian(self._equations, omega)),
            ],
            names,
            ["residual", "magnitude", "jacobian", "by_parameter"],
        )
        self._size = n_dof * size
        self._rows = np.array(jacobian.sparsity().row(), dtype=np.int32)
        self._starts = np.array(jacobian.sparsity().colind(), dtype=np.int32)
        columns = np.repeat(np.arange(self._size), np.diff(self._starts))
        self._flat = columns * self._size + self._rows
        self._derivatives: dict[str, ca.Function] = {}
        self._lock = threading.Lock()
        self._connect()

    def derivative(self, name: str) -> ca.Function:
        allowed = [n for n in self._symbol if n not in ("matrix", "vector", "force_shape")]
        check.known(name, allowed, "input with a derivative")
        if name not in self._derivatives:
            self._derivatives[name] = ca.Function(
                f"derivative_by_{name}",
                list(self._symbol.values()),
                [ca.jacobian(self._equations, self._symbol[name])],
                list(self._symbol),
                ["jacobian"],
            )
        return self._derivatives[name]

    def _connect(self) -> None:
        """Give CasADi memory of NumPy to read and write: no conversion at a call."""
        function = self._evaluate
        self._buffer, self._trigger = function.buffer()
        self._inputs = [np.zeros(function.nnz_in(i)) for i in range(function.n_in())]
        self._outputs = [np.zeros(function.nnz_out(i)) for i in range(function.n_out())]
        for i, array in enumerate(self._inputs):
            self._buffer.set_arg(i, memoryview(array))  # type: ignore
        for i, array in enumerate(self._outputs):
            self._buffer.set_res(i, memoryview(array))  # type: ignore

    def __call__(self, unknowns, frequency, arguments, friction: LocatedFriction):
        with self._lock:
            inputs = self._inputs
            inputs[0][:] = unknowns
            inputs[1][0] = frequency
            for array, value in zip(inputs[2:-2], arguments, strict=True):
                array[:] = value
            # CasADi stores columns one after the other.
            inputs[-2][:] = friction.matrix.transpose(0, 2, 1).ravel()
            inputs[-1][:] = friction.vector.ravel()
            self._trigger()
            return [array.copy() for array in self._outputs]

    def assemble(self, values: FloatArray) -> Any:
        """Jacobian from its stored entries: a full matrix up to a size, sparse above."""
        if self._size > DENSE_LIMIT:
            return sp.csc_array((values, self._rows, self._starts), shape=(self._size, self._size))
        matrix = np.zeros(self._size * self._size)
        matrix[self._flat] = values
        return matrix.reshape(self._size, self._size).T


def _sparsity(matrix: sp.csc_array) -> ca.Sparsity:
    rows, columns = matrix.shape  # type: ignore
    return ca.Sparsity(rows, columns, list(matrix.indptr), list(matrix.indices))


def _constant(matrix: sp.csr_array) -> ca.DM:
    columns = matrix.tocsc()
    columns.sort_indices()
    return ca.DM(_sparsity(columns), columns.data)
