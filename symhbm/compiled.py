"""A CasADi function that reads and writes NumPy memory: no conversion at a call."""

import threading
from collections.abc import Sequence

import casadi as ca
import numpy as np

from symhbm.fourier import FloatArray


class Compiled:
    """Calls ``function`` with arrays of the stored entries of its inputs, in column order."""

    def __init__(self, function: ca.Function):
        self._buffer, self._trigger = function.buffer()
        self._inputs = [np.zeros(function.nnz_in(i)) for i in range(function.n_in())]
        self._outputs = [np.zeros(function.nnz_out(i)) for i in range(function.n_out())]
        for i, array in enumerate(self._inputs):
            self._buffer.set_arg(i, memoryview(array))  # type: ignore
        for i, array in enumerate(self._outputs):
            self._buffer.set_res(i, memoryview(array))  # type: ignore
        self._known: Sequence[FloatArray] | None = None
        self._lock = threading.Lock()

    def __call__(
        self, first: Sequence, constant: Sequence[FloatArray], last: Sequence
    ) -> list[FloatArray]:
        """Stored entries of the outputs; the inputs ``constant`` in the middle are kept by call.

        They are only read where they are another object than in the call before.
        """
        with self._lock:
            inputs = self._inputs
            for array, value in zip(inputs, first, strict=False):
                array[:] = value
            n = len(first)
            if self._known is not constant:
                for array, value in zip(inputs[n : n + len(constant)], constant, strict=True):
                    array[:] = value
                self._known = constant
            for array, value in zip(inputs[n + len(constant) :], last, strict=True):
                array[:] = value
            self._trigger()
            return [array.copy() for array in self._outputs]
