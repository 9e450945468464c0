"""Responses of a design, for named peaks and parameter sets, as functions of the variables.

The logarithm of an amplitude over the logarithms of the design variables is close to linear over
decades, as amplitudes go with powers of loads and stiffnesses. Maxima have exact derivatives.
Responses are computed here or by an executor.
"""

import pickle
import threading
from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache, partial
from typing import Any

import numpy as np

from symhbm.balance import HarmonicBalance, SecondOrder
from symhbm.continuation import Status
from symhbm.design import tolerances
from symhbm.design.variables import DesignVariables
from symhbm.numerics import RADIANS, FloatArray
from symhbm.peaks import Conditions, Maximum, MaximumKind, Survey, sector_of, survey
from symhbm.peaks.tracking import advanced, retrack
from symhbm.results import Sweep
from symhbm.workers import Workers, progress_bar

Bands = tuple[tuple[float, float], ...]
_NOTHING = 1e-300
"""What a goal of 0 counts as, which has no logarithm."""


@dataclass(frozen=True)
class FollowedMaximum:
    """One maximum of a response: ``value``, the logarithm of its amplitude, and derivatives.

    ``gradient`` (n_variables,), ``hessian`` (n_variables, n_variables), by the variables of a
    `DesignVariables`; ``maximum`` and ``multipliers``, from which it is followed.
    """

    value: float
    gradient: FloatArray
    hessian: FloatArray
    maximum: Maximum
    multipliers: FloatArray


@dataclass(frozen=True)
class Maxima:
    """Contenders of one response at one design: the maxima that may become the largest.

    ``contenders`` are in descending order; ``height`` is the logarithm of the largest response,
    infinite where it is unbounded or unknown; ``surveyed`` tells that the whole band was followed,
    and then ``n_peaks`` is its number of peaks; ``reason`` tells why the height is infinite, and
    ``failed`` that it is because the band could not be followed.
    """

    contenders: list[FollowedMaximum]
    height: float
    surveyed: bool
    n_peaks: int = 0
    reason: str = ""
    failed: bool = False


class Response:
    """The maxima of one case of a design: a parameter set, in ``bands`` [Hz].

    Those of one ``dof``, or of all.
    """

    def __init__(
        self,
        problem: HarmonicBalance,
        variables: DesignVariables,
        bands: Sequence[tuple[float, float]],
        compiled: dict[int, SecondOrder],
        dof: int | None = None,
    ):
        self.variables, self.bands, self.dof = variables, bands, dof
        # Sectors that are alike at a design of different variables are alike at every design.
        whole = variables.problem(problem, variables.apart)
        self._problem = sector_of(whole) if dof is None else whole
        key = id(self._problem.equations.residual)
        if key not in compiled:
            compiled[key] = SecondOrder(self._problem, variables.names)
        self._second_order = compiled[key]

    @property
    def unique(self) -> bool:
        """Whether there is one response at every frequency."""
        return self._problem.single_valued

    def at(self, x: FloatArray) -> HarmonicBalance:
        """The problem that is solved at a design (n_variables,)."""
        return self.variables.problem(self._problem, x)

    def survey(self, x: FloatArray) -> Maxima:
        """All contenders over the whole bands."""
        surveyed = survey(self.at(x), self.bands, dof=self.dof)
        # A band that was not followed to its end may hold a higher maximum.
        top = surveyed.height if surveyed.complete else np.inf
        n_peaks = sum(maximum.kind != MaximumKind.EDGE for maximum in surveyed.maxima)
        n_peaks += top == 0  # all along: it is no resonance outside that is highest at an end
        if not np.isfinite(top):
            failed = not surveyed.unbounded
            return Maxima([], np.inf, True, n_peaks, _why(surveyed), failed)
        least = tolerances.CONTENDER * top
        # Beside resonances the ends of bands rise and fall against each other by large factors.
        beside = surveyed.maxima[0].kind == MaximumKind.EDGE
        ends = {s.frequency: s for s in reversed(surveyed.maxima) if s.kind == MaximumKind.EDGE}
        kept = {id(s) for s in ends.values()} if beside else set()
        maxima = [s for s in surveyed.maxima if s.amplitude >= least or id(s) in kept]
        maxima = maxima[: tolerances.MOST]
        contenders = [self._followed(Conditions.of(self._second_order, s)) for s in maxima]
        return Maxima(contenders, _logarithm(top), True, n_peaks)

    def follow(self, x: FloatArray, before: FloatArray, maxima: Maxima) -> Maxima | None:
        """The same maxima at another design, from ``before``; None where a survey is needed.

        Of few contenders, those that end between the designs are left out: the survey at the end of
        a descent finds what replaces them.
        """
        problem, previous_problem = self.at(x), self.at(before)
        few = len(maxima.contenders) <= tolerances.FEW
        followed = []
        for contender in maxima.contenders:
            maximum = replace(contender.maximum, problem=previous_problem)
            conditions = Conditions.of(self._second_order, maximum, contender.multipliers)
            step = advanced(conditions, problem)
            if step is None and not few:
                return None
            moved = step[0] if step else retrack(conditions, problem)
            if moved is not None and not self._inside(moved.maximum):
                return None  # The end of the band takes the place of a peak that left it.
            if moved is not None:
                followed.append(self._followed(moved))
        followed.sort(key=lambda contender: -contender.value)
        return Maxima(followed, followed[0].value, False) if followed else None

    def _inside(self, maximum: Maximum) -> bool:
        frequency = maximum.frequency / RADIANS
        return maximum.held or any(low <= frequency <= high for low, high in self.bands)

    def _followed(self, conditions: Conditions) -> FollowedMaximum:
        maximum = conditions.maximum
        entries = self.variables.derivative(maximum.problem, self._second_order.places)
        slope = entries.T @ conditions.gradient
        bend = entries.T @ conditions.hessian @ entries + np.diag(slope)
        amplitude = max(maximum.amplitude, _NOTHING)
        gradient = slope / amplitude
        hessian = bend / amplitude - np.outer(gradient, gradient)
        # Maxima are sent between processes, without the problem.
        detached = replace(maximum, problem=None)
        value = _logarithm(amplitude)
        return FollowedMaximum(value, gradient, hessian, detached, conditions.multipliers)


def amplitudes(heights: Any) -> FloatArray:
    """The amplitudes, goals or aims of their logarithms."""
    return np.where(np.asarray(heights) <= np.log(2 * _NOTHING), 0.0, np.exp(heights))


def _logarithm(amplitude: float) -> float:
    return float(np.log(max(amplitude, _NOTHING)))


def _why(surveyed: Survey) -> str:
    if surveyed.unbounded:
        peak = surveyed.unbounded[0]
        return f"unbounded at {peak.value / (2 * np.pi):.6g} Hz"
    return str(surveyed.status)


Previous = tuple[FloatArray, Maxima]
"""A design and the maxima at it."""


@dataclass(frozen=True)
class NamedPeak:
    """The largest response of a ``problem`` in ``bands`` [Hz] of each case, or that of one ``dof``.

    Or the largest value of a goal. ``name`` is what aims call it.
    """

    name: str
    problem: HarmonicBalance
    bands: Sequence[Bands]
    dof: int | None = None

    @property
    def units(self) -> str:
        """Unit of its value."""
        goal = self.problem.goal
        return "m" if goal is None else goal.units


@dataclass
class Cases:
    """Responses of all named peaks for all parameter sets of a sweep, computed here or by workers.

    They are numbered peak by peak. ``surveys`` and ``follows`` count surveyed and followed
    responses; ``failed`` has designs at which a band could not be followed to its end, and why.
    """

    work: "Work"
    executor: Executor | None = None
    progress: bool | None = False
    surveys: int = 0
    follows: int = 0
    failed: list[tuple[FloatArray, str]] = field(default_factory=list)

    @property
    def size(self) -> int:
        """Number of responses."""
        return len(self.work.peaks) * self.work.sweep.size

    @cached_property
    def _bar(self) -> Any:
        return progress_bar("response", self.progress)

    @cached_property
    def _workers(self) -> Workers:
        return Workers(self.executor, "responses")

    @cached_property
    def _payload(self) -> bytes:
        work = self.work
        return pickle.dumps((work.peaks, work.sweep, work.variables))

    def changed(self, **changes: Any) -> "Cases":
        """The same with other fields of its `Work`: other variables, or another sweep."""
        return Cases(replace(self.work, **changes), self.executor, self.progress)

    @property
    def unique(self) -> bool:
        """Whether all have one response at every frequency, at any design."""
        return all(self.response(number).unique for number in range(self.size))

    def response(self, number: int) -> Response:
        """One response, in this process."""
        return self.work.response(number)

    def __call__(
        self, x: FloatArray, previous: tuple[FloatArray, list[Maxima]] | None = None
    ) -> list[Maxima]:
        """Maxima of all responses at a design: surveyed, or followed from a ``previous`` design."""
        before: list[Previous | None] = [None] * self.size
        if previous is not None:
            before = [(previous[0], state) for state in previous[1]]
        calls = [(number, x, state) for number, state in enumerate(before)]
        if self.size == 1:
            maxima = [self.work(*calls[0])]
        else:
            maxima = list(self._workers.map(partial(_remote, self._payload), self.work, calls))
        surveyed = sum(state.surveyed for state in maxima)
        self.surveys += surveyed
        self.follows += len(maxima) - surveyed
        self.failed += [(x, state.reason) for state in maxima if state.failed]
        self._bar.update(len(maxima))
        return maxima


@dataclass(frozen=True)
class Work:
    """Named ``peaks`` with all parameter sets of a ``sweep``.

    Designed parameters that are swept as well keep their proportions to the nominal ones. Responses
    of one structure share compiled functions.
    """

    peaks: Sequence[NamedPeak]
    sweep: Sweep
    variables: DesignVariables
    _responses: dict[int, Response] = field(default_factory=dict, init=False)
    _compiled: dict[int, SecondOrder] = field(default_factory=dict, init=False)

    @property
    def problem(self) -> HarmonicBalance:
        """The problem of the first peak, whose response is reported."""
        return self.peaks[0].problem

    def response(self, number: int) -> Response:
        """One response, by its number peak by peak."""
        if number not in self._responses:
            which, case = divmod(number, self.sweep.size)
            peak, chosen = self.peaks[which], self.sweep.chosen(case)
            own_variables = self.variables.proportional(peak.problem, chosen)
            problem = peak.problem.with_parameters(**chosen)
            self._responses[number] = Response(
                problem, own_variables, peak.bands[case], self._compiled, peak.dof
            )
        return self._responses[number]

    def __call__(self, number: int, x: FloatArray, previous: Previous | None) -> Maxima:
        """The maxima of one response at a design: followed from a ``previous`` one, or surveyed."""
        response = self.response(number)
        try:
            followed = None if previous is None else response.follow(x, *previous)
            return response.survey(x) if followed is None else followed
        except ArithmeticError:
            return Maxima([], np.inf, True, 0, str(Status.COMPUTATION_FAILED), True)


def _remote(payload: bytes, number: int, x: FloatArray, previous: Previous | None) -> Maxima:
    return _unpacked(payload, threading.get_ident())(number, x, previous)


@lru_cache(maxsize=8)
def _unpacked(payload: bytes, thread: int) -> Work:
    return Work(*pickle.loads(payload))
