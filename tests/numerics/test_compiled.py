"""CasADi functions on memory of NumPy."""

import casadi as ca
import numpy as np
import pytest

from symhbm.numerics import Compiled, compiled


def build():
    """A function of a vector, a number and two parameters: one output full, one sparse."""
    x, omega, values = ca.SX.sym("x", 3), ca.SX.sym("omega"), ca.SX.sym("values", 2)
    full = ca.sin(omega * x) + values[0] * ca.sumsqr(x)
    sparse = ca.diag(ca.log(x * x + values[1]))
    return Compiled(ca.Function("f", [x, omega, values], [full, sparse]))


@pytest.mark.parametrize("n_points", [1, 3, 32, 33, 70])
@pytest.mark.parametrize("entries", [10, 60, 10**6])
def test_many_points_are_points_alone(n_points, entries, monkeypatch):
    """To the bit, with inputs of each point and of all of them."""
    monkeypatch.setattr(compiled, "_ENTRIES", entries)
    function, rng = build(), np.random.default_rng(0)
    for n in (n_points, max(1, n_points - 1)):  # what the first call left is not in the second
        x, omega, values = rng.normal(size=(n, 3)), rng.normal(size=(n, 1)), rng.normal(size=2) ** 2
        by_point = np.tile(values, (n, 1))
        for given in (values, by_point):
            full, sparse = function.at_points(n, x, omega, given)
            assert full.shape == sparse.shape == (n, 3)
            for i in range(n):
                one, other = function(x[i], omega[i], values)
                np.testing.assert_array_equal(full[i], one)
                np.testing.assert_array_equal(sparse[i], other)
