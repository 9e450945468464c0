"""Processes of tests share the cores: no threads of linear algebra beside them."""

import os
import sys

import pytest

# Before NumPy is imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


@pytest.fixture(autouse=True)
def _no_figures_left():
    """Figures of examples and commands stay open otherwise, and too many of them are a warning."""
    yield
    if "matplotlib.pyplot" in sys.modules:
        sys.modules["matplotlib.pyplot"].close("all")
