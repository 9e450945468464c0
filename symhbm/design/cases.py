"""Cases of a design: parameter sets with bands, computed here or by an executor."""

import pickle
import threading
from collections.abc import Sequence
from concurrent.futures import Executor
from functools import lru_cache, partial

from symhbm.balance import HarmonicBalance, SecondOrder
from symhbm.design.maxima import Maxima, Response
from symhbm.design.variables import DesignVariables
from symhbm.numerics import FloatArray
from symhbm.results import Sweep
from symhbm.workers import Workers, progress_bar

Bands = tuple[tuple[float, float], ...]
Previous = tuple[FloatArray, Maxima]
"""A design and the maxima at it."""


class Cases:
    """Responses of a problem for all parameter sets of a ``sweep``, each in its ``bands`` [Hz].

    Designed parameters that are swept as well keep their proportions to the nominal ones.
    ``surveys`` and ``follows`` count surveyed and followed responses.
    """

    def __init__(
        self,
        problem: HarmonicBalance,
        sweep: Sweep,
        variables: DesignVariables,
        bands: Sequence[Bands],
        executor: Executor | None = None,
        progress: bool = False,
    ):
        self.size = sweep.size
        self.surveys = self.follows = 0
        self.problem = problem
        self._arguments = problem, sweep, variables, bands
        self._bar = progress_bar("response", progress)
        self._work = _Work(problem, sweep, variables, tuple(bands))
        self._workers = Workers(executor, "responses")
        self._payload = pickle.dumps((problem, sweep, variables, tuple(bands))) if executor else b""

    def with_variables(self, variables: DesignVariables) -> "Cases":
        """The same parameter sets over other variables."""
        problem, sweep, _, bands = self._arguments
        return Cases(
            problem, sweep, variables, bands, self._workers.executor, not self._bar.disable
        )

    def with_sweep(self, sweep: Sweep, bands: Sequence[Bands]) -> "Cases":
        """Other parameter sets over the same variables."""
        problem, _, variables, _ = self._arguments
        return Cases(
            problem, sweep, variables, bands, self._workers.executor, not self._bar.disable
        )

    @property
    def unique(self) -> bool:
        """Whether all have one response at every frequency, at any design."""
        return all(self.response(number).unique for number in range(self.size))

    def response(self, number: int) -> Response:
        """The response of one case, in this process."""
        return self._work.response(number)

    def __call__(
        self, x: FloatArray, previous: tuple[FloatArray, list[Maxima]] | None = None
    ) -> list[Maxima]:
        """Maxima of all cases at a design: surveyed, or followed from a ``previous`` design."""
        before: list[Previous | None] = [None] * self.size
        if previous is not None:
            before = [(previous[0], state) for state in previous[1]]
        calls = [(number, x, state) for number, state in enumerate(before)]
        if self.size == 1:
            maxima = [self._work(*calls[0])]
        else:
            maxima = list(self._workers.map(partial(_remote, self._payload), self._work, calls))
        surveyed = sum(state.surveyed for state in maxima)
        self.surveys += surveyed
        self.follows += len(maxima) - surveyed
        self._bar.update(len(maxima))
        return maxima


class _Work:
    """All cases in one process; those of one structure share compiled functions."""

    def __init__(
        self,
        problem: HarmonicBalance,
        sweep: Sweep,
        variables: DesignVariables,
        bands: tuple[Bands, ...],
    ):
        self.problem = problem
        self._arguments = problem, sweep, variables, bands
        self._responses: dict[int, Response] = {}
        self._compiled: dict[int, SecondOrder] = {}

    def response(self, number: int) -> Response:
        if number not in self._responses:
            problem, sweep, variables, bands = self._arguments
            chosen = sweep.chosen(number)
            own_variables = variables.proportional(problem, chosen)
            case = problem.with_parameters(**chosen)
            self._responses[number] = Response(case, own_variables, bands[number], self._compiled)
        return self._responses[number]

    def __call__(self, number: int, x: FloatArray, previous: Previous | None) -> Maxima:
        response = self.response(number)
        followed = None if previous is None else response.follow(x, *previous)
        return response.survey(x) if followed is None else followed


def _remote(payload: bytes, number: int, x: FloatArray, previous: Previous | None) -> Maxima:
    return _unpacked(payload, threading.get_ident())(number, x, previous)


@lru_cache(maxsize=8)
def _unpacked(payload: bytes, thread: int) -> _Work:
    return _Work(*pickle.loads(payload))
