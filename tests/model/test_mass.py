"""Large consistent mass matrices: kinetic energy that may be negative is found without factors."""

import numpy as np
import pytest
import scipy.sparse as sp

from symhbm.model.mass import check_semidefinite


def consistent(diagonal, n=240):
    """Mass of n x n nodes by products of [1, diagonal, 1], rows that no diagonal leads."""
    one = sp.diags_array([np.ones(n - 1), np.full(n, diagonal), np.ones(n - 1)], offsets=[-1, 0, 1])
    return sp.csc_array(sp.kron(one, one))


def test_mass_of_elements_is_let_pass():
    check_semidefinite(consistent(4.0))


def test_negative_energy_is_refused():
    with pytest.raises(ValueError, match="negative kinetic energy"):
        check_semidefinite(consistent(1.8))
