"""CasADi functions on memory of NumPy, and matrices from their stored entries."""

import threading
from typing import Any

import casadi as ca
import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from symhbm.numerics.arrays import FloatArray
from symhbm.numerics.linear_algebra import DENSE_LIMIT


class Compiled:
    """A CasADi function that reads and writes memory of NumPy, without conversion at a call.

    Inputs and outputs are stored entries, column after column, a one-dimensional array each. One
    thread alone may fill ``inputs``, ``run`` and read ``outputs``; calls are safe among threads.
    """

    def __init__(self, function: ca.Function):
        self._buffer, self._evaluate = function.buffer()
        self.inputs = [np.zeros(function.nnz_in(i)) for i in range(function.n_in())]
        self.outputs = [np.zeros(function.nnz_out(i)) for i in range(function.n_out())]
        for i, array in enumerate(self.inputs):
            self._buffer.set_arg(i, memoryview(array))  # type: ignore
        for i, array in enumerate(self.outputs):
            self._buffer.set_res(i, memoryview(array))  # type: ignore
        self._lock = threading.Lock()

    def run(self) -> None:
        """Evaluate ``outputs`` at ``inputs``; RuntimeError for a matrix that is singular."""
        self._evaluate()
        if self._buffer.ret():
            raise RuntimeError("a linear system of the function is singular")

    def __call__(self, *inputs: ArrayLike) -> list[FloatArray]:
        """Stored entries of the outputs."""
        with self._lock:
            for array, value in zip(self.inputs, inputs, strict=True):
                array[:] = value
            self.run()
            return [array.copy() for array in self.outputs]


class Assembly:
    """Matrices of one sparsity from their stored entries: full up to a size, sparse above."""

    def __init__(self, sparsity: ca.Sparsity):
        self._shape = n_rows, n_columns = sparsity.shape
        self._full = max(self._shape) <= DENSE_LIMIT
        self._rows = np.array(sparsity.row(), dtype=np.int32)
        self._starts = np.array(sparsity.colind(), dtype=np.int32)
        self._flat = np.repeat(np.arange(n_columns), np.diff(self._starts)) * n_rows + self._rows

    def __call__(self, values: FloatArray) -> Any:
        """The matrix with these stored entries."""
        if not self._full:
            return sp.csc_array((values, self._rows, self._starts), shape=self._shape)
        n_rows, n_columns = self._shape
        matrix = np.zeros(n_rows * n_columns)
        matrix[self._flat] = values
        return matrix.reshape(n_columns, n_rows).T


def sparsity_of(matrix: sp.csc_array) -> ca.Sparsity:
    """CasADi's form of the sparsity of a matrix."""
    rows, columns = matrix.shape  # type: ignore
    starts, entries = (list(map(int, part)) for part in (matrix.indptr, matrix.indices))
    return ca.Sparsity(rows, columns, starts, entries)


def constant(matrix: Any) -> ca.DM:
    """CasADi's form of a matrix."""
    columns = sp.csc_array(matrix)
    columns.sort_indices()
    return ca.DM(sparsity_of(columns), columns.data)
