"""Every verb finds what it found before, on structures of every class."""

import re
from functools import cache

import numpy as np
import pytest

from tests.quick import quick_first
from tests.stored.verbs import CALLS, VERBS, found, read

NEAR = 1e-11
"""Largest difference of numbers, relative to the largest of their variable."""
SLOPES_NEAR = 1e-8
"""That of derivatives, residuals apart, which are round-off."""
ROUND_OFF = ("residual", "mismatch", "error", "multiplier", "drift", "optimality", "periodicity")
"""Parts of names of variables that are round-off, or of which round-off decides digits."""
NOTHING = {"_by_": 1e-16, "slope": 1e-16, "dissipation": 1e-18}
"""Derivatives at an optimum, and energies [J], that are 0 but for round-off."""
DIGITS = re.compile(r"\d\.\d+e-1\d|\d+(?= stored points)")
"""Numbers of texts that are round-off, or count points of paths, which may move."""


@cache
def before():
    return read(VERBS)


@pytest.mark.parametrize("name", quick_first(CALLS, 4))
def test_verbs_find_what_they_found(name):
    now, expected = found(name), before()[name]
    assert sorted(now) == sorted(expected)
    for key, values in expected.items():
        assert now[key].shape == values.shape, key
        if values.dtype.kind == "U":
            texts = ([DIGITS.sub("0", text) for text in of.ravel()] for of in (now[key], values))
            assert next(texts) == next(texts), key
            continue
        if any(part in key for part in ROUND_OFF):
            continue
        near = SLOPES_NEAR if "derivative" in key or "slope" in key else NEAR
        scale = np.abs(values[np.isfinite(values)]).max(initial=0)
        least = max(near * scale, *(size for part, size in NOTHING.items() if part in key), 0.0)
        np.testing.assert_allclose(now[key], values, rtol=near, atol=least, err_msg=key)
