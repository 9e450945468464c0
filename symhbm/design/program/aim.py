"""Aims: what a design makes as small as it gets, a function of named peaks and of the design."""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symhbm.numerics import FloatArray


@dataclass(frozen=True)
class Aim:
    """One aim; designs compare by ``(log(aim) - offset) / scale``.

    ``logarithm`` is a CasADi function of the logarithms of the named peaks (n_peaks,) and of the
    design variables (n_variables,), which are logarithms, too; ``name`` and those of the ``peaks``
    are for messages. ``is_peak`` tells that it is the one peak there is, and nothing else.
    """

    name: str
    logarithm: ca.Function = field(compare=False)
    peaks: tuple[str, ...] = ("largest",)
    offset: float = 0.0
    scale: float = 1.0
    is_peak: bool = False

    @classmethod
    def of_peak(cls, n_variables: int) -> "Aim":
        """The peak itself, of one name."""
        peak, x = ca.SX.sym("peak"), ca.SX.sym("x", n_variables)
        function = ca.Function("aim", [peak, x], [peak])
        return cls("the largest response", function, is_peak=True)

    def __call__(self, peaks: Any, x: Any) -> Any:
        """The expression that designs compare by."""
        return (self.logarithm(peaks, x) - self.offset) / self.scale

    @cached_property
    def uses(self) -> NDArray[np.bool_]:
        """Which of the named peaks it depends on, (n_peaks,)."""
        return np.array(self._depends(0))

    @cached_property
    def by_design(self) -> bool:
        """Whether it depends on the design by itself, besides through the peaks."""
        return any(self._depends(1))

    def _depends(self, number: int) -> list[bool]:
        inputs = self.logarithm.sx_in()
        return ca.which_depends(self.logarithm(*inputs), inputs[number], 1, False)

    @cached_property
    def _with_slopes(self) -> ca.Function:
        inputs = self.logarithm.sx_in()
        value = self.logarithm(*inputs)
        return ca.Function("slopes", inputs, [value, ca.gradient(value, inputs[0])])

    def value(self, peaks: FloatArray, x: FloatArray) -> float:
        """The logarithm at a design; infinite where a peak that it uses is.

        Raises ValueError where it is no positive number, or falls while a peak rises.
        """
        if not np.all(np.isfinite(peaks[self.uses])):
            return np.inf
        known = np.where(self.uses, peaks, 0.0)
        value, slopes = (np.asarray(out.full()).ravel() for out in self._with_slopes(known, x))
        amplitudes = zip(self.peaks, np.exp(known), self.uses, strict=True)
        at = [f"{name} = {amplitude:.6g} m" for name, amplitude, used in amplitudes if used]
        design = ", ".join(f"{number:.6g}" for number in np.exp(x))
        where = f"at the values {design}{' with ' if at else ''}{', '.join(at)}"
        if not np.isfinite(value[0]):
            raise ValueError(
                f"{self.name}: expected a positive number, got {self._number(known, x):g} {where}"
            )
        if np.any(slopes < -1e-9):
            raise ValueError(
                f"{self.name}: expected an expression that falls with no peak that rises; it falls "
                f"with {self.peaks[int(np.argmin(slopes))]!r} {where}"
            )
        return float(value[0])

    def _number(self, peaks: FloatArray, x: FloatArray) -> float:
        """The aim itself where it has no logarithm."""
        inputs = self.logarithm.sx_in()
        logarithm = self.logarithm(*inputs)
        number = logarithm.dep(0) if logarithm.op() == ca.OP_LOG else ca.exp(logarithm)
        return float(ca.Function("number", inputs, [number])(peaks, x))

    def relative(self, peaks: FloatArray, x: FloatArray) -> float:
        """What designs compare by, a number."""
        return (self.value(peaks, x) - self.offset) / self.scale

    def merged(self, index: NDArray[np.intp], n_variables: int) -> "Aim":
        """The same of fewer variables, where variable ``j`` here is ``index[j]`` of those."""
        peaks, x = self.logarithm.sx_in()[0], ca.SX.sym("x", n_variables)
        spread = ca.vertcat(*(x[int(j)] for j in index))
        function = ca.Function("aim", [peaks, x], [self.logarithm(peaks, spread)])
        return replace(self, logarithm=function)
