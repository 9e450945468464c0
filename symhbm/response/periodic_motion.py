"""`periodic_motion`: the exact periodic motion in time, as a labelled dataset."""

from collections.abc import Iterable
from typing import Any

import numpy as np
import scipy
import xarray as xr

from symhbm.balance import HarmonicBalance, check_problem, is_held
from symhbm.continuation import SolveError, Status
from symhbm.model import Output
from symhbm.model.contacts import Behaviour
from symhbm.numerics import (
    RADIANS,
    FloatArray,
    FourierBasis,
    Table,
    by_harmonic,
    check,
    check_harmonics,
    unknowns_of,
)
from symhbm.results import check_dataset, schema
from symhbm.time_domain import INTEGRATION_TOLERANCE, ExactMotion, exact_motion_of
from symhbm.workers import unkept

_FINE = 1024
"""Samples of the period among which the extremes of an output are found."""
_NORMAL = ("open_fraction", "mean_normal_force", "least_normal_force", "largest_normal_force")
_KINDS = {"slip": "onset of slip", "stick": "end of slip", "apart": "opening"}


@unkept("a motion")
def periodic_motion(
    problem: HarmonicBalance,
    frequency: float,
    *,
    harmonics: Iterable[int] | None = None,
    n_angles: int = 512,
    start: xr.Dataset | None = None,
    throw: bool = False,
) -> xr.Dataset:
    """Find the periodic motion at one ``frequency`` [Hz], of Eqs. (1)-(2), not truncated.

    Newton's method with exact derivatives finds the motion that repeats itself. With springs and
    sliders alone, whose normal load may move and which may open, it is linear between events and
    known to round-off, as its events are. With smooth laws and planar friction it is integrated
    step by step, to the relative tolerance ``integration_tolerance``, events located on the steps.

    Parameters
    ----------
    problem
        What to solve; its samples are not used, its harmonics for the default start alone.
    frequency
        Excitation frequency [Hz].
    harmonics
        Harmonics of the Fourier coefficients; by default those of the problem.
    n_angles
        Number of equidistant angles of the period at which the motion is given.
    start
        A response nearby: one point of a result of `frf`, `follow`, `solve` or `periodic_motion`.
        Cubic springs and contacts that open make several motions, stable or not, and the start
        chooses among them; by default it is what `solve` finds, of contacts that open on harmonics
        0 to 7. Friction with a constant load makes one.
    throw
        Raise SolveError where no periodic motion was found.

    Returns
    -------
    Dataset with displacement, velocity, friction force and outputs along ``angle`` [rad]
    (``omega t``), their coefficients, of planar friction also the force across; the changes of
    contact states along ``event``, Floquet multipliers, the work of the exciting force and where
    it goes; with contacts that have a normal direction also their normal force, its mean and
    extremes, and how long they are open. Where nothing converged, ``converged`` is False, the
    values are NaN and ``status`` says why.

    Raises
    ------
    TypeError, ValueError
        For bad arguments, and for a mass matrix that is not positive definite.
    SolveError
        If nothing converged and ``throw`` is True.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    >>> motion = sh.periodic_motion(problem, 19.5)
    >>> motion.amplitude.values.round(8)
    array([0.0003079])
    """
    check_problem(problem, whole=True)
    frequency = check.scalar("frequency", frequency, "positive")
    n_angles = check.integer("n_angles", n_angles, minimum=1)
    orders = problem.harmonics if harmonics is None else check_harmonics(harmonics)
    nearby = None if start is None else _response(problem, start)
    motion = exact_motion_of(problem, RADIANS * frequency, nearby)
    status = motion.status
    if status == Status.NO_MOTION and not is_held(problem):
        status = Status.NOT_HELD
    motion = _describe(problem, motion, orders, n_angles)
    result = schema.label_point(problem, frequency, motion, str(status), harmonics=orders)
    if throw and status != Status.SUCCESS:
        raise SolveError(f"frequency={frequency:g} Hz: {status}", result)
    return result


def _response(problem: HarmonicBalance, start: xr.Dataset) -> tuple[HarmonicBalance, FloatArray]:
    """A stored response as the unknowns (n_unknowns,) [m] of a balance of its harmonics."""
    check_dataset("start", start)
    missing = [name for name in ("coefficient", "harmonic") if name not in start.variables]
    if missing:
        raise ValueError(f"start: expected a response of this library, without {missing}")
    coefficient, n_dof = start["coefficient"], problem.model.n_dof
    orders = [check.integer("harmonic of start", n, 0) for n in start["harmonic"].values.tolist()]
    expected = {"dof": n_dof, "harmonic": len(set(orders)), "component": 2}
    if dict(coefficient.sizes) != expected:
        raise ValueError(
            f"start: expected one point, with coefficients of sizes {expected}, "
            f"got {dict(coefficient.sizes)}"
        )
    values = check.array("start.coefficient", coefficient.transpose(*expected).values)
    harmonics = sorted({*orders, *problem.harmonics})
    balance = HarmonicBalance(problem.model, problem.excitation, harmonics)
    return balance, unknowns_of(balance.basis, tuple(orders), values)


def _describe(
    problem: HarmonicBalance, motion: ExactMotion, harmonics: tuple[int, ...], n_angles: int
) -> Table:
    """All results by the names of the dataset, NaN where no periodic motion was found."""
    basis = FourierBasis(harmonics)
    angle = 2 * np.pi * np.arange(n_angles) / n_angles
    displacement, velocity, friction = motion.at(angle)
    response, force = motion.coefficients(harmonics)
    n_contacts = problem.model.n_contacts
    across = friction[:, n_contacts:], force[n_contacts:]
    neutral = np.zeros(n_contacts, dtype=bool)
    neutral[motion.neutral_contacts] = True
    values = dict(
        displacement=displacement,
        velocity=velocity,
        friction_force=friction[:, :n_contacts],
        coefficient=by_harmonic(basis, response),
        friction_force_coefficient=by_harmonic(basis, force[:n_contacts]),
        amplitude=motion.amplitude,
        multiplier_real=np.real(motion.multipliers),
        multiplier_imag=np.imag(motion.multipliers),
        work=np.float64(motion.work),
        dissipation=motion.friction_loss,
        viscous_dissipation=np.float64(motion.damping_loss),
        stick_fraction=motion.stick_fraction,
    )
    for output in problem.model.outputs.values():
        values |= _of_output(output, motion, basis, response, displacement)
    laws = [group.law for group in problem.model.groups]
    if across[0].size:
        names = "friction_force_across", "friction_force_across_coefficient"
        values |= zip(names, (across[0], by_harmonic(basis, across[1])), strict=True)
    told = {name for law in laws for name in law.variables}
    if told & {*_NORMAL}:
        values["normal_force"] = motion.normal_force(angle)
        values |= {name: getattr(motion, name) for name in _NORMAL if name in told}
    if problem.curved_groups or problem.planar_groups:
        values["integration_tolerance"] = np.float64(INTEGRATION_TOLERANCE)
    if not motion.converged:
        values = {name: np.full_like(value, np.nan) for name, value in values.items()}
    state = np.where(motion.sprung, np.where(neutral, Behaviour.STICKS, Behaviour.SLIPS), -1)
    presses = np.isfinite(motion.mean_normal_force)
    state[presses & ~motion.sprung] = Behaviour.STICKS
    state[motion.open_fraction > 0] = Behaviour.OPENS
    state[motion.open_fraction == 1] = Behaviour.NEVER_TOUCHES
    return values | dict(
        angle=angle,
        event_angle=motion.event_angle,
        event_contact=motion.event_contact.astype(np.int32),
        event_kind=_event_kinds(motion),
        contact_state=np.where(motion.converged, state, -1).astype(np.int8),
        neutral=neutral,
        reversals=np.where(motion.converged, motion.reversals, -1).astype(np.int32),
        periodicity=np.float64(motion.periodicity),
        iterations=np.int32(motion.iterations),
        converged=np.bool_(motion.converged),
    )


def _of_output(
    output: Output,
    motion: ExactMotion,
    basis: FourierBasis,
    response: FloatArray,
    displacement: FloatArray,
) -> Table:
    """An output over the period, and its exact extremes: the highest samples are refined."""
    name = output.name
    angle = 2 * np.pi * np.arange(_FINE) / _FINE
    rows = output.rows @ motion.at(angle)[0].T
    largest, spread = np.empty((2, len(rows)))
    for i, values in enumerate(rows):
        ends = [
            _highest(motion, sign * output.rows[[i]], float(angle[(sign * values).argmax()]))
            for sign in (1.0, -1.0)
        ]
        largest[i], spread[i] = np.abs(ends).max(), sum(ends)
    at = slice(None) if output.several else 0
    return {
        name: (output.rows @ displacement.T).T[:, at],
        f"{name}_amplitude": largest[at],
        f"{name}_peak_to_peak": spread[at],
        f"{name}_coefficient": by_harmonic(basis, output.rows @ response)[at],
    }


def _highest(motion: ExactMotion, row: Any, start: float) -> float:
    """The highest value of a row (1, n_dof) next to an angle where its samples are highest."""

    def lowered(angle: float) -> float:
        return -float((row @ motion.at(np.array([angle]))[0][0])[0])

    width, search = 2 * np.pi / _FINE, scipy.optimize.minimize_scalar
    bounds: Any = start - width, start + width
    found: Any = search(lowered, bounds=bounds, method="bounded", options={"xatol": 1e-10})
    return max(-float(found.fun), -lowered(start))


def _event_kinds(motion: ExactMotion) -> np.ndarray:
    """Words of the dataset for the changes of states, (n_events,)."""
    words, before = [], motion.states(0.0).tolist()
    for kind, j in zip(motion.event_kind.tolist(), motion.event_contact.tolist(), strict=True):
        words.append("closing" if before[j] == "apart" else _KINDS[kind])
        before[j] = kind
    return np.array(words, dtype=object)
