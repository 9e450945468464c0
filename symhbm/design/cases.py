"""The cases of a design, each a parameter set with its bands, in this process or by an executor."""

import pickle
import threading
from collections.abc import Sequence
from concurrent.futures import Executor
from functools import lru_cache, partial

from symhbm.balance import HarmonicBalance, SecondOrder
from symhbm.design.pieces import Maxima, Response
from symhbm.design.space import Space
from symhbm.numerics import FloatArray
from symhbm.results import Sweep
from symhbm.workers import Workers, progress_bar

Bands = tuple[tuple[float, float], ...]
Known = tuple[FloatArray, Maxima]
"""A design and the maxima there."""


class Cases:
    """Responses of a problem for all parameter sets of a ``sweep``, each in its ``bands`` [Hz].

    Designed parameters that are swept as well keep their proportions to the nominal ones.
    ``surveys`` and ``follows`` count what was computed.
    """

    def __init__(
        self,
        problem: HarmonicBalance,
        sweep: Sweep,
        space: Space,
        bands: Sequence[Bands],
        executor: Executor | None = None,
        progress: bool = False,
    ):
        self.size = sweep.size
        self.surveys = self.follows = 0
        self._given = problem, sweep, space, bands
        self._bar = progress_bar("response", progress)
        self._work = _Work(problem, sweep, space, tuple(bands))
        self._workers = Workers(executor, "responses")
        self._payload = pickle.dumps((problem, sweep, space, tuple(bands))) if executor else b""

    def of(self, space: Space) -> "Cases":
        """The same parameter sets over another space."""
        problem, sweep, _, bands = self._given
        return Cases(problem, sweep, space, bands, self._workers.executor, not self._bar.disable)

    def others(self, sweep: Sweep, bands: Sequence[Bands]) -> "Cases":
        """Other parameter sets over the same space."""
        problem, _, space, _ = self._given
        return Cases(problem, sweep, space, bands, self._workers.executor, not self._bar.disable)

    @property
    def unique(self) -> bool:
        """Whether all have one response at every frequency, at any design."""
        return all(self.response(number).unique for number in range(self.size))

    def response(self, number: int) -> Response:
        """One of them, in this process."""
        return self._work.response(number)

    def __call__(
        self, x: FloatArray, known: tuple[FloatArray, list[Maxima]] | None = None
    ) -> list[Maxima]:
        """Maxima of all cases at a design: surveyed, or followed from what is ``known``."""
        before: list[Known | None] = [None] * self.size
        if known is not None:
            before = [(known[0], state) for state in known[1]]
        calls = [(number, x, state) for number, state in enumerate(before)]
        if self.size == 1:
            found = [self._work(*calls[0])]
        else:
            found = list(self._workers.map(partial(_remote, self._payload), self._work, calls))
        surveyed = sum(state.surveyed for state in found)
        self.surveys += surveyed
        self.follows += len(found) - surveyed
        self._bar.update(len(found))
        return found


class _Work:
    """All cases in one process; those of one structure share what is compiled."""

    def __init__(
        self, problem: HarmonicBalance, sweep: Sweep, space: Space, bands: tuple[Bands, ...]
    ):
        self._given = problem, sweep, space, bands
        self._responses: dict[int, Response] = {}
        self._compiled: dict[int, SecondOrder] = {}

    def response(self, number: int) -> Response:
        if number not in self._responses:
            problem, sweep, space, bands = self._given
            chosen = sweep.chosen(number)
            own = space.proportional(problem, chosen)
            case = problem.with_parameters(**chosen)
            self._responses[number] = Response(case, own, bands[number], self._compiled)
        return self._responses[number]

    def __call__(self, number: int, x: FloatArray, known: Known | None) -> Maxima:
        response = self.response(number)
        followed = None if known is None else response.follow(x, *known)
        return response.survey(x) if followed is None else followed


def _remote(payload: bytes, number: int, x: FloatArray, known: Known | None) -> Maxima:
    return _unpacked(payload, threading.get_ident())(number, x, known)


@lru_cache(maxsize=8)
def _unpacked(payload: bytes, thread: int) -> _Work:
    return _Work(*pickle.loads(payload))
