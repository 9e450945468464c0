"""Friction with the switching angles as unknowns, Eqs. (4)-(11): symbolic, with an exact Hessian.

From the largest relative displacement at ``theta_0`` on, a contact sticks up to ``theta_star`` and
slips from there up to ``theta_0 + pi``; the second half period mirrors the first. The force is the
closed form of `symhbm.model.contacts.coulomb`, its matrix and vector here functions of the two
angles. The unknown of ``theta_star`` is ``rho = (1 - cos(theta_star - theta_0)) / 2``: for one
harmonic the limit over the largest spring force.

Reference: E. Chatelet, D. Rade, G. Jacquet-Richardet, DINAME 2013 (hal-00941429).
"""

from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symhbm.balance.equations import BalancedGroup, identifier
from symhbm.balance.evaluation import ContactStates
from symhbm.balance.harmonic_balance import HarmonicBalance
from symhbm.model.contacts import Coulomb
from symhbm.numerics import FloatArray, FourierBasis, constant, monotone_root, turning_points

DUMMY = (0.0, 0.5)
"""``theta_0`` [rad] and ``rho`` of a contact that does not slip: any angles without singularity."""
SLACK = 1e-9
"""What a converged motion may miss of a condition, relative to its spread."""
_MARGIN = 1e-12
"""Distance a start keeps from the onset of slip, where second derivatives are infinite."""


class SwitchingAngles:
    """Eqs. (4)-(11) of ``problem`` and of all its copies by ``with_parameters``.

    Raises ValueError if a harmonic is not odd: the second half period is then no mirror.

    Attributes
    ----------
    n_coefficients, n_contacts
        Numbers of Fourier coefficients and of contacts.
    n_unknowns
        Number of coefficients [m], of ``theta_0`` [rad] and of ``rho`` [-], in this order; one of
        the latter two per contact.
    residual
        CasADi function of the named inputs to ``residual`` (n_unknowns,) [N]: Eq. (9), then per
        contact Eq. (10) as ``k_d dy/dtau = 0`` at ``theta_0``, then per contact Eq. (11) as
        ``k_d (y(theta_0) - y(theta_star)) / 2 - g = 0``, ``g = mu F_n``.
    jacobian, hessian
        CasADi functions, sparse and exact: the derivative of `residual` by the unknowns, and the
        symmetric second derivative of ``multipliers @ residual``, ``multipliers`` (n_unknowns,)
        being one more input.

    Notes
    -----
    The input ``slip`` (n_contacts,) is 1 for this form, 0 for the spring alone with both angles
    held at `DUMMY`. It must be 0 for a contact without spring or limit, whose force is zero.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    >>> angles = sh.SwitchingAngles(problem)
    >>> angles.n_coefficients, angles.n_contacts, angles.n_unknowns
    (2, 1, 4)
    >>> angles.jacobian.size_out(0)
    (4, 4)
    """

    def __init__(self, problem: HarmonicBalance):
        basis, (group, law) = problem.basis, friction_of(problem)
        n_contacts = group.n
        check_odd(basis.harmonics)
        self._balance = problem.residual
        self._ends = [problem.n_unknowns, problem.n_unknowns + n_contacts]
        self.n_coefficients, self.n_contacts = problem.n_unknowns, n_contacts
        self.n_unknowns = problem.n_unknowns + 2 * n_contacts

        symbol: dict[str, Any] = {"unknowns": ca.SX.sym("unknowns", self.n_unknowns)}
        for name in self._balance.name_in()[1:]:
            if name != identifier(group.events):
                symbol[name] = ca.SX.sym(name, self._balance.sparsity_in(name))
        symbol["slip"] = ca.SX.sym("slip", n_contacts)
        x, theta_0, rho = ca.vertsplit(symbol["unknowns"], [0, *self._ends, self.n_unknowns])
        values = symbol | {"unknowns": x}
        kernel, spring = switching_kernel(basis), ca.DM.eye(basis.n_components)
        events, turning, onset = [], [], []
        for j, at in enumerate(problem.equations.motions_of(group, values)):
            slip, stiffness = symbol["slip"][j], at.values["contact_stiffness"]
            limit = law.slip_limit(at.frequency, at.values)
            # The side not taken is evaluated too: at an angle where it is finite.
            safe = slip * rho[j] + (1 - slip) * DUMMY[1]
            matrix, vector, slope, drop = kernel(at.motion, theta_0[j], safe)
            matrix = (limit > 0) * (slip * matrix + (1 - slip) * spring)
            events.append(ca.vertcat(ca.vec(matrix), slip * vector, 0))
            turning.append(slip * stiffness * slope + (1 - slip) * (theta_0[j] - DUMMY[0]))
            onset.append(slip * (stiffness * drop / 2 - limit) + (1 - slip) * (rho[j] - DUMMY[1]))
        values |= {identifier(group.events): ca.horzcat(*events)}
        balance = self._balance.call([values[name] for name in self._balance.name_in()])[0]
        equations = ca.vertcat(balance, *turning, *onset)

        multipliers = ca.SX.sym("multipliers", self.n_unknowns)
        jacobian = ca.jacobian(equations, symbol["unknowns"])
        hessian = ca.hessian(ca.dot(multipliers, equations), symbol["unknowns"])[0]
        self._names = list(symbol)
        self.residual = _function("residual", symbol, equations)
        self.jacobian = _function("jacobian", symbol, jacobian)
        self.hessian = _function("hessian", symbol | {"multipliers": multipliers}, hessian)

    def arguments(
        self,
        problem: HarmonicBalance,
        unknowns: FloatArray,
        frequency: float,
        slip: NDArray[np.bool_],
        friction: ContactStates | None = None,
    ) -> dict[str, FloatArray]:
        """Named inputs of `residual` and `jacobian` at a point with the parameters of ``problem``.

        ``unknowns`` (n_unknowns,), ``frequency`` in rad/s, ``slip`` (n_contacts,); ``friction``
        are the events of the contacts where they are known, which no input depends on. Raises
        ValueError if these are not the equations of ``problem``.
        """
        problem.check_equations(self._balance)
        named = problem.arguments(self.split(unknowns)[0], frequency, states=friction)
        named |= {"unknowns": unknowns, "slip": np.asarray(slip, dtype=float)}
        return {name: named[name] for name in self._names}

    def split(self, unknowns: FloatArray) -> list[FloatArray]:
        """Coefficients [m], ``theta_0`` [rad] and ``rho`` [-] of ``unknowns`` (n_unknowns,)."""
        return np.split(unknowns, self._ends)

    def start(
        self, problem: HarmonicBalance, unknowns: FloatArray, slip: NDArray[np.bool_] | None = None
    ) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Unknowns (n_unknowns,) and ``slip`` (n_contacts,) from coefficients [m].

        ``theta_star`` is the first angle with ``y = y(theta_0) - 2 g / k_d``, Eq. (11). By default
        the motion tells which contacts slip. One held in ``slip`` short of its limit has the
        ``rho`` above 1 that the equations continue to.
        """
        _, rows, stiffness, limit = problem.contacts.sliders()
        located = problem.locate(unknowns, 0.0)
        asked = located.switches if slip is None else slip
        slip = asked & (limit > 0) & (stiffness > 0)
        assert slip is not None
        theta_0, rho = (np.full(len(slip), value) for value in DUMMY)
        if slip.any():
            travel = 2 * limit[slip] / stiffness[slip]
            first, onset = _first_slip(
                problem.basis, problem.layout.relative(unknowns)[rows][slip], travel
            )
            theta_0[slip] = first
            rho[slip] = np.minimum(np.sin((onset - first) / 2) ** 2, 1 - _MARGIN)
            short = slip & (located.margins < 0)
            rho[short] = np.exp(-located.margins[short])
        return np.concatenate([unknowns, theta_0, rho]), slip

    def applies(
        self,
        problem: HarmonicBalance,
        unknowns: FloatArray,
        theta_0: FloatArray,
        theta_star: FloatArray,
    ) -> NDArray[np.bool_]:
        """Whether each contact moves as Eqs. (4)-(11) suppose, shape (n_contacts,).

        ``unknowns`` are the coefficients [m]; ``theta_0``, ``theta_star`` (n_contacts,) in rad,
        NaN where the contact does not slip. A slipping contact must have its largest ``y`` at
        ``theta_0``, no reversal while it slips, no force beyond the limit while it sticks; a
        sticking one no reason to slip.
        """
        _, rows, stiffness, limit = problem.contacts.sliders()
        result = (problem.locate(unknowns, 0.0).margins <= SLACK) | (limit == 0)
        waves = problem.layout.relative(unknowns)[rows]
        points = turning_points(problem.basis, waves)
        for j in np.flatnonzero(np.isfinite(theta_star)):
            half = points.count[j] // 2
            angle, value = points.angle[j, : 2 * half], points.value[j, : 2 * half]
            distance = (angle - theta_0[j] + np.pi) % (2 * np.pi) - np.pi
            # Half of the turning points lie in half a period, the two at its ends count once.
            inner = (np.argmin(np.abs(distance)) + np.arange(1, half)) % (2 * half)
            stick = (theta_star[j] - theta_0[j]) % (2 * np.pi)
            top, onset = problem.basis.values([theta_0[j], theta_star[j]]) @ waves[j]
            slack = SLACK * (value.max() - value.min())
            low = value[inner].min(initial=onset)
            result[j] = (
                top >= value.max() - slack
                and np.all((angle[inner] - theta_0[j]) % (2 * np.pi) < stick)
                and stick < np.pi
                and stiffness[j] * (top - low - slack) <= 2 * limit[j]
            )
        return result


def slip_angles(
    problem: HarmonicBalance, unknowns: FloatArray, slip: NDArray[np.bool_]
) -> tuple[FloatArray, FloatArray]:
    """``theta_0`` and ``theta_star`` [rad] of a motion, Eqs. (10) and (11).

    Of all contacts of the structure, NaN where they are not in ``slip`` (n_contacts,) or have
    neither spring nor limit.
    """
    model, basis = problem.model, problem.basis
    contact, rows, stiffness, limit = model.groups.sliders(0.0)
    travel, both = 2 * limit, np.full((2, model.n_contacts), np.nan)
    slips = slip[contact] & (travel > 0) & (stiffness > 0)
    if slips.any():
        if problem.symmetry is None:
            waves = problem.layout.relative(unknowns)[rows][slips]
        else:
            waves = (model.directions[rows] @ problem.layout.everywhere(unknowns))[slips]
        both[:, contact[slips]] = _first_slip(basis, waves, travel[slips] / stiffness[slips])
    return both[0] % (2 * np.pi), both[1] % (2 * np.pi)


def friction_of(problem: HarmonicBalance) -> tuple[BalancedGroup, Coulomb]:
    """The group of dry friction whose angles are unknowns, and its law.

    Raises TypeError where contacts of another law have events, or the limit is not ``mu F_n``.
    """
    switching = [group for group in problem.contacts.groups if group.law.switches]
    law = switching[0].law if len(switching) == 1 else None
    if type(law) is not Coulomb:
        laws = ", ".join(repr(group.law) for group in switching) or "none"
        raise TypeError(
            f"problem: expected one group of contacts with events, Coulomb(), got {laws}"
        )
    return switching[0], law


def check_odd(harmonics: tuple[int, ...]) -> None:
    """Raise ValueError if a harmonic is not odd."""
    other = [n for n in harmonics if n % 2 == 0]
    if other:
        raise ValueError(
            f"harmonics={harmonics}: expected odd harmonics only: {other} give a second half "
            "period that does not mirror the first, as Eqs. (4)-(11) need; leave them out or use "
            "located angles"
        )


def switching_kernel(basis: FourierBasis) -> ca.Function:
    """CasADi function of one slipping contact, Eqs. (6)-(8), (10), (11), odd harmonics only.

    From the coefficients of ``y`` (n_components) [m], ``theta_0`` [rad] and ``rho`` [-] above 0
    to the matrix (n_components, n_components) and vector (n_components) of the force,
    ``dy/dtau`` at ``theta_0`` [m], and ``y(theta_0) - y(theta_star)`` [m]. From ``rho`` 1 on the
    contact sticks all half period, and the last is the range of ``y`` times ``rho``: a contact held
    in slip short of its limit, for continuation.
    """
    y = ca.SX.sym("coefficients", basis.n_components)
    theta_0, rho = ca.SX.sym("theta_0"), ca.SX.sym("rho")
    slides = rho < 1
    inside = ca.if_else(slides, rho, DUMMY[1])
    # Keeps the digits of a short stick, as acos(1 - 2 rho) does not.
    width = ca.if_else(slides, 2 * ca.atan2(ca.sqrt(inside), ca.sqrt(1 - inside)), np.pi)
    stick = _moments(basis, theta_0, width)
    slip = _moments(basis, theta_0 + width, np.pi - width)
    each = np.eye(stick.shape[0])
    integrals = constant(basis.integrals(each).T)
    products = constant(basis.products(each).transpose(2, 1, 0).reshape(-1, len(each)))
    on_stick, on_slip = ca.mtimes(integrals, stick), ca.mtimes(integrals, slip)
    values = ca.cos(ca.DM(basis.order) * theta_0 - ca.DM(basis.is_sine * np.pi / 2))
    matrix = ca.reshape(ca.mtimes(products, stick), basis.n_components, basis.n_components)
    slope = ca.mtimes(constant(basis.derivative_matrix), y)
    outputs = [
        2 * (matrix - ca.mtimes(on_stick, values.T)),
        2 * (on_stick - on_slip),
        ca.dot(slope, values),
        # The integral of the slope keeps the digits that a difference of values loses.
        -np.pi * ca.dot(slope, on_stick) * ca.fmax(rho, 1),
    ]
    return ca.Function("switching", [y, theta_0, rho], outputs)


def _moments(basis: FourierBasis, left: ca.SX, width: ca.SX) -> ca.SX:
    """The integrals of `FourierBasis.moments` over one interval, as symbols."""
    k = ca.DM(list(range(1, 2 * basis.highest + 1)))
    factor, middle = 2 / k * ca.sin(k * width / 2), k * (left + width / 2)
    return ca.vertcat(width, factor * ca.cos(middle), 0, factor * ca.sin(middle))


def _function(name: str, inputs: dict[str, Any], output: ca.SX) -> ca.Function:
    return ca.Function(name, list(inputs.values()), [output], list(inputs), [name])


def _first_slip(
    basis: FourierBasis, waves: FloatArray, travel: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Angle of the largest ``y`` and the first one after it where ``y`` is lower by ``travel``."""
    points = turning_points(basis, waves)
    rows, level = np.arange(len(waves)), points.value[:, 0] - travel
    below = points.value <= level[:, None]
    # Round-off may put the top below the level, and even the lowest point above it.
    below[:, 0], below[rows, points.lowest] = False, True
    end = np.argmax(below, axis=1)
    left, right = points.angle[rows, end - 1], points.angle[rows, end]
    high, low = points.value[rows, end - 1], points.value[rows, end]
    share = np.clip((high - level) / (high - low), 0.0, 1.0)
    guess = left + (right - left) * np.arccos(1 - 2 * share) / np.pi

    def value_and_slope(tau: FloatArray) -> tuple[FloatArray, FloatArray]:
        value, slope = ((basis.values(tau, d) * waves).sum(axis=1) for d in (0, 1))
        return value - level, slope

    noise = np.finfo(float).eps * np.abs(waves).sum(axis=1)
    falling = np.zeros(len(waves), dtype=bool)
    onset = monotone_root(value_and_slope, left, right, falling, guess, noise)
    # At the limit the level is the lowest value, where no slope leads.
    return points.angle[:, 0], np.where(level <= low + 4 * noise, right, onset)
