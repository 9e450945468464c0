"""Surveys of all maxima at many parameter values, in this process or by an executor."""

import warnings
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from dataclasses import replace

from tqdm import tqdm

from symhbm.landscape import Landscape, survey
from symhbm.residual import HarmonicBalance
from symhbm.status import Status

_BAR_DELAY = 2.0
"""Seconds before a progress bar appears."""

Bands = Sequence[tuple[float, float]]


class Surveyor:
    """Surveys ``bands`` [Hz] of problems; ``count`` tells how many it made.

    What an ``executor`` does not compute, as workers die or it is closed, is computed in this
    process. A survey that fails is empty, and its status says so.
    """

    def __init__(self, bands: Bands, executor: Executor | None, progress: bool):
        self.bands, self._executor, self.count = list(bands), executor, 0
        self._bar = tqdm(unit="survey", delay=_BAR_DELAY, disable=not progress, leave=False)

    def __enter__(self) -> "Surveyor":
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.close()

    def survey(
        self, problem: Callable[[float], HarmonicBalance], values: Iterable[float]
    ) -> list[Landscape]:
        """All maxima at some values of a parameter, ``problem`` giving that at each."""
        problems = [problem(value) for value in values]
        pending = [self._submitted(one) for one in problems]
        return [self._result(*pair) for pair in zip(problems, pending, strict=True)]

    def _submitted(self, problem: HarmonicBalance) -> Future[Landscape] | None:
        if self._executor is None:
            return None
        try:
            return self._executor.submit(_work, problem, self.bands)
        except Exception as error:
            self._give_up(error)
            return None

    def _result(self, problem: HarmonicBalance, pending: Future[Landscape] | None) -> Landscape:
        self.count += 1
        found = None
        if pending is not None:
            try:
                found = pending.result()
            except (Exception, CancelledError) as error:
                self._give_up(error)
        if found is None:
            found = _survey(problem, self.bands)
        self._bar.update()
        # Those of a worker come with equations of their own.
        summits = [replace(summit, problem=problem) for summit in found.summits]
        return replace(found, summits=summits)

    def _give_up(self, error: BaseException) -> None:
        """Go on in this process, and say so once."""
        if self._executor is None:
            return
        self._executor = None
        what = "a worker died" if isinstance(error, BrokenExecutor) else "the executor failed"
        warnings.warn(
            f"{what} ({' '.join([type(error).__name__, *map(str, error.args)])}); the surveys that "
            "the executor does not compute are computed in this process",
            RuntimeWarning,
            stacklevel=2,
        )


def _survey(problem: HarmonicBalance, bands: Bands) -> Landscape:
    try:
        return survey(problem, bands)
    except ArithmeticError:
        return Landscape([], [], Status.COMPUTATION_FAILED)


def _work(problem: HarmonicBalance, bands: Bands) -> Landscape:
    found = _survey(problem, bands)
    bare = [replace(summit, problem=None) for summit in found.summits]  # type: ignore[arg-type]
    return replace(found, summits=bare)
