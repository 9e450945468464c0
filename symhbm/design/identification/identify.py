"""The verb `identify`: parameters from measured responses, and how sure they are."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Unpack

import numpy as np
import xarray as xr

from symhbm.balance import HarmonicBalance, check_mean, check_problem
from symhbm.continuation import SolveError
from symhbm.design.identification.certainty import Certainty
from symhbm.design.identification.estimate import LOSSES, descend, search
from symhbm.design.identification.objective import Objective, Point, objective_of
from symhbm.design.identification.observations import Rows
from symhbm.design.identification.report import report, sentences_of
from symhbm.design.kept import KeptDesigns, told_of
from symhbm.numerics import FloatArray, check, on_one_thread
from symhbm.results import parse, runs
from symhbm.workers import noted, progress_bar


def identify(
    problem: HarmonicBalance,
    data: xr.Dataset | Sequence[xr.Dataset],
    unknown: Any,
    *,
    start: Any = None,
    n_starts: int = 6,
    loss: str = "linear",
    confidence: float = 0.95,
    profiles: bool = True,
    predict: bool = False,
    **run: Unpack[runs.Keeping],
) -> xr.Dataset:
    """Parameters of contacts and structure from measured responses, and how sure they are.

    The sum of squared residuals over their standard deviations is made small, by least squares with
    exact Jacobians from several starts, in logarithms where an unknown is positive. Where a
    response may jump, it is followed as the test led the frequency.

    Parameters
    ----------
    problem
        What was tested, with its known parameters; those that are looked for start from its values.
    data
        Measurements of `symhbm.datasets.measured`, or several of them in a list.
    unknown
        Names of parameters, or a mapping from them: to bounds ``(low, high)``, None for a factor of
        1000 either way, a function of the parameters that makes it of others, as
        ``lambda p: 2 * p["normal_load"]``, or a mapping with some of ``bounds``; ``value``, where
        to start; ``vary`` (``"common"``, ``"each"`` or a pattern, as in `symhbm.minimise_peak`);
        ``prior``, a mean and a standard deviation known before, or ``log_prior``, a mean and the
        standard deviation of the logarithm; ``logarithm=False`` for a positive one that may be
        close to 0. ``"normal_load[2]"`` is that of one contact; ``"gain[tip]"``, ``"phase[tip]"``
        [rad] and ``"delay[tip]"`` [s] are of the sensor at a place.
    start
        A result of this function, or values by name, to start from: an interrupted fit tells them.
    n_starts
        Number of starts; those after the first are taken where they fit best among twelve times as
        many (four where responses may jump), and only as long as the residuals are more than
        noise.
    loss
        ``"linear"`` for least squares, or ``"soft_l1"``, ``"huber"``, ``"cauchy"`` or ``"arctan"``
        as of ``scipy.optimize.least_squares``, to which far points count less.
    confidence
        Probability that an interval holds the true value.
    profiles
        Whether intervals by profile likelihood are computed: all others are fitted along each.
    predict
        Whether each curve is also predicted from all the others: ``curve_predicted``.
    **run
        ``archive``, ``throw`` (where the fit is not good) and ``progress``, as `symhbm.Run` tells.
        A working file beside the archive has where each descent is: the same call goes on there.

    Returns
    -------
    Dataset as that of `symhbm.frf` with the estimates, under all settings of the test;
    `symhbm.datasets.rebuild` gives the problem with them. Along ``unknown`` it has ``estimate``,
    ``standard_error`` (by the Jacobian), ``exact_standard_error`` (by the Hessian), ``interval``
    and ``profile_interval``; along ``direction`` ``singular_value`` and ``seen_direction``, what
    the measurements see; along ``measurement`` the data with ``computed_value`` and
    ``measured_residual``; along ``curve`` what is left of each. ``status`` and
    ``certificate`` say it in words, first of all which unknowns are not seen.

    Raises
    ------
    TypeError, ValueError, KeyError
        For bad arguments, each named with its value and what is allowed.
    SolveError
        If no start has a response; and with ``throw`` where the fit is not good, its ``result`` is
        the dataset.
    ArchiveError
        If the archive, or its working file, is of another computation or cannot be written.
    KeyboardInterrupt
        If it is interrupted; a note tells the best values so far, or the file that has them.

    Warns
    -----
    RuntimeWarning
        If no optimum was found, unknowns are not seen, or residuals are larger than the noise.

    Examples
    --------
    A blade at two levels of the force, without noise, from a load and a stiffness that are wrong:

    >>> import numpy as np
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    >>> frequency = np.linspace(14, 24, 11)
    >>> response = sh.frf(problem, (14, 24), frequency, over={"force_amplitude": [1, 2]})
    >>> a, b = response.coefficient.sel(dof=0, harmonic=1).transpose("component", ...).values
    >>> data = sh.datasets.measured(
    ...     frequency, a - 1j * b, units="m", deviation=1e-6, force_amplitude=[[1], [2]],
    ... )
    >>> wrong = problem.with_parameters(normal_load=8, contact_stiffness=4e3)
    >>> fit = sh.identify(wrong, data, ["normal_load", "contact_stiffness"])
    >>> fit.estimate.values.round(6)
    array([3.e+00, 1.e+04])
    """
    check_problem(problem, bends=True)
    if problem.samples is not None:
        raise ValueError(
            f"problem: expected located switching angles, got friction over {problem.samples} "
            "samples, which has no second derivatives"
        )
    check_mean(problem)
    rows = Rows.of(data)
    running = runs.Running.of(run, runs.Keeping)
    check.one_of("loss", loss, LOSSES)
    n_starts = check.integer("n_starts", n_starts, minimum=1)
    if not 0 < check.scalar("confidence", confidence) < 1:
        raise ValueError(f"confidence={confidence}: expected a probability between 0 and 1")
    profiles, predict = check.flag("profiles", profiles), check.flag("predict", predict)
    objective = objective_of(problem, rows, unknown, start)
    asked = n_starts, loss, confidence, profiles, predict
    kept = KeptDesigns.of(running.archive, _call_of(problem, objective, asked))
    result = kept.complete
    if result is None:
        words = objective.best_words if running.archive is None else kept.kept
        with progress_bar("evaluation", running.progress) as bar, noted(words):
            good, result = _result(problem, objective, *asked, bar, kept)
            result = kept.finished(result.assign_attrs(identification_good=int(good)))
    if not result.attrs["identification_good"]:
        status = str(result["status"].item())
        if running.throw:
            raise SolveError(status, result)
        check.warn(status, RuntimeWarning)
    return result


def _call_of(problem: HarmonicBalance, objective: Objective, asked: Sequence[Any]) -> str:
    """Digest of all that a fit depends on."""
    unknowns, rows = objective.unknowns, objective.rows
    told = [told_of(problem, parse(problem, None)), unknowns.each, unknowns.text, asked]
    told += [(name, column.tolist()) for name, column in rows.table.items()]
    return hashlib.sha256(repr(told).encode()).hexdigest()


@on_one_thread
def _result(
    problem: HarmonicBalance,
    objective: Objective,
    n_starts: int,
    loss: str,
    confidence: float,
    profiles: bool,
    predict: bool,
    bar: Any,
    kept: KeptDesigns,
) -> tuple[bool, xr.Dataset]:
    """Whether the fit is good, and all that is said of it."""
    descents = search(objective, n_starts, loss, bar.update, kept)
    best = descents[0]
    if best.point is None:
        raise SolveError(f"no start has a response: {best.failed}; try other values")
    certainty = Certainty(best.point, loss, confidence)
    ends, notes = np.full((len(best.point.x), 2), np.nan), list[str]()
    if profiles:
        ends, notes = certainty.profiles(bar.update)
    predicted = _predicted(best.point, loss, bar) if predict else None
    good, sentences = sentences_of(certainty, best, descents, notes)
    result = report(problem, objective.rows, certainty, ends, descents, sentences, predicted)
    return good, result


def _predicted(point: Point, loss: str, bar: Any) -> FloatArray:
    """Mean square of the residuals of each curve by a fit to all others, NaN without others."""
    objective = point.objective
    found = np.full(len(objective.curves), np.nan)
    for number, curve in enumerate(objective.curves):
        own = np.concatenate(curve.rows)
        own = own[objective.rows.kept[own]]
        left_out = np.array(objective.rows.left_out)
        left_out[own] = 1
        rows = Rows(objective.rows.table | {"measured_left_out": left_out}, objective.rows.known)
        if rows.kept.sum() < len(point.x):
            continue
        others = replace(objective, rows=rows, _near=None, _last=None)
        others.remember(Point(others, point.x, point.solved))
        fitted = descend(others, point.x, loss, tick=bar.update).point
        if fitted is not None and len(own):
            found[number] = float(np.mean(fitted.all_residuals[own] ** 2))
    return found
