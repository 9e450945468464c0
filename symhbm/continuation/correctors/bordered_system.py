"""Bordered linear system of one Newton step on a frequency curve, and the values at its point.

The equations are in closed form; one constraint closes them, a plane or the limit of one contact.
"""

from itertools import pairwise
from typing import Any

import casadi as ca
import numpy as np

from symhbm.balance import DynamicStiffness, Equations
from symhbm.continuation.correctors.condensed_graph import condensed_graph
from symhbm.continuation.problem import BEYOND, ROUND_OFF, WEAKEST
from symhbm.model.contacts import graph_of
from symhbm.numerics import constant

SCALARS = 6
"""Number of values before those of the contacts, see `point_system`."""
_MAX_CONTACTS, _MAX_ENTRIES = 100, 10_000
"""Contacts, and entries of the Jacobian, up to which common terms are eliminated: the time for that
grows faster than linearly."""
_NAMES = ["matrix", "right", "values", "limits"]
_MAX_FILL = 20_000
"""Entries of the factors of the structure up to which every point counts resonances."""


def point_system(equations: Equations, structure: DynamicStiffness | None = None) -> ca.Function:
    """CasADi function of the scaled system at a point, with a condensed ``structure`` if given.

    Inputs: all ``parameters``, ``point`` and ``guess`` (unknowns and frequency), ``normal`` and
    ``anchor`` of a plane, ``limit`` (1 for the contact to put on its limit, with ``normal`` 0),
    ``imposed`` contact states, ``scale`` of unknowns and frequency. Outputs: ``matrix`` and
    ``right``, whose solutions are the Newton step and the tangent; ``values``: norm of the
    residual, value of the constraint, amplification, distance from the guess, twice the resonances
    below (-1 where they are not counted), whether a contact is beyond its limit, margins of all
    switches, springs of all contacts and their losses; ``limits``, the derivatives of the margins
    by the scaled unknowns and frequency (n_switches, n_unknowns + 1).
    """
    sizes = [equations.closed_form.size1_in(i) for i in range(equations.closed_form.n_in())]
    n, n_switches = sizes[0], sizes[-1]
    lengths = dict(parameters=sum(sizes[2:-1]), point=n + 1, guess=n + 1, normal=n + 1)
    lengths |= dict(anchor=n + 1, limit=n_switches, imposed=n_switches, scale=2)
    symbolic: Any = ca.SX if structure is None else ca.MX
    symbol: dict[str, Any] = {name: symbolic.sym(name, length) for name, length in lengths.items()}
    point = symbol["point"]
    starts = [sum(sizes[2:i]) for i in range(2, len(sizes))]
    parameters = ca.vertsplit(symbol["parameters"], starts)
    arguments = [point[:n], point[n], *parameters]
    balance, magnitude, jacobian, by_frequency, *packed = equations.closed_form(
        *arguments, symbol["imposed"]
    )
    groups = equations.closed_groups(packed)
    named = dict(zip(equations.parameter_names, parameters, strict=True))
    amplitude = ca.fabs(named["force_amplitude"])
    events = {group.name: parts[0] for group, parts in groups}
    springs, losses = _springs(equations, point[:n], point[n], named, events)
    if structure is None:
        conservative, inertia = equations.conservative(*arguments)
        inertia, exciting = (
            ca.mmax(ca.fabs(inertia)),
            amplitude * ca.mmax(ca.fabs(equations.shape_at(named["force_shape"], point[n]))),
        )
        below = _resonances_below(equations, conservative, springs)
    else:
        forces, terms, stiffness, slopes, inertia = condensed_graph(structure)(
            point[:n], point[n], named["force_amplitude"]
        )
        balance, magnitude = balance + forces, magnitude + terms
        jacobian, by_frequency = jacobian + stiffness, by_frequency + slopes
        exciting, below = amplitude * structure.largest(point[n]), -1

    margins, gradients = symbolic(0, 1), [symbolic(0, n)]
    by_omega = symbolic(0, 1)
    for group, (_, _, group_margins, by_motion, by_group_frequency, _) in groups:
        q, spread = len(group.law.switches), constant(equations.spreads(group)[0])
        margins = ca.vertcat(margins, ca.vec(group_margins))
        rows = [ca.reshape(symbolic(column), q, -1) for column in ca.horzsplit(by_motion)]
        gradients.append(ca.mtimes(ca.diagcat(*rows), spread))
        by_omega = ca.vertcat(by_omega, ca.vec(by_group_frequency))
    forces = balance, magnitude, jacobian, by_frequency
    of_limits = margins, ca.vertcat(*gradients), by_omega
    sizes = inertia, exciting, below
    outputs: Any = _bordered(equations, symbol, forces, of_limits, sizes)
    outputs[2] = ca.vertcat(outputs[2], springs, losses)
    if structure is None and n_switches <= _MAX_CONTACTS and jacobian.nnz() <= _MAX_ENTRIES:
        outputs = ca.cse(outputs)
    return ca.Function("point_system", list(symbol.values()), outputs, list(symbol), _NAMES)


def located_system(equations: Equations) -> ca.Function:
    """The same where loops locate the events of contacts, and for any number of harmonics.

    More inputs: ``events`` of all contacts, their ``margins`` (n_switches,), the ``gradients`` of
    these by the motion of their contact, and ``margins_by_frequency`` (n_switches,). Resonances are
    not counted.
    """
    form, groups = equations.located_form, equations.groups
    sizes = [form.nnz_in(i) for i in range(form.n_in())]
    n, n_located = sizes[0], len(equations.located)
    of_parameters, of_events = sizes[2 : len(sizes) - n_located], sizes[len(sizes) - n_located :]
    n_switches = sum(group.n_switches for group in groups)
    motions = [group.rows.shape[1] * equations.basis.n_components for group in groups]
    of_gradients = [g.n_switches * motion for g, motion in zip(groups, motions, strict=True)]
    lengths = dict(parameters=sum(of_parameters), point=n + 1, guess=n + 1, normal=n + 1)
    lengths |= dict(anchor=n + 1, limit=n_switches, imposed=n_switches, scale=2)
    lengths |= dict(events=sum(of_events), margins=n_switches, gradients=sum(of_gradients))
    lengths |= dict(margins_by_frequency=n_switches)
    symbol: dict[str, Any] = {name: ca.SX.sym(name, length) for name, length in lengths.items()}
    point = symbol["point"]
    parameters = _split(symbol["parameters"], of_parameters)
    events = [
        ca.reshape(part, group.law.n_events(equations.basis), group.n)
        for part, group in zip(_split(symbol["events"], of_events), equations.located, strict=True)
    ]
    forces = form(point[:n], point[n], *parameters, *events)
    _, inertia = equations.conservative(point[:n], point[n], *parameters)
    named = dict(zip(equations.parameter_names, parameters, strict=True))
    largest = ca.mmax(ca.fabs(equations.shape_at(named["force_shape"], point[n])))
    rows = [ca.SX(0, n)]
    of_group = zip(groups, motions, _split(symbol["gradients"], of_gradients), strict=True)
    for group, size, gradients in of_group:
        if not group.n_switches:
            continue
        q, spread = len(group.law.switches), constant(equations.spreads(group)[0])
        blocks = [ca.reshape(part, size, q).T for part in ca.vertsplit(gradients, q * size)]
        rows.append(ca.mtimes(ca.diagcat(*blocks), spread))
    of_limits = symbol["margins"], ca.vertcat(*rows), symbol["margins_by_frequency"]
    exciting = ca.fabs(named["force_amplitude"]) * largest
    of_motion = ca.mmax(ca.fabs(inertia)), exciting, -1
    outputs = _bordered(equations, symbol, forces, of_limits, of_motion)
    by_group = {group.name: part for group, part in zip(equations.located, events, strict=True)}
    springs = _springs(equations, point[:n], point[n], named, by_group)
    outputs[2] = ca.vertcat(outputs[2], *springs)
    return ca.Function("located_system", list(symbol.values()), outputs, list(symbol), _NAMES)


def _split(vector: Any, sizes: list[int]) -> list[Any]:
    """Parts of a vector, of which some may be empty."""
    ends = np.cumsum([0, *sizes]).tolist()
    return [vector[begin:end] for begin, end in pairwise(ends)]


def _bordered(
    equations: Equations,
    symbol: dict[str, Any],
    forces: Any,
    of_limits: tuple[Any, Any, Any],
    sizes: tuple[Any, Any, Any],
) -> list[Any]:
    """The outputs of `point_system`, without springs.

    ``forces`` are the balance, its size and its derivatives; ``of_limits`` margins and their
    derivatives by unknowns and frequency; ``sizes`` the largest inertia and exciting force and
    twice the number of resonances below.
    """
    balance, magnitude, jacobian, by_frequency = forces
    margins, gradients, by_omega = of_limits
    inertia, exciting, below = sizes
    point, scale, limit, normal = (symbol[k] for k in ("point", "scale", "limit", "normal"))
    n = point.shape[0] - 1
    limits = ca.horzcat(gradients * scale[0], by_omega * scale[1])
    scales = ca.vertcat(ca.repmat(scale[0], n), scale[1])
    value = ca.dot(normal, (point - symbol["anchor"]) / scales)
    # See `AtLimit`: of a stiff contact no margin is smaller than the last digits of the unknowns.
    noise = ROUND_OFF * ca.mtimes(ca.fabs(limits), ca.fabs(point / scales))
    at_limit = ca.logic_and(limit > 0, ca.fabs(margins) > noise)
    value += ca.sum1(ca.if_else(at_limit, margins, 0))
    row = normal.T + ca.mtimes(limit.T, limits)
    force = ca.if_else(magnitude > 0, magnitude, 1)
    top = ca.horzcat(jacobian * (scale[0] / force), by_frequency * (scale[1] / force))
    unit = ca.vertcat(type(point)(n, 1), 1)
    right = ca.horzcat(ca.vertcat(-balance / force, -value), unit)
    # The largest of several numbers ignores those that are NaN, their sum does not.
    total = ca.sumsqr(balance)
    values = ca.vertcat(
        ca.if_else(total < ca.inf, ca.mmax(ca.fabs(balance)) / force, total),
        value,
        ca.if_else(exciting > 0, inertia / ca.if_else(exciting > 0, exciting, 1), 0),
        _distance(equations, point / scales, symbol["guess"] / scales),
        below,
        _crosses(margins, symbol["imposed"]),
        margins,
    )
    return [ca.vertcat(top, row), ca.densify(right), ca.densify(values), limits]


def _crosses(margins: Any, switches: Any) -> Any:
    """Whether a contact is beyond the limit of its imposed state, see `crossed`."""
    outward = ca.if_else(switches, -margins, margins)
    past_limit = ca.logic_and(outward > BEYOND, ca.fabs(margins) < ca.inf)
    return ca.sum1(past_limit) > 0


def _distance(equations: Equations, point: Any, other: Any) -> Any:
    """Scaled distance between two points, see `ContinuationProblem.distance`."""
    size, same_harmonic = equations.basis.n_components, equations.basis.same_harmonic
    difference, level = (
        ca.reshape(vector[:-1], size, len(equations.dofs)) for vector in (point - other, point)
    )
    strength = ca.mtimes(ca.DM(same_harmonic), ca.sqrt(ca.sum2(level**2)))
    difference = ca.sqrt(ca.sum2(difference**2)) / ca.fmin(ca.fmax(strength, WEAKEST), 1)
    return ca.sqrt(ca.sum1(difference**2) + (point[-1] - other[-1]) ** 2)


def _springs(
    equations: Equations,
    unknowns: Any,
    frequency: Any,
    inputs: dict[str, Any],
    located: dict[str, Any],
) -> tuple[Any, Any]:
    """Stiffness and loss of the contacts in their motion, as of `BalancedContacts.springs`."""
    n_harmonics = sum(n > 0 for n in equations.basis.harmonics)
    stiffness, loss = ([type(unknowns)(0, n_harmonics)] for _ in range(2))
    for group in equations.groups:
        if not group.n:
            continue
        motion = ca.mtimes(constant(equations.spreads(group)[0]), unknowns)
        motions = ca.horzsplit(ca.reshape(motion, -1, group.n))
        values = ca.horzsplit(equations.values(group, inputs))
        nothing = ca.DM(0, group.n)
        events = ca.horzsplit(located.get(group.name, nothing))
        springs = graph_of(group.law, equations.basis).springs
        for of_contact in zip(motions, values, events, strict=True):
            found = springs(of_contact[0], frequency, *of_contact[1:])
            for part, of_springs in zip((stiffness, loss), found, strict=True):
                part.append(ca.reshape(of_springs, -1, n_harmonics))
    return ca.vec(ca.vertcat(*stiffness)), ca.vec(ca.vertcat(*loss))


def _resonances_below(equations: Equations, conservative: Any, springs: Any) -> Any:
    """Twice the number of natural frequencies below the exciting one, -1 if counting takes long.

    This is the number of negative pivots of the dynamic stiffness (Sylvester).
    """
    dynamic = conservative
    first = 0
    for group in equations.groups:
        if not group.n:
            continue
        m = group.rows.shape[1]
        spread = constant(equations.spreads(group)[0])
        # By direction, and within it by component.
        in_harmonic = ca.diag(ca.vertcat(ca.SX(equations.basis.n_components - 2, 1), 1, 1))
        blocks = [
            ca.kron(ca.reshape(block, m, m), in_harmonic)
            for block in ca.vertsplit(springs[first : first + group.n * m * m], m * m)
        ]
        dynamic += ca.mtimes([spread.T, ca.diagcat(*blocks), spread])
        first += group.n * m * m
    moving = np.flatnonzero(np.tile(equations.basis.order > 0, len(equations.dofs))).tolist()
    dynamic = dynamic[moving, moving]
    dynamic = (dynamic + dynamic.T) / 2
    _, lower, _ = ca.ldl(ca.DM(dynamic.sparsity(), 1))
    if lower.nnz() > _MAX_FILL:
        return -1
    pivots, _, _ = ca.ldl(dynamic)
    return ca.sum1(pivots < 0)
