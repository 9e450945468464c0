"""Dry friction with located switching angles, for any motion.

Along one period the slider is marched over the reversals of the relative displacement ``y``, and
each change from stick to slip is located.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from symhbm.model.contacts.coulomb.loops import Loop, apart, images
from symhbm.model.contacts.coulomb.one_harmonic import locate_one_harmonic
from symhbm.model.contacts.coulomb.state import (
    SMALLEST_MOTION,
    ContactState,
    full_stick,
    slip_margins,
)
from symhbm.model.contacts.coulomb.two_reversals import locate_two_reversals
from symhbm.numerics import (
    FloatArray,
    FourierBasis,
    Motions,
    TurningPoints,
    points_in_cells,
    turning_cells,
    turning_points,
)


def locate(
    basis: FourierBasis,
    coefficients: FloatArray,
    contact_stiffness: FloatArray,
    slip_limit: FloatArray,
    slip: NDArray[np.bool_] | None = None,
) -> ContactState:
    """Locate the events of friction contacts from the coefficients of their motion, Eqs. (4)-(8).

    Parameters
    ----------
    basis
        The harmonic set.
    coefficients : (n_contacts, n_components)
        Relative displacement [m].
    contact_stiffness : (n_contacts,)
        ``k_d`` [N/m].
    slip_limit : (n_contacts,)
        ``g = mu F_n`` [N].
    slip : (n_contacts,)
        State to impose, for continuation past the onset or the end of slip: a contact held in
        stick follows its spring beyond ``g``, one held in slip is put on ``+-g`` at the extremes
        of ``y`` even where it would not reach them. Both agree with the law, and have its
        derivative, up to the limit. By default each contact is in the state its motion asks for.
    """
    if basis.highest == 1:
        return locate_one_harmonic(basis, coefficients, contact_stiffness, slip_limit, slip)
    if basis.divisor > 1:
        found = locate(basis.reduced, coefficients, contact_stiffness, slip_limit, slip)
        return _repeated(found, basis.divisor)
    motions = Motions(basis, coefficients)
    faint = (motions.bounds[:, 1] > 0) & (motions.bounds[:, 1] < SMALLEST_MOTION)
    if faint.any():
        coefficients = np.where(faint[:, None] & (basis.order > 0), 0.0, coefficients)
        motions = Motions(basis, coefficients)
    cells = turning_cells(motions)
    if cells is not None:
        found = locate_two_reversals(motions, cells, contact_stiffness, slip_limit, slip)
        if found is not None:
            return found
    points = points_in_cells(motions, cells)
    rows = np.arange(len(coefficients))
    spread = points.value[:, 0] - points.value[rows, points.lowest]
    high, low = points.functions[:, 0], points.functions[rows, points.lowest]
    slip_margin, state = slip_margins(spread, contact_stiffness, slip_limit, slip)
    moves, simple = points.count > 0, points.count == 2

    matrix, vector = full_stick(basis, high, low, moves), np.zeros(coefficients.shape)
    matrix[state] = 0.0
    stick = np.where(state, 0.0, 1.0)
    theta_0 = np.where(simple, points.angle[:, 0] % (2 * np.pi), np.nan)
    theta_star = np.full(len(rows), np.nan)
    stretches = np.empty((2, len(rows), 0))
    slides = state & moves
    if slides.any():
        # All at once need no copies.
        some = slice(None) if slides.all() else np.flatnonzero(slides)
        runs = _march(motions.of(some), points.of(some), contact_stiffness[some], slip_limit[some])
        matrix[some], vector[some] = _force(basis, runs)
        width = runs.end - runs.begin
        stick[some] = width.sum(axis=1) / (np.pi if basis.mirrors else 2 * np.pi)
        theta_star[some] = np.where(simple[some], runs.end[:, 0] % (2 * np.pi), np.nan)
        # A contact held in slip short of its limit never leaves its stretch of stick.
        leaves = runs.used & (slip_margin[some] > 0)[:, None]
        stretches = np.full((2, len(rows), width.shape[1]), np.nan)
        stretches[:, some] = np.where(leaves, (runs.begin, runs.end), np.nan)
        if basis.mirrors:
            stretches = np.concatenate([stretches, stretches + np.pi], axis=2)
    return ContactState(
        matrix=matrix,
        vector=vector,
        slip=state,
        slip_margin=slip_margin,
        slip_margin_gradient=(high - low) / np.where(spread > 0, spread, np.inf)[:, None],
        theta_0=theta_0,
        theta_star=theta_star,
        stick_fraction=stick,
        reversals=points.count,
        stick_begin=stretches[0],
        stick_end=stretches[1],
    )


def on_loop(
    friction: ContactState,
    basis: FourierBasis,
    motion: FloatArray,
    contact_stiffness: float,
    slip_limit: float,
    loop: Loop,
    slips: bool,
) -> ContactState:
    """The same friction with one contact held on a loop: in stick to its end, or slipping there.

    Both agree with the law, and have its derivative, up to the limit. ``motion`` (n_components,)
    [m] is that of the contact. ArithmeticError where its force is not periodic on such a loop.
    """
    points = turning_points(basis, motion[None])
    n = int(points.count[0])
    first = int(np.argmin(apart(points.angle[0, :n], loop.begin)))
    order = (first + np.arange(n + 1)) % n
    angle, value = points.angle[0, order], points.value[0, order]
    angle = angle + 2 * np.pi * (angle < angle[0])
    angle[-1] = angle[0] + 2 * np.pi
    count = images(basis, motion)
    image = loop.end + 2 * np.pi * np.arange(count) / count
    held = {int(np.argmin(apart(angle[1:], end))) for end in image}
    force, start, side = loop.sides[0] * slip_limit, 0, loop.sides[0]
    runs = []
    for k in range(n):
        trial = force + contact_stiffness * (value[k + 1] - value[k])
        if not (slips if k in held else abs(trial) > slip_limit):
            force = trial
            continue
        goal = 1 if trial > 0 else -1
        share = (goal * slip_limit - force) / (contact_stiffness * (value[k + 1] - value[k]))
        runs.append((start, k, share, goal - side))
        force, start, side = goal * slip_limit, k + 1, goal
    if start != n or side != loop.sides[0]:
        raise ArithmeticError("the force is not periodic on this loop")
    begin, last = (np.array([run[i] for run in runs])[None] for i in (0, 1))
    share, jump = (np.array([run[i] for run in runs], dtype=float)[None] for i in (2, 3))
    used = np.ones(begin.shape, dtype=bool)
    branches = angle[last], angle[last + 1], value[last], value[last + 1]
    end = _onset(Motions(basis, motion[None]), used, *branches, share)
    functions = basis.values(angle[begin])
    matrix, vector = _force(basis, _Runs(angle[begin], end, functions, jump, used))
    if basis.mirrors:  # these are the stretches of a whole period
        matrix, vector = matrix / 2, vector / 2
    if basis.order[0] == 0:
        vector[:, 0] += loop.sides[0] - 1
    size = max(friction.stick_end.shape[1], end.shape[1]) - friction.stick_end.shape[1]
    changes = {}
    for name, row in (("stick_begin", angle[begin]), ("stick_end", end)):
        changes[name] = np.pad(getattr(friction, name), ((0, 0), (0, size)), constant_values=np.nan)
        changes[name][loop.contact] = np.nan
        changes[name][loop.contact, : end.shape[1]] = row
    for name, row in (("matrix", matrix), ("vector", vector)):
        changes[name] = getattr(friction, name).copy()
        changes[name][loop.contact] = row[0]
    return replace(friction, **changes)


def stick_intervals(
    basis: FourierBasis,
    coefficients: FloatArray,
    contact_stiffness: FloatArray,
    slip_limit: FloatArray,
) -> tuple[NDArray[np.intp], FloatArray, FloatArray]:
    """Intervals in which contacts that slip stick in between; arguments as in `locate`.

    Returns the contact, the angle where it begins to stick and the one where it begins to slip
    [rad], each (n_intervals,), contact by contact and ascending. A contact that never slips has no
    interval.
    """
    return locate(basis, coefficients, contact_stiffness, slip_limit).stick_intervals


def _repeated(friction: ContactState, times: int) -> ContactState:
    """The events of the same motions with as many periods in one."""
    shift = 2 * np.pi / times * np.arange(times)[:, None]
    begin, end = (
        (at[:, None] / times + shift).reshape(len(at), -1)
        for at in (friction.stick_begin, friction.stick_end)
    )
    unknown = np.full(len(begin), np.nan)
    return replace(
        friction,
        theta_0=unknown,
        theta_star=unknown,
        reversals=friction.reversals * times,
        stick_begin=begin,
        stick_end=end,
    )


class _Runs(NamedTuple):
    """Stretches of stick up to an onset of slip, (n_contacts, n_runs), those not ``used`` empty.

    ``begin`` and ``end`` [rad]; the basis ``functions`` at the begin; ``jump``, by how much the
    sign of the limit that the force is tied to changes at the end. Where motions mirror, they are
    those of half a period.
    """

    begin: FloatArray
    end: FloatArray
    functions: FloatArray
    jump: FloatArray
    used: NDArray[np.bool_]


def _force(basis: FourierBasis, runs: _Runs) -> tuple[FloatArray, FloatArray]:
    """``A`` and ``b`` of contacts that slip."""
    moments = basis.moments_from(runs.begin, runs.end - runs.begin)
    on_run = basis.integrals(moments)
    matrix = basis.products(moments.sum(axis=1)) - on_run.swapaxes(1, 2) @ runs.functions
    # The integral of the sign, by parts.
    vector = (-runs.jump[:, None] @ basis.values(runs.end, -1))[:, 0] * basis.norm
    if basis.order[0] == 0:
        vector[:, 0] = 1 - (runs.jump * runs.end).sum(axis=1) / (2 * np.pi)
    return (2 * matrix, 2 * vector) if basis.mirrors else (matrix, vector)


def _march(
    motions: Motions,
    points: TurningPoints,
    contact_stiffness: FloatArray,
    slip_limit: FloatArray,
) -> _Runs:
    """March the sliders from the global maximum, where ``f = g``, once around the period.

    At the global minimum ``f = -g``; where motions mirror, the march ends there.
    """
    angle, value, mirrors = points.angle, points.value, motions.basis.mirrors
    if mirrors:
        middle = angle.shape[1] // 2
        angle, value = angle[:, : middle + 1], value[:, : middle + 1]
    else:
        angle = np.concatenate([angle, angle[:, :1] + 2 * np.pi], axis=1)
        value = np.concatenate([value, value[:, :1]], axis=1)
    step = contact_stiffness[:, None] * (value[:, 1:] - value[:, :-1])
    branch = np.arange(step.shape[1])
    # Whatever round-off says of the extremes, the force reaches its limits there.
    pull = np.where(branch == points.lowest[:, None] - 1, -np.inf, step)
    if mirrors:
        pull[branch >= points.lowest[:, None]] = 0.0
    else:
        pull[:, -1] = np.inf
    force, trial = np.empty(angle.shape), np.empty(step.shape)
    force[:, 0] = slip_limit
    for k in branch:
        trial[:, k] = force[:, k] + pull[:, k]
        force[:, k + 1] = np.minimum(np.maximum(trial[:, k], -slip_limit), slip_limit)
    slips = np.abs(trial) > slip_limit[:, None]
    sign = np.where(trial > 0, 1.0, -1.0)
    change = force[:, 1:] - force[:, :-1]
    # Where the spring takes the contact no farther than its force changes, that is all of the way.
    part = np.abs(change) < np.abs(step)
    share = np.divide(change, step, where=part, out=np.sign(change) * np.sign(step))

    branches = angle[:, :-1], angle[:, 1:], value[:, :-1], value[:, 1:], share, sign

    used, begin, functions = slips, angle[:, :-1], points.functions[:, : len(branch)]
    if not slips.all():
        # The branches on which slip begins in front, each contact its own.
        rows, n_slips = np.arange(len(slips))[:, None], slips.sum(axis=1)[:, None]
        branch = np.argsort(~slips, axis=1, kind="stable")[:, : n_slips.max()]
        used = np.arange(branch.shape[1]) < n_slips
        branches = tuple(part[rows, branch] for part in branches)
        start = np.zeros_like(branch)
        start[:, 1:] = (branch[:, :-1] + 1) * used[:, 1:]
        begin, functions = angle[rows, start], points.functions[rows, start]
    *stretch, sign = branches
    end = np.where(used, _onset(motions, used, *stretch), begin)
    jump = sign.copy()
    jump[:, 0] -= 1.0
    jump[:, 1:] -= sign[:, :-1]
    return _Runs(begin, end, functions, jump * used, used)


def _onset(
    motions: Motions,
    used: NDArray[np.bool_],
    left: FloatArray,
    right: FloatArray,
    low: FloatArray,
    high: FloatArray,
    share: FloatArray,
) -> FloatArray:
    """Angles at which ``y`` has gone a ``share`` of its way from ``low`` to ``high``."""
    # Without spring or limit there is no way to go: slip begins at once.
    share = np.where(share > 0, np.minimum(share, 1.0), 0.0)
    onset = left + (right - left) * (2 / np.pi) * np.arcsin(np.sqrt(share))
    inside = used & (share > 0) & (share < 1)
    owner = np.nonzero(inside)[0]
    left, right, low, high = left[inside], right[inside], low[inside], high[inside]
    level = low + share[inside] * (high - low)
    onset[inside] = motions.crossings(owner, 0, level, left, right, high > low, onset[inside])
    return onset
