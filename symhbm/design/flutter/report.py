"""The best value of a parameter as variables of a dataset, with what was checked of it."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr

from symhbm.balance import HarmonicBalance
from symhbm.continuation import EventKind, SolveError, Status
from symhbm.design.flutter.limits import ModeSurface, SurfacePoint
from symhbm.design.flutter.optimum import LEVEL, Optimum, OptimumKind
from symhbm.design.outcome import labelled, with_certificate
from symhbm.numerics import FloatArray

GOOD = (Status.DAMPING_LARGEST, Status.DAMPING_AT_BOUND, Status.DAMPING_ON_RANGE)
"""Statuses of an answer."""

_SCANNED = 9
"""Values over the bounds at which the mode is computed again, beside the best one."""
_DECADES = 2
"""Decades of the amplitude over which a mode is followed to where it is computed again."""
_KINDS = {
    OptimumKind.MAXIMUM: "a maximum, where the exact slope is 0",
    OptimumKind.CORNER: "a corner, where the slope changes its sign",
    OptimumKind.BOUND: "a bound of the parameter",
    OptimumKind.RANGE: "a range of values that are as good as each other",
}


@dataclass(frozen=True)
class Answer:
    """The best value of a parameter of a problem, or that there is none, and checks of it.

    ``point`` is the mode at the best value, which is scanned at ``amplitudes`` [m]; ``complete``
    tells whether it was followed at all values.
    """

    problem: HarmonicBalance
    surface: ModeSurface
    optimum: Optimum | None
    point: SurfacePoint | None
    amplitudes: FloatArray
    complete: bool

    @cached_property
    def scanned(self) -> tuple[FloatArray, FloatArray]:
        """Values over the bounds and the best one, ascending, and damping ratios there.

        The largest at the amplitudes, NaN where there is none: the mode is followed over the
        amplitude there, from the linear one, not over the parameter.
        """
        if self.optimum is None:
            return np.zeros(0), np.zeros(0)
        low, high = sorted(self.surface.request.band)
        spread = np.linspace(low, high, _SCANNED)
        if low > 0:
            spread = np.clip(np.geomspace(low, high, _SCANNED), low, high)
        values = np.unique(np.append(spread, self.optimum.best.value))
        return values, np.array([self._largest_at(value) for value in values.tolist()])

    def _largest_at(self, value: float) -> float:
        """The largest damping ratio at a value of the parameter, NaN where there is none."""
        amplitudes, place = self.amplitudes, self.surface.curve.damping_place
        low = amplitudes[0] / 10.0**_DECADES if len(amplitudes) == 1 else amplitudes[0]
        try:
            branch = self.surface.over_amplitude(value, (low, amplitudes[-1]))
        except (ArithmeticError, ValueError):
            return np.nan
        folds = any(e.kind == EventKind.FOLD for point in branch.points for e in point.events)
        if branch.status != Status.REACHED_END and not folds:
            return np.nan
        found = [
            float(state.state[place])
            for amplitude in amplitudes
            for state, _ in branch.at(float(np.log10(amplitude)))
            if state is not None
        ]
        return max(found, default=np.nan)

    @property
    def _told(self) -> FloatArray:
        """Damping ratios that the scan found."""
        return self.scanned[1][np.isfinite(self.scanned[1])]

    def _is_surpassed(self, optimum: Optimum) -> bool:
        """Whether the scan found more than the best value has."""
        largest = float(np.abs(self._told).max(initial=0.0))
        return bool(np.any(self._told > optimum.best.damping_ratio + LEVEL * largest))

    def added_to(
        self, found: xr.Dataset, what: str, followed: str, surpassed: Status, throw: bool
    ) -> xr.Dataset:
        """What was ``found`` with all of a design; SolveError without an answer if asked for.

        ``what`` is largest, as the mode was ``followed``, unless a scan has ``surpassed`` it.
        """
        status = Status.DAMPING_NOT_FOLLOWED
        if self.optimum is not None and self.complete:
            beaten = self._is_surpassed(self.optimum)
            status = surpassed if beaten else self.optimum.status(self.surface.request.band)
        text = self._certificate(what, followed)
        result = with_certificate(found.merge(self._report()), status, text)
        if throw and status not in GOOD:
            raise SolveError(str(status), result)
        return result

    def _report(self) -> xr.Dataset:
        """All variables of a design."""
        request, optimum = self.surface.request, self.optimum
        label = request.name if request.index is None else f"{request.name}[{request.index}]"
        units = self.problem.records[request.name].units
        low, high = sorted(request.band)
        unknown = np.full(1, np.nan)
        value = first = last = unknown
        candidates, ratio, slope = (), np.nan, np.nan
        if optimum is not None:
            candidates, ratio = optimum.candidates, optimum.best.damping_ratio
            first, last = np.array([optimum.first]), np.array([optimum.last])
            value = unknown if optimum.best.kind == OptimumKind.RANGE else first
        if self.point is not None:
            slope = self.point.by_value * self.point.value
        kinds = np.array([str(c.kind) for c in candidates], dtype=object)
        table: dict[str, Any] = {
            "variable": ("variable", np.array([label], dtype=object)),
            "variable_units": ("variable", np.array([units], dtype=object)),
            "design_value": ("variable", value),
            "design_from": ("variable", first),
            "design_to": ("variable", last),
            "design_lower": ("variable", np.array([low])),
            "design_upper": ("variable", np.array([high])),
            "design_damping_ratio": ((), ratio),
            "design_slope": ((), slope),
            "candidate_value": ("candidate", _column([c.value for c in candidates])),
            "candidate_damping_ratio": (
                "candidate",
                _column([c.damping_ratio for c in candidates]),
            ),
            "candidate_kind": ("candidate", kinds),
            "scan_value": ("scan", self.scanned[0]),
            "scan_damping_ratio": ("scan", self.scanned[1]),
        }
        return labelled(table)

    def _certificate(self, what: str, followed: str) -> str:
        """Sentences on what was found and checked of the best value, and what was not."""
        optimum, point = self.optimum, self.point
        if optimum is None:
            return f"Nothing was found: {what} is not known anywhere within the bounds."
        best, sentences = optimum.best, []
        at = f"{best.value:.10g}"
        if best.kind == OptimumKind.RANGE:
            at = f"every value from {optimum.first:.10g} to {optimum.last:.10g} that was computed"
        sentences.append(
            f"Found: at {at} {what} is {best.damping_ratio:.10g}, {_KINDS[best.kind]}; {followed}."
        )
        if best.damping_ratio <= 0:
            sentences.append("It is not positive: the structure feeds this vibration by itself.")
        if point is not None:
            sentences.append(
                f"Checked: computed again there, the equations hold to {point.residual_norm:.1e} "
                "and the slope by the logarithm of the parameter is "
                f"{point.by_value * point.value:.1e}."
            )
        others = [c for c in optimum.candidates if c.value != best.value]
        if others:
            second = max(others, key=lambda candidate: candidate.damping_ratio)
            sentences.append(
                f"The next best is {second.damping_ratio:.6g} at {second.value:.6g}, {second.kind}."
            )
        if not self.complete:
            sentences.append("Not proved: that no value which was not followed is better.")
        if self._told.size:
            verdict = "none is larger"
            if self._is_surpassed(optimum):
                verdict = f"the largest of them, {self._told.max():.6g}, is larger"
            sentences.append(
                f"At {self._told.size} values over the bounds the mode was followed over its "
                f"amplitude instead, from the linear one: {verdict}."
            )
        if self.complete:
            sentences.append("Not proved: that the mode has no other motions of these amplitudes.")
        return "\n".join(sentences)


def _column(values: Sequence[float]) -> FloatArray:
    return np.array(values, dtype=float)
