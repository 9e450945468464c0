"""Derivatives of the slip limit of friction, from the one formula that tells it."""

from functools import lru_cache
from typing import Any, Protocol

import casadi as ca

from symhbm.numerics import Compiled


class LimitLaw(Protocol):
    """A law with a slip limit of named values."""

    @property
    def parameters(self) -> Any:
        """Its parameters by name, ``contact_stiffness`` among them."""
        ...

    def slip_limit(self, frequency: Any, values: Any) -> Any:
        """The limit [N] of symbols."""
        ...


@lru_cache(maxsize=64)
def limit_moves(law: LimitLaw) -> bool:
    """Whether the limit depends on the frequency."""
    frequency = ca.SX.sym("frequency")
    values = {name: ca.SX.sym(name) for name in law.parameters}
    return bool(ca.jacobian(law.slip_limit(frequency, values), frequency).nnz())


@lru_cache(maxsize=64)
def limit_slopes(law: LimitLaw, n_contacts: int) -> Compiled:
    """First and second derivatives of ``ln(k_d / g)`` of each contact by frequency and values."""
    frequency, values = ca.SX.sym("frequency"), ca.SX.sym("values", len(law.parameters))
    by_name = dict(zip(law.parameters, ca.vertsplit(values), strict=True))
    stiffness, limit = by_name["contact_stiffness"], law.slip_limit(frequency, by_name)
    pulled, bounded = stiffness > 0, limit > 0
    variables = ca.vertcat(frequency, values)
    parts = []
    for value, sign, where in ((stiffness, 1, pulled), (limit, -1, bounded)):
        first = ca.densify(ca.jacobian(value, variables)).T
        second = ca.densify(ca.hessian(value, variables)[0])
        safe = ca.if_else(where, value, 1)
        slope = first / safe
        parts.append(
            [ca.if_else(where, sign * part, 0) for part in (slope, second / safe - slope @ slope.T)]
        )
    (first, second), (other_first, other_second) = parts
    outputs = [first + other_first, ca.vec(second + other_second)]
    return Compiled(ca.Function("limit_slopes", [frequency, values], outputs).map(n_contacts))
