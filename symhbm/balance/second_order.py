"""The equations to second order: by unknowns, frequency and any parameters, exactly.

The balance weighted by multipliers is bilinear in displacements and parameters at fixed switching
angles; CasADi differentiates that. The angles move with the motion: the end of a stretch of stick
by ``-q / (k_d dy/dtau)``, ``q`` being the jump of the derivatives of the force there, its begin, a
reversal, by ``-(dphi/dtau) / (d2y/dtau2)``, ``phi`` being the basis functions. What that adds is
closed form too, for any number of reversals, and grows without bound towards the onset of slip.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np

from symhbm.balance.evaluation import Evaluation
from symhbm.balance.harmonic_balance import HarmonicBalance
from symhbm.model.contacts import ContactState, locate, slip_limit
from symhbm.numerics import Assembly, Compiled, FloatArray, FourierBasis, constant, turning_points

_GRAZING = 1e-9
"""Relative velocity at an onset, over its largest, below which it has no second derivative."""


@dataclass(frozen=True)
class Expansion:
    """Derivatives at one point, of the variables unknowns, frequency and parameters, in this order.

    ``evaluation`` is that of the balance; ``jacobian`` (n_unknowns, n_variables), its derivative;
    ``hessian`` (n_variables, n_variables), the second derivative of the balance times the
    multipliers: both dense or sparse by the number of variables.
    """

    evaluation: Evaluation
    jacobian: Any
    hessian: Any

    @property
    def by_parameters(self) -> Any:
        """Derivative of the balance by the parameters, (n_unknowns, n_parameters)."""
        return self.jacobian[:, self.jacobian.shape[0] + 1 :]


class SecondOrder:
    """Second derivatives of a problem and all its copies by ``with_parameters``.

    ``names`` are those of the parameters that are variables: their values at each blade or contact
    that is balanced, one name after the other; ``places`` tells where each is among the variables.
    Raises ValueError for friction over samples, which is piecewise linear.
    """

    def __init__(self, problem: HarmonicBalance, names: Sequence[str] = ()):
        if problem.samples is not None:
            raise ValueError(
                f"samples={problem.samples}: expected a problem with located switching angles; "
                "friction over samples is piecewise linear and has no second derivative"
            )
        if "cubic_stiffness" in names:
            problem.derivative("cubic_stiffness")
        self._balance = problem.residual
        symbol = {
            name: ca.SX.sym(name, self._balance.sparsity_in(name))
            for name in self._balance.name_in()
        }
        (balance,) = self._balance.call(list(symbol.values()))
        self.names = tuple(names)
        first = problem.n_unknowns + 1
        self.places: dict[str, slice] = {}
        for name in names:
            self.places[name] = slice(first, first + symbol[name].nnz())
            first += symbol[name].nnz()
        self.n_variables = first
        parameters = ca.vertcat(*(symbol[name].nz[:] for name in names))
        variables = ca.vertcat(symbol["unknowns"], symbol["frequency"], parameters)
        multipliers = ca.SX.sym("multipliers", problem.n_unknowns)
        jacobian = ca.jacobian(balance, variables)
        hessian = ca.hessian(ca.dot(multipliers, balance), variables)[0]
        size, n_contacts = problem.basis.n_components + 2, problem.n_contacts
        added = ca.SX.sym("added", size, n_contacts * size)
        if n_contacts:
            # The angles move with displacement, k_d and mu F_n of their own contact.
            relative = ca.mtimes(constant(problem.directions), symbol["unknowns"])
            limit = slip_limit(symbol["friction_coefficient"], symbol["normal_load"])
            local = ca.vertcat(
                ca.reshape(relative, size - 2, n_contacts), symbol["contact_stiffness"].T, limit.T
            )
            spread = ca.jacobian(ca.vec(local), variables)
            blocks = ca.diagcat(*ca.horzsplit(added, size))
            hessian += ca.mtimes([spread.T, blocks, spread])
        self._inputs = list(symbol)
        inputs = [*symbol.values(), multipliers, added]
        self._compiled = Compiled(ca.Function("second_order", inputs, [jacobian, hessian]))
        self._assemblies = Assembly(jacobian.sparsity()), Assembly(hessian.sparsity())

    def __call__(
        self,
        problem: HarmonicBalance,
        unknowns: FloatArray,
        frequency: float,
        multipliers: FloatArray,
        slip: Any = None,
        evaluation: Evaluation | None = None,
    ) -> Expansion:
        """Derivatives at ``unknowns`` (n_unknowns,) [m] and ``frequency`` [rad/s].

        ``multipliers`` (n_unknowns,) weigh the balance; ``slip`` (n_contacts,) imposes contact
        states, see `symhbm.model.contacts.locate`; ``evaluation`` is that of the balance there, in
        these states, where it is known.
        """
        if problem.residual is not self._balance:
            raise ValueError(
                "problem: expected the one these equations were built from, or a copy of it by "
                "with_parameters"
            )
        if evaluation is None:
            evaluation = problem.evaluate(unknowns, frequency, slip)
        friction = evaluation.friction
        # Without a spring nothing pulls the slider, whatever its limit.
        pulled = problem.contact_stiffness[:, None] > 0
        pulling = replace(friction, vector=np.where(pulled, friction.vector, 0.0))
        named = problem.arguments(unknowns, frequency, friction=pulling)
        added = moving_angles(
            problem.basis,
            problem.relative(unknowns),
            problem.contact_stiffness,
            problem.slip_limit,
            problem.relative(multipliers),
            friction.slip,
            friction,
        )
        inputs = [np.ravel(named[name], order="F") for name in self._inputs]
        found = self._compiled(*inputs, multipliers, added.ravel())
        jacobian, hessian = (
            assemble(values) for assemble, values in zip(self._assemblies, found, strict=True)
        )
        return Expansion(evaluation, jacobian, hessian)


def moving_angles(
    basis: FourierBasis,
    coefficients: FloatArray,
    contact_stiffness: FloatArray,
    slip_limit: FloatArray,
    weights: FloatArray,
    slip: Any,
    friction: ContactState | None = None,
) -> FloatArray:
    """Second derivatives of weighted friction forces by the motion of their angles alone.

    Parameters
    ----------
    basis
        The harmonic set.
    coefficients, weights : (n_contacts, n_components)
        Relative displacement [m], and the weights of the force's coefficients.
    contact_stiffness, slip_limit, slip : (n_contacts,)
        ``k_d`` [N/m], ``mu F_n`` [N], and whether each contact slips.
    friction
        The events of the contacts where they are known.

    Returns
    -------
    (n_contacts, n_components + 2, n_components + 2), by the displacement, ``k_d`` and ``mu F_n``.
    Where ``mu F_n`` is 0 the second derivative by it is unbounded, and 0 here.
    """
    n_contacts, size = coefficients.shape
    result = np.zeros((n_contacts, size + 2, size + 2))
    if friction is None:
        friction = locate(basis, coefficients, contact_stiffness, slip_limit)
    contact, begin, end = friction.stick_intervals
    kept = np.asarray(slip)[contact] & (contact_stiffness[contact] > 0)
    contact, begin, end = contact[kept], begin[kept], end[kept]
    stiffness, limit = contact_stiffness[contact], slip_limit[contact]
    motion, weight = coefficients[contact], weights[contact]

    at_begin, at_end = basis.values(begin), basis.values(end)
    jump = np.empty((len(contact), size + 2))
    jump[:, :size] = stiffness[:, None] * (at_end - at_begin)
    travel = np.einsum("im,im->i", at_end - at_begin, motion)
    jump[:, size] = travel
    # k_d times the travel is 0 or twice the limit, up or down.
    safe = np.where(limit > 0, limit, 1.0)
    jump[:, size + 1] = -2 * np.round(stiffness * travel / (2 * safe))
    velocity = np.einsum("im,im->i", basis.values(end, 1), motion)
    fastest = np.abs(motion) @ basis.order
    grazing = np.abs(velocity) <= _GRAZING * fastest
    test = np.einsum("im,im->i", at_end * basis.norm, weight)
    factor = np.where(grazing, 0.0, -test / (stiffness * np.where(grazing, 1.0, velocity)))
    np.add.at(result, contact, factor[:, None, None] * jump[:, :, None] * jump[:, None, :])

    slope = basis.values(begin, 1)
    bend = np.einsum("im,im->i", basis.values(begin, 2), motion)
    on_run = basis.integrals(basis.moments(np.column_stack([begin, end]))[:, 0])
    bend = np.where(bend == 0, np.inf, bend)
    share = np.einsum("im,im->i", on_run, weight) * stiffness / bend
    moved = share[:, None, None] * slope[:, :, None] * slope[:, None, :]
    np.add.at(result[:, :size, :size], contact, moved)
    # With no limit, where no run is left, the force turns its sign at the reversal itself.
    turned = np.where(limit > 0, 0.0, 2 * test / np.abs(bend))[:, None] * slope
    np.add.at(result[:, :size, size + 1], contact, turned)
    np.add.at(result[:, size + 1, :size], contact, turned)
    if basis.order[0] == 0:
        result[:, :size, :size] += _centred(basis, coefficients, contact_stiffness, weights, slip)
    return result


def _centred(basis, coefficients, contact_stiffness, weights, slip) -> FloatArray:
    """Of the static force of contacts that stick, centred between the extremes of the motion."""
    points = turning_points(basis, coefficients)
    low = points.angle[np.arange(len(coefficients)), points.lowest]
    bends = sum(turning_hessian(basis, coefficients, at) for at in (points.angle[:, 0], low))
    factor = np.where(slip, 0.0, -contact_stiffness / 2 * weights[:, 0])
    return factor[:, None, None] * bends


def extreme_hessian(
    basis: FourierBasis, coefficients: FloatArray, lowest: bool = False
) -> FloatArray:
    """Second derivatives of the largest, or ``lowest``, values of motions (n, n_components).

    (n, n_components, n_components) [1/m], zero for motions that are constant.
    """
    points = turning_points(basis, coefficients)
    rows = np.arange(len(coefficients))
    angle = points.angle[rows, points.lowest] if lowest else points.angle[:, 0]
    return turning_hessian(basis, coefficients, angle)


def turning_hessian(basis: FourierBasis, coefficients: FloatArray, angle: FloatArray) -> FloatArray:
    """As `extreme_hessian`, of the values at turning points whose ``angle`` (n,) [rad] is known."""
    slope = basis.values(angle, 1)
    bend = np.einsum("im,im->i", basis.values(angle, 2), coefficients)
    factor = -1 / np.where(bend == 0, np.inf, bend)
    return factor[:, None, None] * slope[:, :, None] * slope[:, None, :]
