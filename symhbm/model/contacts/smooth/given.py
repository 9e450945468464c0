"""`symhbm.laws.SmoothLaw`: a group of contacts whose force is an expression of the user's own."""

import re
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import casadi as ca
import numpy as np

from symhbm.model.contacts.group import Contacts
from symhbm.model.contacts.motions import Parameter
from symhbm.model.contacts.smooth import expression as graph
from symhbm.model.contacts.smooth.expression import arguments_of
from symhbm.model.contacts.smooth.law import ROUND_OFF, SmoothForce
from symhbm.numerics import FloatArray, check

Expression = Callable[[Any, Any, Mapping[str, Any]], Any]
"""A function of displacement (m) [m], velocity (m) [m/s] and parameters by name."""
_UNIT = re.compile(r"([*/ .]*)([A-Za-zµΩ°%]+|1)(?:\^|\*\*)?([-+]?\d+(?:\.\d+)?)?")
_TINY = 1e-290
"""A motion so small that only a jump at rest gives it a force."""
_FORM = 'expected (value, units), as in {"k5": (1e9, "N/m^5")}, and what it means as a third entry'


class SmoothLaw(Contacts):
    """Contacts whose force [N] is an expression of displacements, velocities and parameters.

    It is given to a model under a name, as any group is. Fourier coefficients of the force are sums
    over samples of the period, doubled until the coefficients move by less than 1e-12; results
    state what error is left as ``sampling_error``.

    Parameters
    ----------
    expression
        The force as a CasADi expression of ``y``, the displacement [m], ``v``, the velocity [m/s],
        and ``p``, the parameters by name: ``lambda y, v, p: p["k5"] * y**5``. With several
        directions ``y`` and ``v`` are columns, and so is the force. It acts on the structure as
        the displacement is measured: a spring is positive. It may depend on nothing else.
    parameters : mapping from names to (value, units) or (value, units, meaning)
        Its parameters, at least one; a value is one number or one per contact. In place of units a
        `symhbm.laws.Parameter` tells bounds too, and whether designs may vary it.
    directions
        Where contacts act, as of `symhbm.Contacts`; for several directions a mapping from their
        names to as many each.
    breakpoints : one function or several, with the arguments of ``expression``
        They change their sign where the slope of the force jumps: ``lambda y, v, p: y - p["gap"]``.
        Integrals are then exact from one break point to the next. The force itself is continuous.

    Raises
    ------
    TypeError, ValueError
        For an expression that fails, is none of CasADi, has the wrong size, holds other symbols,
        changes from call to call, is no number, jumps or has no slope at rest; for bad parameters
        and break points.

    Examples
    --------
    >>> import casadi as ca
    >>> import symhbm as sh
    >>> stop = sh.laws.SmoothLaw(
    ...     lambda y, v, p: p["k"] * ca.fmax(y - p["gap"], 0),
    ...     parameters={"k": (2e4, "N/m"), "gap": (5e-4, "m")},
    ...     directions=[(0,)],
    ...     breakpoints=lambda y, v, p: y - p["gap"],
    ... )
    >>> blade = sh.Model([[1]], [[5]], [[1e4]], contacts={"stop": stop})
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce(), harmonics=(0, 1, 2, 3))
    >>> sh.solve(problem, 20).sampling_error.item() < 1e-11
    True
    """

    def __init__(
        self,
        expression: Expression,
        parameters: Mapping[str, Any],
        directions: Any,
        breakpoints: Expression | Iterable[Expression] = (),
    ):
        records, values = _checked_parameters(parameters)
        # A mapping from degrees of freedom holds the weights of one direction.
        named = isinstance(directions, Mapping) and all(isinstance(d, str) for d in directions)
        by_name = directions if named and directions else {"y": directions}
        law = _law_of(expression, breakpoints, records, tuple(map(str, by_name)), values)
        super().__init__(law, *by_name.values(), **values)


def _checked_parameters(parameters: Any) -> tuple[dict[str, Parameter], dict[str, Any]]:
    """The records and the values of parameters by name."""
    if not isinstance(parameters, Mapping) or not parameters:
        raise TypeError(f"parameters={check.shown(parameters)}: no parameters; {_FORM}")
    records, values = {}, {}
    for name, entry in parameters.items():
        shown = f"parameters[{name!r}]={check.shown(entry)}"
        if not isinstance(name, str):
            raise TypeError(f"parameters: {name!r} is no name; {_FORM}")
        if not isinstance(entry, (tuple, list)) or len(entry) not in (2, 3):
            raise TypeError(f"{shown}: {_FORM}")
        value, units, *meaning = entry
        if not isinstance(units, (str, Parameter)) or not all(isinstance(m, str) for m in meaning):
            raise TypeError(f"{shown}: {_FORM}")
        if isinstance(units, str):
            words = meaning[0] if meaning else name.replace("_", " ")
            units = Parameter(_plain(units, shown), words, bound="any", followed="any")
        values[name] = check.array(f"parameters[{name!r}]", value, units.bound)
        records[name] = units
    return records, values


def _plain(units: str, shown: str) -> str:
    """Units as datasets have them: N/m^5 is N m-5."""
    place, parts = 0, []
    text = units.strip()
    while place < len(text):
        match = _UNIT.match(text, place)
        if match is None:
            raise ValueError(f'{shown}: expected units as "N/m^5", "N m-5" or "1"')
        sign = -1 if "/" in match[1] else 1
        power = sign * float(match[3] or 1)
        parts += [] if match[2] == "1" else [f"{match[2]}{'' if power == 1 else f'{power:g}'}"]
        place = match.end()
    return " ".join(parts) or "1"


def _law_of(
    expression: Any,
    breakpoints: Any,
    records: dict[str, Parameter],
    names: tuple[str, ...],
    values: dict[str, Any],
) -> SmoothForce:
    """The law of an expression, checked."""
    several = breakpoints if isinstance(breakpoints, Iterable) else (breakpoints,)
    functions = {"expression": expression}
    functions |= {f"breakpoints[{i}]": function for i, function in enumerate(several)}
    for what, function in functions.items():
        if not callable(function):
            raise TypeError(
                f"{what}={check.shown(function)}: expected a function of displacement, velocity "
                'and parameters, as in lambda y, v, p: p["k5"] * y**5'
            )
    m = len(names)
    sizes = [m] + [1] * (len(functions) - 1)

    def called(*arguments: Any) -> list[Any]:
        each = zip(functions.items(), sizes, strict=True)
        return [_called(what, function, n, *arguments) for (what, function), n in each]

    first, second = (_written(functions, called, m, [*records]) for _ in range(2))
    law = SmoothForce(first, records, names, len(sizes) - 1, odd=False)
    one, other = _numbers(called, law, values, 1), _numbers(called, law, values, -1)
    if first != second or not _agree(one, other):
        raise ValueError(
            "expression: it gives another force when it is called again, or with numbers; expected "
            "one that depends on its arguments alone, without memory or chance"
        )
    _check_at_rest(law, values)
    opposite, size = law.tried(values, opposite=True), law.tried(values)
    known = np.isfinite(opposite) & np.isfinite(size)
    odd = bool(np.all((np.abs(opposite) <= ROUND_OFF * np.abs(size))[known]))
    return SmoothForce(first, records, names, len(sizes) - 1, odd)


def _called(what: str, function: Expression, size: int, *arguments: Any) -> Any:
    """What a function returns, a column of so many CasADi values."""
    try:
        result = function(*arguments)
    except KeyError as error:
        known = ", ".join(arguments[-1])
        raise ValueError(f"{what}: {error} is no parameter; parameters= has {known}") from error
    except Exception as error:
        raise ValueError(
            f"{what}: it failed with {type(error).__name__}: {error}; expected operations that "
            "CasADi knows, ca.if_else(condition, a, b) for a choice, of the three arguments "
            "displacement, velocity and parameters"
        ) from error
    symbols = isinstance(arguments[0], ca.SX)
    if symbols and not isinstance(result, ca.SX):
        raise TypeError(
            f"{what}: expected a CasADi expression of displacement, velocity and parameters, got "
            f"{check.shown(result)}"
        )
    shape = getattr(result, "shape", ())
    if shape != (size, 1) and (symbols or size > 1):
        raise ValueError(
            f"{what}: expected {size} value{'s' if size > 1 else ''} in a column, one for each "
            f"direction, got shape {shape}"
        )
    return result


def _written(
    functions: dict[str, Any], called: Callable[..., list[Any]], m: int, names: list[str]
) -> str:
    """The graph of the functions."""
    y, v = ca.SX.sym("y", m), ca.SX.sym("v", m)
    p = {name: ca.SX.sym(name) for name in names}
    results, symbols = called(y, v, p), [y, v, *p.values()]
    own = {str(element) for symbol in symbols for element in ca.vertsplit(symbol)}
    for what, result in zip(functions, results, strict=True):
        known = ca.vertcat(*symbols)
        strange = [str(s) for s in ca.symvar(result) if not ca.depends_on(known, s)]
        if strange:
            raise ValueError(
                f"{what}: holds {', '.join(strange)}, expected nothing but {', '.join(sorted(own))}"
            )
    try:
        return graph.written(symbols, [e for r in results for e in ca.vertsplit(ca.densify(r))])
    except ValueError as error:
        raise ValueError(
            f"expression: holds {error}; expected operations that CasADi knows, as ca.tanh in the "
            "place of math.tanh"
        ) from None


def _numbers(
    called: Callable[..., list[Any]], law: SmoothForce, values: dict[str, Any], step: int
) -> FloatArray:
    """Differences of what the functions give with numbers from the graph, in one order or another.

    (n, results), and what the graph gives in a second row.
    """
    rng, m = np.random.default_rng(1), len(law.directions)
    points = rng.normal(size=(4, 2, m)) * 10.0 ** np.array([-6, -4, -2, 0])[:, None, None]
    given = {name: float(np.ravel(value)[0]) for name, value in values.items()}
    result = [np.zeros(0)] * len(points)
    for i in range(len(points))[::step]:
        p = {name: ca.DM(value) for name, value in given.items()}
        y, v = points[i]
        found = called(ca.DM(y), ca.DM(v), p)
        numbers = np.concatenate([np.ravel(ca.DM(part).full()) for part in found])
        arguments = arguments_of(y[None], v[None], np.array([[*given.values()]]))
        with np.errstate(all="ignore"):
            of_graph = [law.instants.force(arguments)[0], law.instants.margins(arguments)[0][0]]
        result[i] = np.array([numbers, np.concatenate(of_graph)])
    return np.array(result)


def _agree(one: FloatArray, other: FloatArray) -> bool:
    """Whether all numbers are those of the graph, in both orders."""
    numbers = np.array([one[:, 0], other[:, 0], one[:, 1]])
    return bool(np.allclose(numbers, numbers[-1], rtol=1e-12, atol=0, equal_nan=True))


def _check_at_rest(law: SmoothForce, values: dict[str, Any]) -> None:
    """Raise ValueError for a force that at rest is no number, has no slope or jumps."""
    given = np.array(np.broadcast_arrays(*map(np.ravel, values.values()))).T
    m = len(law.directions)
    still = np.zeros((len(given), m))
    with np.errstate(all="ignore"):
        force, slope = law.instants.slopes(arguments_of(still, still, given))
        near = [
            law.instants.force(arguments_of(still + a * _TINY, still + b * _TINY, given))
            for a, b in ((1, 0), (-1, 0), (0, 1), (0, -1))
        ]
    if not np.isfinite(force).all():
        raise ValueError(f"expression: the force at rest is {_bad(force)}, expected a number")
    if not np.isfinite(slope).all():
        raise ValueError(
            f"expression: the slope of the force at rest is {_bad(slope)}, expected a number; a "
            "square root or a quotient may be rounded off, as in ca.sqrt(y**2 + p['small']**2)"
        )
    tried = law.tried({name: given[:, i] for i, name in enumerate(values)})
    size = np.abs(tried[np.isfinite(tried)]).max(initial=0.0)
    if np.abs(np.array(near) - force).max() > ROUND_OFF * size:
        raise ValueError(
            "expression: the force jumps at rest, expected a continuous one; ca.tanh(v / p['eps']) "
            "rounds off a sign, symhbm.laws.Coulomb is dry friction"
        )


def _bad(values: FloatArray) -> float:
    return float(values[~np.isfinite(values)][0])
