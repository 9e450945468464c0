"""Processes of tests share the cores: no threads of linear algebra beside them."""

import os

# Before NumPy is imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
