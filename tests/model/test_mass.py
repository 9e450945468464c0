"""Large consistent mass matrices: kinetic energy that may be negative is found without factors."""

import numpy as np
import pytest
import scipy.sparse as sp

from symhbm.model.linear.mass import _different_blocks, check_semidefinite


def consistent(diagonal, n=240):
    """Mass of n x n nodes by products of [1, diagonal, 1], rows that no diagonal leads."""
    one = sp.diags_array([np.ones(n - 1), np.full(n, diagonal), np.ones(n - 1)], offsets=[-1, 0, 1])
    return sp.csc_array(sp.kron(one, one))


def test_mass_of_elements_is_let_pass():
    check_semidefinite(consistent(4.0))


def test_negative_energy_is_refused():
    with pytest.raises(ValueError, match="negative kinetic energy"):
        check_semidefinite(consistent(1.8))


@pytest.mark.parametrize(
    "order", [np.arange(3 * 150**2), np.arange(3 * 150**2).reshape(3, -1).T.ravel()]
)
def test_directions_that_nothing_couples_are_looked_at_each(order):
    """Node by node and direction by direction; the same mass along two of them is seen once."""
    good, bad = consistent(4.0, 150), consistent(1.8, 150)
    for blocks, fails in (((good, good, good), False), ((good, good, bad), True)):
        mass = sp.csc_array(sp.block_diag(blocks))[order][:, order]
        assert len(_different_blocks(mass)) == 1 + fails
        if fails:
            with pytest.raises(ValueError, match="negative kinetic energy"):
                check_semidefinite(mass)
        else:
            check_semidefinite(mass)
