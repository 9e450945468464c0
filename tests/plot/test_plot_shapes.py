"""Operating deflection shapes: shares of nodal diameters."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from symhbm.plot.disks.shapes import nodal_shares


@given(
    n_blades=st.integers(3, 40),
    data=st.data(),
    forwards=st.booleans(),
    phase=st.floats(0, 6),
)
def test_a_wave_has_one_nodal_diameter(n_blades, data, forwards, phase):
    diameter = data.draw(st.integers(0, n_blades // 2))
    turn = (1 if forwards else -1) * 2 * np.pi * diameter * np.arange(n_blades) / n_blades + phase
    shares = nodal_shares(np.stack([np.cos(turn), np.sin(turn)], axis=-1)[:, None])
    expected = np.eye(n_blades // 2 + 1)[diameter]
    # Round-off of a transform.
    np.testing.assert_allclose(shares, expected, atol=1e-12)
