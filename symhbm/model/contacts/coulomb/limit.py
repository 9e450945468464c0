"""Derivatives of the slip limit of friction, from the one formula that tells it."""

from functools import lru_cache
from typing import Any

import casadi as ca

from symhbm.numerics import Compiled


@lru_cache(maxsize=64)
def limit_moves(law: Any) -> bool:
    """Whether the limit depends on the frequency."""
    frequency = ca.SX.sym("frequency")
    values = {name: ca.SX.sym(name) for name in law.parameters}
    return bool(ca.jacobian(law.slip_limit(frequency, values), frequency).nnz())


@lru_cache(maxsize=64)
def limit_slopes(law: Any, n_contacts: int) -> Compiled:
    """Derivatives of ``ln(k_d / g)`` of each contact by frequency and values, 0 without either."""
    frequency, values = ca.SX.sym("frequency"), ca.SX.sym("values", len(law.parameters))
    by_name = dict(zip(law.parameters, ca.vertsplit(values), strict=True))
    limit = law.slip_limit(frequency, by_name)
    slopes = ca.SX.zeros(1 + values.numel())
    for value, sign in ((by_name["contact_stiffness"], 1), (limit, -1)):
        slope = ca.densify(ca.jacobian(value, ca.vertcat(frequency, values))).T
        slopes += ca.if_else(value > 0, sign * slope / ca.if_else(value > 0, value, 1), 0)
    return Compiled(ca.Function("limit_slopes", [frequency, values], [slopes]).map(n_contacts))
