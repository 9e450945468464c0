"""Cases of a design: parameter sets with bands, computed here or by an executor."""

import pickle
import threading
from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache, partial
from typing import Any

from symhbm.balance import HarmonicBalance, SecondOrder
from symhbm.design.maxima import Maxima, Response
from symhbm.design.variables import DesignVariables
from symhbm.numerics import FloatArray
from symhbm.results import Sweep
from symhbm.workers import Workers, progress_bar

Bands = tuple[tuple[float, float], ...]
Previous = tuple[FloatArray, Maxima]
"""A design and the maxima at it."""


@dataclass
class Cases:
    """Responses of a problem for all parameter sets of a sweep, computed here or by workers.

    ``surveys`` and ``follows`` count surveyed and followed responses.
    """

    work: "Work"
    executor: Executor | None = None
    progress: bool | None = False
    surveys: int = 0
    follows: int = 0

    @property
    def size(self) -> int:
        """Number of parameter sets."""
        return self.work.sweep.size

    @cached_property
    def _bar(self) -> Any:
        return progress_bar("response", self.progress)

    @cached_property
    def _workers(self) -> Workers:
        return Workers(self.executor, "responses")

    @cached_property
    def _payload(self) -> bytes:
        work = self.work
        return pickle.dumps((work.problem, work.sweep, work.variables, work.bands))

    def changed(self, **changes: Any) -> "Cases":
        """The same with other fields of its `Work`: other variables, or another sweep."""
        return Cases(replace(self.work, **changes), self.executor, self.progress)

    @property
    def unique(self) -> bool:
        """Whether all have one response at every frequency, at any design."""
        return all(self.response(number).unique for number in range(self.size))

    def response(self, number: int) -> Response:
        """The response of one case, in this process."""
        return self.work.response(number)

    def __call__(
        self, x: FloatArray, previous: tuple[FloatArray, list[Maxima]] | None = None
    ) -> list[Maxima]:
        """Maxima of all cases at a design: surveyed, or followed from a ``previous`` design."""
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
        self._bar.update(len(maxima))
        return maxima


@dataclass(frozen=True)
class Work:
    """A problem with all parameter sets of a ``sweep``, each in its ``bands`` [Hz].

    Designed parameters that are swept as well keep their proportions to the nominal ones. Cases of
    one structure share compiled functions.
    """

    problem: HarmonicBalance
    sweep: Sweep
    variables: DesignVariables
    bands: Sequence[Bands]
    _responses: dict[int, Response] = field(default_factory=dict, init=False)
    _compiled: dict[int, SecondOrder] = field(default_factory=dict, init=False)

    def response(self, number: int) -> Response:
        """The response of one case."""
        if number not in self._responses:
            chosen = self.sweep.chosen(number)
            own_variables = self.variables.proportional(self.problem, chosen)
            case, bands = self.problem.with_parameters(**chosen), self.bands[number]
            self._responses[number] = Response(case, own_variables, bands, self._compiled)
        return self._responses[number]

    def __call__(self, number: int, x: FloatArray, previous: Previous | None) -> Maxima:
        """The maxima of one case at a design: followed from a ``previous`` one, or surveyed."""
        response = self.response(number)
        followed = None if previous is None else response.follow(x, *previous)
        return response.survey(x) if followed is None else followed


def _remote(payload: bytes, number: int, x: FloatArray, previous: Previous | None) -> Maxima:
    return _unpacked(payload, threading.get_ident())(number, x, previous)


@lru_cache(maxsize=8)
def _unpacked(payload: bytes, thread: int) -> Work:
    return Work(*pickle.loads(payload))
