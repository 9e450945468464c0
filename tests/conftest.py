"""Threads of linear algebra and processes of tests share the cores: set before NumPy is imported."""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
