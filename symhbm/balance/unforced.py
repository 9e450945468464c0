"""Problems without a force that oscillates, and the force that sustains a motion all the same.

The extended periodic motion concept adds negative damping to the equations of a free motion,
``M x'' + (C - 2 D omega M) x' + K x + f(x) = 0``, with the damping ratio ``D`` that makes it
periodic: what a nonlinear mode dissipates, a force ``2 D omega M x'`` gives back.

Reference: M. Krack, Nonlinear modal analysis of nonconservative systems: extension of the periodic
motion concept, Computers and Structures 154 (2015), 59-71.
"""

from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import scipy.sparse as sp

from symhbm.balance.evaluation import Evaluation
from symhbm.balance.harmonic_balance import HarmonicBalance
from symhbm.balance.problem import nothing_on
from symhbm.model import EngineOrder, find_symmetry
from symhbm.model.cyclic import Sector, displacements
from symhbm.model.linear import Matrices
from symhbm.numerics import Assembly, Compiled, FloatArray, check, sparsity_of


def unforced(problem: HarmonicBalance, nodal_diameter: int | None = None) -> HarmonicBalance:
    """The problem without what of its force oscillates; static loads stay.

    With a ``nodal_diameter`` it is that of one sector, in the wave of so many nodal diameters: each
    sector lags the one before, with a negative number the one behind. Of a `symhbm.Sector` it is by
    default the wave of its engine order.

    Raises TypeError or ValueError for a bad number of nodal diameters, and for a structure without
    equal sectors.
    """
    if problem.goal is not None:
        raise ValueError(
            f"problem: expected peaks of displacements or of an output, free motions have none of "
            f"{problem.goal!r}"
        )
    model = problem.model
    rest = problem.excitation.still if problem.loaded else None
    if isinstance(model, Sector):
        n = model.n_sectors
        order = model.wave(1) if nodal_diameter is None else _wave(nodal_diameter, n)
        still = EngineOrder(order, amplitude=0.0, pattern={1: {0: 1.0}})
        return problem.with_excitation(still if rest is None else still + rest)
    rest = nothing_on(model) if rest is None else rest
    alone = problem.with_excitation(rest)
    if nodal_diameter is None:
        return alone
    symmetry = find_symmetry(model, rest, problem.basis)
    if symmetry is None:
        raise ValueError(
            f"nodal_diameter={check.shown(nodal_diameter)}: expected None, only a structure of "
            "equal sectors, numbered one after the other around the disk, moves in waves"
        )
    return alone.of_sector(replace(symmetry, lag=_wave(nodal_diameter, symmetry.n_sectors)))


def _wave(nodal_diameter: int, n_sectors: int) -> int:
    """The wave of some nodal diameters, 0 to N - 1."""
    highest = n_sectors // 2
    return check.integer("nodal_diameter", nodal_diameter, -highest, highest) % n_sectors


class SustainedMotion:
    """The force ``2 D omega M x'`` on the motions of one problem, and what else tells their size.

    Calling it adds that force to the equations at one point. ``inertia`` (n_unknowns, n_unknowns),
    sparse, is the mass matrix of the coefficients of all harmonics above 0.

    Raises TypeError for a structure without matrices, ValueError for one whose matrices change with
    the frequency.
    """

    def __init__(self, problem: HarmonicBalance):
        check_mass(problem)
        basis = problem.basis

        def mass_in(harmonic: int) -> Any:
            return matrices_in(problem, harmonic).mass_matrix

        momentum = displacements(lambda n: 1j * n * mass_in(n), basis)
        self._momentum = sp.csc_array(momentum)
        self._momentum.sort_indices()
        self.inertia = sp.csc_array(displacements(lambda n: (n > 0) * mass_in(n), basis))
        # The sparsity is that of the structure, and the same for its copies.
        made = problem.equations.once(("sustained",), lambda: _function(self._momentum))
        self._force, self._assemblies = made

    def __call__(
        self, free: Evaluation, unknowns: FloatArray, frequency: float, damping_ratio: float
    ) -> tuple[Evaluation, FloatArray]:
        """The equations with the force, and their derivative by the damping ratio, (n_unknowns,).

        ``free`` are those without it, at ``unknowns`` (n_unknowns,) [m] and ``frequency`` [rad/s].
        """
        at = unknowns, frequency, damping_ratio, self._momentum.data
        assemble = self._assemblies[sp.issparse(free.jacobian)]
        force, size, jacobian, by_frequency, by_damping = self._force(*at)
        with_force = replace(
            free,
            residual=free.residual - force,
            magnitude=free.magnitude + float(size[0]),
            jacobian=free.jacobian - assemble(jacobian),
            by_parameter=free.by_parameter - by_frequency,
        )
        return with_force, -by_damping

    def force(self, unknowns: FloatArray, frequency: float, damping_ratio: float) -> FloatArray:
        """Coefficients of the force alone, (n_unknowns,) [N]."""
        return self._force(unknowns, frequency, damping_ratio, self._momentum.data)[0]

    def bend(
        self,
        weights: FloatArray,
        unknowns: FloatArray,
        frequency: float,
        damping_ratio: float,
        along: FloatArray,
    ) -> FloatArray:
        """Second derivatives (k, k) of ``weights`` times the force, ``along`` (n_unknowns + 2, k).

        Along changes of the unknowns, the frequency and the damping ratio.
        """
        n = len(weights)
        pulled = 2 * (self._momentum.T @ weights)
        size, moved, (faster, more) = pulled @ unknowns, pulled @ along[:n], along[n:]
        mixed = frequency**2 * np.outer(more, moved) + 2 * frequency * np.outer(
            faster, damping_ratio * moved + size * more
        )
        return mixed + mixed.T + 2 * damping_ratio * size * np.outer(faster, faster)

    def modal_amplitude(self, unknowns: FloatArray) -> float:
        """Root of the sum of ``X_n^H M X_n`` over harmonics above 0, ``unknowns`` (n_unknowns,)."""
        return float(np.sqrt(max(unknowns @ (self.inertia @ unknowns), 0.0)))


_Sustain = tuple[Compiled, tuple[Assembly, Assembly]]
"""What evaluates the force, and makes its Jacobian a full or a sparse matrix."""


def _function(momentum: Any) -> _Sustain:
    """The force, the size of its largest terms and its derivatives, from entries of a matrix."""
    unknowns, entries = ca.SX.sym("unknowns", momentum.shape[1]), ca.SX.sym("m", momentum.nnz)
    omega, ratio = ca.SX.sym("omega"), ca.SX.sym("damping_ratio")
    matrix = ca.SX(sparsity_of(momentum), entries)
    factor = 2 * ratio * omega**2
    force = factor * ca.mtimes(matrix, unknowns)
    size = ca.mmax(ca.mtimes(ca.fabs(factor * matrix), ca.fabs(unknowns)))
    slopes = [ca.densify(ca.jacobian(force, variable)) for variable in (omega, ratio)]
    inputs = [unknowns, omega, ratio, entries]
    outputs = [ca.densify(force), size, factor * matrix, *slopes]
    pattern = matrix.sparsity()
    assemblies = Assembly(pattern, as_full=True), Assembly(pattern, as_full=False)
    return Compiled(ca.Function("sustain", inputs, outputs)), assemblies


def matrices_in(problem: HarmonicBalance, harmonic: int) -> Matrices:
    """Matrices (n_dof, n_dof) of a harmonic, sparse, complex of one sector of a disk."""
    model: Any = problem.model
    symmetry = problem.symmetry
    if symmetry is None:
        return model.matrices_in(harmonic)
    phases, rows = symmetry.phases(symmetry.wave(harmonic)), np.arange(symmetry.n_dof)
    return Matrices(*(getattr(model, name)[rows] @ phases for name in Matrices._fields))


def check_mass(problem: HarmonicBalance) -> None:
    """Raise TypeError for a structure without a mass matrix, ValueError for one that turns."""
    model = problem.model
    if not model.is_polynomial:
        raise TypeError(
            "problem: expected a structure with a mass matrix, this one is given by its dynamic "
            "stiffness; symhbm.craig_bampton reduces a large structure to few degrees of freedom "
            "with matrices"
        )
    if model.engine_order is not None:
        raise ValueError(
            f"problem: expected a structure whose matrices do not change with the frequency, got "
            f"{check.shown(type(model).__name__)} along engine order {model.engine_order:g}; give "
            "it at one speed, as by its method at(speed)"
        )
