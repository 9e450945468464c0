"""Responses of a design: named peaks of parameter sets, computed here or by an executor."""

import pickle
import threading
from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache, partial
from typing import Any

from symhbm.balance import HarmonicBalance, SecondOrder
from symhbm.balance.goals import Goal
from symhbm.continuation import Status
from symhbm.design.maxima import Maxima, Response
from symhbm.design.variables import DesignVariables
from symhbm.numerics import FloatArray
from symhbm.results import Sweep
from symhbm.workers import Workers, progress_bar

Bands = tuple[tuple[float, float], ...]
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
    def goal(self) -> Goal | None:
        """What has the peak in the place of displacements."""
        return self.problem.goal

    @property
    def units(self) -> str:
        """Unit of its value."""
        return "m" if self.goal is None else self.goal.units


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
            return Maxima.of_failure(str(Status.COMPUTATION_FAILED))


def _remote(payload: bytes, number: int, x: FloatArray, previous: Previous | None) -> Maxima:
    return _unpacked(payload, threading.get_ident())(number, x, previous)


@lru_cache(maxsize=8)
def _unpacked(payload: bytes, thread: int) -> Work:
    return Work(*pickle.loads(payload))
