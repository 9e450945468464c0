"""What calls of designs have in common: the problem, its cases and named peaks, and responses."""

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from symhbm.balance import HarmonicBalance, check_mean, check_problem
from symhbm.design import arguments
from symhbm.design.cases import Bands, NamedPeak, Work
from symhbm.design.outcome import Comparison, compared
from symhbm.design.program import Aim, CaseStatistic, Limits, Program, Statistic
from symhbm.design.variables import DesignVariables
from symhbm.model import DOUBT, advise_condensing, warn_of_doubts
from symhbm.model.linear import natural_band
from symhbm.numerics import FloatArray, check
from symhbm.response import frf
from symhbm.results import Sweep, parse, runs

_BESIDE = 0.1
"""How far beside single frequencies, relative, the path through them begins."""


@dataclass(frozen=True)
class Task:
    """A problem with the cases of a ``sweep``, what may vary within which limits, and its peaks.

    ``bands`` [Hz] are those of each case, of peaks that have none of their own.
    """

    problem: HarmonicBalance
    sweep: Sweep
    variables: DesignVariables
    limits: Limits
    statistic: CaseStatistic
    bands: Sequence[Bands]
    peaks: Sequence[NamedPeak]

    @classmethod
    def of(
        cls,
        problem: Any,
        parameters: Any,
        bounds: Any,
        frequency: Any,
        over: Mapping[str, Any] | xr.Dataset | None,
        *,
        vary: Any,
        statistic: Any,
        tail: Any,
        constraint: Any,
        peaks: Any,
    ) -> "Task":
        """The arguments of a call, checked; raises TypeError, ValueError or KeyError."""
        check_problem(problem, bends=True)
        advise_condensing(problem.model, problem.n_unknowns, "second derivatives take minutes")
        if problem.samples is not None:
            raise ValueError(
                f"problem: expected located switching angles, got friction over {problem.samples} "
                "samples, which has no second derivatives"
            )
        sweep = parse(problem, over)
        arguments.check_dimensions(sweep)
        arguments.check_forces(problem, sweep)
        variables = arguments.read_variables(problem, parameters, bounds, vary)
        arguments.check_ratios(problem, variables, sweep)
        if statistic not in [str(member) for member in Statistic]:
            raise ValueError(
                f"statistic={check.shown(statistic)}: expected 'worst', 'mean' or 'tail'"
            )
        if not 0 < check.scalar("tail", tail) <= 1:
            raise ValueError(f"tail={check.shown(tail)}: expected a share above 0, up to 1")
        limits = arguments.read_limits(problem, variables, constraint)
        check_mean(problem)
        if frequency is None:
            frequency = _resonances(problem, sweep, variables)
        bands = arguments.read_bands(frequency, sweep)
        named = arguments.read_peaks(problem, peaks, variables, bands, sweep)
        cases = CaseStatistic(Statistic(statistic), tail)
        task = cls(problem, sweep, variables, limits, cases, bands, named)
        problem.model.check_frequencies("frequency_band", task.hull)
        moving = {*variables.names, *sweep.values}
        driven = "force_amplitude" in problem.parameters
        warn_of_doubts(problem.model, task.hull, problem.harmonics, moving=moving, driven=driven)
        return task

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the peaks."""
        return tuple(peak.name for peak in self.peaks)

    @property
    def work(self) -> Work:
        """The responses of all peaks and cases."""
        return Work(self.peaks, self.sweep, self.variables)

    @property
    def hull(self) -> tuple[float, float]:
        """The least band [Hz] that holds those of all peaks of the problem itself."""
        own = [one for peak in self.peaks if peak.problem is self.problem for one in peak.bands]
        edges = np.array([band for case_bands in own or self.bands for band in case_bands])
        return float(edges.min()), float(edges.max())

    @property
    def all_bands(self) -> list[tuple[float, float]]:
        """The different bands [Hz] of all peaks."""
        return sorted({one for peak in self.peaks for bands in peak.bands for one in bands})

    def program(self, *aims: Aim) -> Program:
        """The program of aims; by default the largest response."""
        aims = aims or (Aim.of_peak(self.variables.n_variables),)
        return Program(self.variables, self.statistic, aims, self.limits, self.names)

    def read_aim(self, name: str, function: Any) -> Aim:
        """The aim of a function of the user."""
        return arguments.read_aim(name, function, self.names, self.problem, self.variables)

    def responses(
        self, designs: Sequence[FloatArray], running: runs.Running, dim: str | None = None
    ) -> xr.Dataset:
        """Frequency responses of all cases at one design, or at several along ``dim``."""
        variables, sweep, problem = self.variables, self.sweep, self.problem
        over: dict[str, Any] = {k: v for k, v in sweep.values.items() if k not in variables.names}
        own = [variables.proportional(problem, sweep.chosen(i)) for i in range(sweep.size)]
        for name in variables.names:
            swept = name in sweep.values
            if not swept and dim is None:
                continue
            inner = problem.model.dims_of(name)
            coords = sweep.values[name].coords if swept else {}
            labels = {str(label): coords[label] for label in coords if label not in inner}
            chosen = own if swept else [variables]
            values = [[one.parameters(problem, x)[name] for one in chosen] for x in designs]
            shape, dims = (sweep.shape, sweep.dims) if swept else ((), ())
            if dim is not None:
                shape, dims = (len(designs), *shape), (dim, *dims)
            array = np.reshape(values, (*shape, *np.shape(values[0][0])))
            over[name] = xr.DataArray(array, dims=(*dims, *inner), coords=labels)
        best = variables.problem(problem, designs[0])
        with warnings.catch_warnings():
            # The problem was warned of already.
            warnings.filterwarnings("ignore", message=DOUBT)
            shared = runs.Sharing(executor=running.executor, progress=running.progress)
            low, high = self.hull
            if any(first < last for first, last in self.all_bands):
                return frf(best, (low, high), over=over or None, **shared)
            # Single frequencies, on a path through them.
            band = (1 - _BESIDE) * low, (1 + _BESIDE) * high
            at = [first for first, _ in self.all_bands]
            return frf(best, band, over=over or None, at=at, **shared)

    def compared(self, result: xr.Dataset, heights: FloatArray) -> Comparison | None:
        """Responses at one design beside the heights (n_responses,) that the search found there.

        None where the first peak is of another problem, whose responses are not there, or at
        frequencies that are not.
        """
        first = self.peaks[0]
        single = any(low == high for bands in first.bands for low, high in bands)
        wide = any(low < high for low, high in self.all_bands)
        if first.problem is not self.problem or (single and wide):
            return None
        return compared(result, self.sweep, first, heights[: self.sweep.size])


def _resonances(
    problem: HarmonicBalance, sweep: Sweep, variables: DesignVariables
) -> tuple[float, float]:
    """A band [Hz] that holds the resonances of all cases at all designs."""
    models = []
    for number in range(sweep.size):
        chosen = sweep.chosen(number)
        case, own = problem.with_parameters(**chosen), variables.proportional(problem, chosen)
        models += [own.problem(case, x).model for x in (variables.lower, variables.upper)]
    return natural_band(models)
