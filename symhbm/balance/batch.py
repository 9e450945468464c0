"""The equations at several points at once, of one problem or of several of one structure."""

from collections.abc import Callable, Sequence

import casadi as ca
import numpy as np

from symhbm.balance.contacts import motions_at_each
from symhbm.balance.equations import Equations
from symhbm.balance.evaluation import ContactStates
from symhbm.balance.harmonic_balance import HarmonicBalance
from symhbm.model.contacts import FREE
from symhbm.numerics import Compiled, FloatArray, to_machine_code


def locate_each(
    problems: Sequence[HarmonicBalance], unknowns: Sequence[FloatArray], frequencies: FloatArray
) -> list[ContactStates]:
    """Events of all contacts at the unknowns of several problems of one structure, at once.

    ``frequencies`` (n_problems,) in rad/s.
    """
    return _locate_all(problems, np.array(unknowns), frequencies).split(len(problems))


def check_each(
    problems: Sequence[HarmonicBalance],
    unknowns: FloatArray,
    frequencies: FloatArray,
    machine_code: bool = False,
) -> tuple[FloatArray, ContactStates]:
    """Norms (n_points,) of the equations, and the events of all contacts point by point.

    ``unknowns`` (n_points, n_unknowns) of problems of one structure; ``frequencies``
    (n_points,) in rad/s. ``machine_code`` evaluates them where there is some.
    """
    first = problems[0]
    if first.structure is not None:
        located = _locate_all(problems, unknowns, frequencies)
        each = zip(
            problems, unknowns, frequencies.tolist(), located.split(len(problems)), strict=True
        )
        norm = [problem.evaluate(x, at, states=own).norm for problem, x, at, own in each]
        return np.array(norm), located
    equations, arguments = first.compiled
    if any(problem is not first for problem in problems):
        of_each = zip(*(problem.arguments_in_order for problem in problems), strict=True)
        arguments = [np.array(values) for values in of_each]
    n, at = len(unknowns), (unknowns, frequencies[:, None], *arguments)
    if first.equations.closed:
        check = _check(equations, machine_code)
        residual, magnitude, *events = check.at_points(n, *at, FREE)
        located = equations.unpack(events, n)
    else:
        located = _locate_all(problems, unknowns, frequencies)
        events = [located.groups[group.name].events.reshape(n, -1) for group in equations.located]
        residual, magnitude = _check(equations, False).at_points(n, *at, *events)
    loads = [p.load_at_rest(f) for p, f in zip(problems, frequencies.tolist(), strict=True)]
    force = magnitude[:, 0] + loads
    return np.abs(residual).max(axis=1) / np.where(force > 0, force, 1.0), located


def compile_checks(problem: HarmonicBalance, announce: Callable[[], None]) -> None:
    """Make machine code of what `check_each` evaluates, where events are closed forms.

    ``announce`` is called before what takes seconds.
    """
    if problem.equations.closed and problem.structure is None:
        to_machine_code([_check_function(problem.equations)], True, announce)


def _check(equations: Equations, machine_code: bool) -> Compiled:
    """What checks points of a structure, without machine code or with it."""

    def check() -> Compiled:
        function = _check_function(equations)
        made = to_machine_code([function], make=False) if machine_code else None
        return Compiled(function if made is None else made[0])

    return equations.once(("check", machine_code), check)


def _check_function(equations: Equations) -> ca.Function:
    """The equations without what a solve alone needs: residual, magnitude, events if found."""
    whole = equations.closed_form if equations.closed else equations.located_form
    inputs = whole.sx_in()
    residual, magnitude, _, _, *events = whole(*inputs)
    return ca.Function("check", inputs, [residual, magnitude, *events])


def _locate_all(
    problems: Sequence[HarmonicBalance], unknowns: FloatArray, frequencies: FloatArray
) -> ContactStates:
    """The same as one batch, point by point; ``unknowns`` (n_points, n_unknowns)."""
    first, located = problems[0], {}
    relative, contacts = first.layout.relative(unknowns), [each.contacts for each in problems]
    for group in first.groups:
        at = motions_at_each(contacts, group, relative, frequencies)
        located[group.name] = group.law.locate(at)
    return ContactStates(located)
