"""CasADi functions on memory of NumPy, and matrices from their stored entries."""

import threading
from typing import Any

import casadi as ca
import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from symhbm.numerics.check import FloatArray

_MOST = 32
"""Points that one call evaluates: more take no less time for each."""
_ENTRIES = 1_000_000
"""Entries of inputs and outputs of one call, 8 MB."""


class Compiled:
    """A CasADi function that reads and writes memory of NumPy, without conversion at a call.

    Inputs and outputs are stored entries, column after column, a one-dimensional array each. One
    thread alone may fill ``inputs``, ``run`` and read ``outputs``; calls are safe among threads.
    """

    def __init__(self, function: ca.Function):
        self._function, self._mapped = function, dict[int, Compiled]()
        self._buffer, self._evaluate = function.buffer()
        self.inputs = [np.zeros(function.nnz_in(i)) for i in range(function.n_in())]
        self.outputs = [np.zeros(function.nnz_out(i)) for i in range(function.n_out())]
        for i, array in enumerate(self.inputs):
            self._buffer.set_arg(i, memoryview(array))  # type: ignore
        for i, array in enumerate(self.outputs):
            self._buffer.set_res(i, memoryview(array))  # type: ignore
        self._lock = threading.Lock()

    @property
    def capsule(self) -> Any:
        """What tells machine code where the function and its memory are."""
        return self._buffer._self()

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

    def at_points(self, n_points: int, *inputs: ArrayLike) -> list[FloatArray]:
        """Stored entries of the outputs at several points, (n_points, n_entries) each.

        So are the inputs, or (n_entries,) where they are those of all points.
        """
        most = _ENTRIES // sum(map(len, [*self.inputs, *self.outputs]))
        size = max(1, min(_MOST, most, 1 << (n_points - 1).bit_length()))
        with self._lock:
            if size not in self._mapped:
                self._mapped[size] = Compiled(self._function.map(size))
            mapped = self._mapped[size]
            into = [array.reshape(size, -1) for array in mapped.inputs]
            out = [array.reshape(size, -1) for array in mapped.outputs]
            by_point = []
            for array, value in zip(into, map(np.asarray, inputs), strict=True):
                if value.ndim > 1:
                    by_point.append((array, value))
                else:
                    array[:] = value
            results = [np.empty((n_points, array.shape[1])) for array in out]
            for first in range(0, n_points, size):
                n = min(size, n_points - first)
                for array, value in by_point:
                    array[:n] = value[first : first + n]
                mapped.run()
                for array, result in zip(out, results, strict=True):
                    result[first : first + n] = array[:n]
            return results


class Assembly:
    """Matrices of one sparsity from their stored entries, all ``as_full`` or all sparse."""

    def __init__(self, sparsity: ca.Sparsity, as_full: bool):
        self._shape = n_rows, n_columns = sparsity.shape
        self.as_full = as_full
        self._rows = np.array(sparsity.row(), dtype=np.int32)
        self._starts = np.array(sparsity.colind(), dtype=np.int32)
        self.places = np.repeat(np.arange(n_columns), np.diff(self._starts)) * n_rows + self._rows

    def __call__(self, values: FloatArray) -> Any:
        """The matrix with these stored entries."""
        if not self.as_full:
            return sp.csc_array((values, self._rows, self._starts), shape=self._shape)
        n_rows, n_columns = self._shape
        matrix = np.zeros(n_rows * n_columns)
        matrix[self.places] = values
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
