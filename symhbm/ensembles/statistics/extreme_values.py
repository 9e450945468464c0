"""Extreme value distributions of block maxima: intervals, return levels and goodness of fit."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
import xarray as xr
from scipy import optimize
from scipy.special import gamma

from symhbm.continuation import Status
from symhbm.ensembles.statistics.confidence import drop, profile_interval
from symhbm.ensembles.statistics.population import (
    BOUND,
    Values,
    check_confidence,
    check_probabilities,
    meant,
    numbers,
)
from symhbm.numerics import FloatArray, check

FEWEST_BLOCKS = 10
"""Fewest block maxima that a distribution is fitted to."""
_LOWEST_SHAPE = -0.99
"""At -1 the likelihood has no bound: the upper end of the distribution is on the largest value."""
_COARSE = 1e-4
"""Tolerance of refits over the width of the maxima: far below their spread."""
_GUMBEL = 1e-9
"""Absolute shape below which the distribution is Gumbel's, to round-off."""
_OFF = 1e3
"""Far more than any drop of a likelihood: off its support it leads back there."""
_ASTRAY = 1e300
"""What is no number, as a search compares it."""
_MOST_LOST = 0.05
"""Share of refits that may fail; above it, the goodness of fit would be biased."""

Distribution = Literal["gev", "gumbel"]


def extreme_value_fit(
    values: Values,
    block: int = 25,
    distribution: Distribution = "gev",
    *,
    levels: Sequence[float] = (0.5, 0.9, 0.99, 0.999),
    confidence: float = 0.95,
    n_bootstrap: int = 500,
    seed: int = 0,
    of: str = "largest_amplification_of_peaks",
) -> xr.Dataset:
    """Fit an extreme value distribution to the maxima of blocks, by the largest likelihood.

    Parameters
    ----------
    values : (n_samples,)
        One number per sample, NaN where it failed, or a dataset whose variable ``of`` they are.
    block
        Number of consecutive samples whose maximum is one value.
    distribution
        ``P(max <= x) = exp(-(1 + shape (x - location) / scale)**(-1 / shape))``, the generalised
        one (a negative shape is the Weibull distribution of maxima, with an upper bound), or
        Gumbel's with the shape 0.
    levels
        Probabilities of the return levels: the value that the worst of a block stays below.
    confidence
        Of the intervals.
    n_bootstrap
        Repetitions, drawn from the fit and fitted anew, for the goodness of fit.
    seed
        Of the repetitions.
    of
        The variable of a dataset.

    Returns
    -------
    Dataset with ``status``, and NaN where the fit or its repetitions failed; ``location``,
    ``scale``, ``shape``, ``upper_bound`` (infinite unless the shape is negative), ``return_level``
    (level) and the ``..._interval`` of each; ``block_maximum``; the Kolmogorov-Smirnov and
    Anderson-Darling statistics with the probability of a larger one if the fit were true
    (``..._p_value``); ``n_blocks``, ``n_unused`` (the rest of the last block) and
    ``n_refits_failed``.

    Warns
    -----
    UserWarning
        Where there is NaN, with the reason and the argument that may help.

    Raises
    ------
    TypeError, ValueError, KeyError
        For bad arguments.

    Examples
    --------
    >>> import numpy as np
    >>> import symhbm as sh
    >>> values = np.random.default_rng(1).normal(2.0, 0.3, 500)
    >>> fit = sh.statistics.extreme_value_fit(values, block=25, n_bootstrap=100, seed=1)
    >>> fit.n_blocks.item(), fit.location.values.round(1)
    (20, np.float64(2.5))
    """
    data = numbers(values, of)
    block = check.integer("block", block, minimum=1)
    check.one_of("distribution", distribution, ("gev", "gumbel"))
    probabilities = check_probabilities("levels", levels)
    confidence = check_confidence(confidence)
    n_bootstrap = check.integer("n_bootstrap", n_bootstrap, minimum=100)
    rng = np.random.default_rng(check.integer("seed", seed, minimum=0))
    n_blocks = data.values.size // block
    maxima = data.values[: n_blocks * block].reshape(n_blocks, block).max(axis=1)

    status, fit = _fit(maxima, distribution)
    fitted = _figures(fit, probabilities)
    tests = p_values = dict(kolmogorov_smirnov=np.nan, anderson_darling=np.nan)
    intervals = {name: np.full((*np.shape(value), 2), np.nan) for name, value in fitted.items()}
    n_failed = 0
    if fit is not None:
        intervals = _intervals(maxima, fit, distribution, probabilities, confidence)
        tests = _distances(maxima, fit)
        draws = _quantile(fit, rng.random((n_bootstrap, n_blocks)))
        fits = [(draw, _fit(draw, distribution, _COARSE)[1]) for draw in draws]
        successful = [(draw, refit) for draw, refit in fits if refit is not None]
        n_failed = n_bootstrap - len(successful)
        if n_failed > _MOST_LOST * n_bootstrap:
            status = f"{n_failed} of {n_bootstrap} repetitions of the fit failed; try more samples"
        else:
            refits = [_distances(draw, refit) for draw, refit in successful]
            p_values = {
                name: (1 + sum(refit[name] >= value for refit in refits)) / (1 + len(refits))
                for name, value in tests.items()
            }
    if status != str(Status.SUCCESS):
        check.warn(f"extreme_value_fit: NaN, {status}")
    result = _label(
        dict(
            status=np.array(status, dtype=object),
            **fitted,
            **{f"{name}_interval": value for name, value in intervals.items()},
            **tests,
            **{f"{name}_p_value": value for name, value in p_values.items()},
            block_maximum=maxima,
            n_blocks=n_blocks,
            n_unused=data.values.size - n_blocks * block,
            n_refits_failed=n_failed,
        ),
        probabilities,
        data.units,
    )
    settings = dict(block=block, confidence=confidence, n_bootstrap=n_bootstrap, seed=seed)
    result = result.assign_attrs(distribution=distribution, **settings)
    return data.labelled(result, "Extreme value distribution of block maxima")


def _fit(
    maxima: FloatArray, distribution: str, tolerance: float = 1e-8
) -> tuple[str, FloatArray | None]:
    """Status, and location, scale and shape of the largest likelihood, None without one."""
    if maxima.size < FEWEST_BLOCKS:
        return (
            f"too few samples: {maxima.size} blocks, at least {FEWEST_BLOCKS} are needed; try more "
            "samples or a smaller block="
        ), None
    centre, width = maxima.mean(), maxima.std()
    if not width > 1e-12 * abs(centre):
        return (
            "the block maxima are all alike: no distribution can be fitted; try a smaller block="
        ), None
    scaled = (maxima - centre) / width
    start = _by_moments(scaled, distribution)
    options = dict(xatol=tolerance, fatol=tolerance, maxiter=2000)
    best = optimize.minimize(
        _minus_log_likelihood, start, (scaled,), method="Nelder-Mead", options=options
    )
    if not best.success or not np.isfinite(best.fun):
        return f"the largest likelihood was not found: {best.message}", None
    shape = best.x[2] if distribution == "gev" else 0.0
    if shape <= _LOWEST_SHAPE:
        return (
            "the likelihood has no maximum (the shape goes to -1): the largest values pile up at "
            "an upper bound; try a larger block="
        ), None
    scale = np.exp(best.x[1])
    return str(Status.SUCCESS), np.array([centre + width * best.x[0], width * scale, shape])


def _by_moments(values: FloatArray, distribution: str) -> FloatArray:
    """Location, logarithm of the scale and shape by probability-weighted moments."""
    n, ordered = values.size, np.sort(values)
    rank = np.arange(n)
    first = ordered.mean()
    second = 2 * np.mean(rank / (n - 1) * ordered) - first
    if distribution == "gumbel":
        scale = second / np.log(2)
        return np.array([first - np.euler_gamma * scale, np.log(scale)])
    weight = rank * (rank - 1) / ((n - 1) * (n - 2))
    third = 6 * np.mean(weight * ordered) - 3 * second - 2 * first
    ratio = 2 / (3 + third / second) - np.log(2) / np.log(3)
    k = 7.859 * ratio + 2.9554 * ratio**2
    k = np.copysign(np.clip(abs(k), 1e-3, 0.4), k)
    scale = second * k / ((1 - 2.0**-k) * gamma(1 + k))
    start = np.array([first - scale * (1 - gamma(1 + k)) / k, np.log(scale), -k])
    # The likelihood is infinite where the support of the start misses a value: widen it.
    while not np.isfinite(_minus_log_likelihood(start, values)):
        start[1] += 0.1
    return start


def _minus_log_likelihood(parameters: FloatArray, values: FloatArray) -> float:
    location, log_scale = parameters[:2]
    shape = parameters[2] if len(parameters) == 3 else 0.0
    fit = np.array([location, np.exp(log_scale), shape])
    if shape < -1:
        return np.inf
    t = _reduced(fit, values)
    if t is None:
        return np.inf
    with np.errstate(over="ignore"):
        return float(values.size * log_scale + (1 + shape) * t.sum() + np.exp(-t).sum())


def _reduced(fit: FloatArray, values: FloatArray) -> FloatArray | None:
    """Gumbel's variable ``t``, ``P(max <= x) = exp(-exp(-t))``; None off the support."""
    location, scale, shape = fit
    z = (values - location) / scale
    if abs(shape) < _GUMBEL:
        return z
    inside = shape * z
    return None if inside.min() <= -1 else np.log1p(inside) / shape


def _quantile(fit: FloatArray, probability: FloatArray) -> FloatArray:
    location, scale, shape = fit
    t = -np.log(-np.log(probability))
    return location + scale * (t if abs(shape) < _GUMBEL else np.expm1(shape * t) / shape)


def _figures(fit: FloatArray | None, probabilities: FloatArray) -> dict[str, FloatArray]:
    """Parameters, upper bound and return levels."""
    location, scale, shape = np.full(3, np.nan) if fit is None else fit
    bound = np.inf if shape >= 0 else location - scale / shape
    levels = _quantile(np.array([location, scale, shape]), probabilities)
    parameters = dict(location=location, scale=scale, shape=shape, upper_bound=bound)
    return {k: np.array(v) for k, v in parameters.items()} | {"return_level": levels}


def _intervals(
    maxima: FloatArray,
    fit: FloatArray,
    distribution: str,
    probabilities: FloatArray,
    confidence: float,
) -> dict[str, FloatArray]:
    """Intervals of all figures by the profile of the likelihood, (.., 2).

    Each figure takes the place of one parameter. That of the bound is one over its distance from
    the largest maximum, which goes on through 0 where there is no bound.
    """
    centre, width = maxima.mean(), maxima.std()
    scaled = (maxima - centre) / width
    location, scale, shape = (fit[0] - centre) / width, fit[1] / width, fit[2]
    largest = scaled.max()
    start = np.array([location, np.log(scale), shape])[: 3 if distribution == "gev" else 2]
    most = drop(maxima.size, start.size, confidence)

    def within(value: float, others: FloatArray, step: float, parameters: Any) -> FloatArray:
        def minus_log(value: float, others: FloatArray) -> float:
            # Where no parameters have the value, a search for the likeliest goes astray.
            with np.errstate(all="ignore"):
                fit = np.array(parameters(value, others))
                shape = fit[2] if fit.size == 3 else 0.0
                room = 1 + shape * (scaled - fit[0]) / np.exp(fit[1])
                beyond = max(-room.min(), -1 - shape)
                found = _minus_log_likelihood(fit, scaled) if beyond < 0 else _OFF * (1 + beyond)
            return float(np.nan_to_num(found, nan=_ASTRAY, posinf=_ASTRAY))

        return np.array(profile_interval(minus_log, value, others, step, most))

    def of_level(probability: FloatArray) -> Any:
        def parameters(value: float, others: FloatArray) -> list[float]:
            reduced = np.array([0.0, 1.0, *(others[1:] if others.size > 1 else [0.0])])
            below = np.exp(others[0]) * float(_quantile(reduced, probability))
            return [value - below, *others]

        return parameters

    def of_bound(value: float, others: FloatArray) -> list[float]:
        share = 1 + value * (largest - others[0])
        # Beyond, no shape has that bound: one off the support leads back.
        return [*others, -np.exp(others[1]) * value / share if share > 0 else share - 2]

    step = 1 / np.sqrt(maxima.size)
    levels = _quantile(np.array([location, scale, shape]), probabilities)
    of_levels = [
        within(level, start[1:], step, of_level(share))
        for level, share in zip(levels, probabilities, strict=True)
    ]
    of_scale = within(start[1], np.delete(start, 1), step, lambda v, o: [o[0], v, *o[1:]])
    of_shape, bound = np.zeros(2), np.full(2, np.inf)
    if distribution == "gev":
        of_shape = within(shape, start[:2], step, lambda v, o: [*o, v])
        inverse = -shape / (scale - shape * (location - largest))
        ends = within(inverse, start[:2], step, of_bound)[::-1]
        bound[ends > 0] = largest + 1 / ends[ends > 0]
    return {
        "location": centre + width * within(location, start[1:], step, lambda v, o: [v, *o]),
        "scale": width * np.exp(of_scale),
        "shape": of_shape,
        "upper_bound": centre + width * bound,
        "return_level": centre + width * np.array(of_levels),
    }


def _distances(maxima: FloatArray, fit: FloatArray) -> dict[str, float]:
    """Kolmogorov-Smirnov and Anderson-Darling distances between maxima and a distribution."""
    n, reduced = maxima.size, _reduced(fit, np.sort(maxima))
    assert reduced is not None
    logarithm, rank = -np.exp(-reduced), np.arange(1, n + 1)
    below = np.exp(logarithm)
    gap = np.maximum(rank / n - below, below - (rank - 1) / n).max()
    logs = logarithm + np.log(-np.expm1(logarithm))[::-1]
    square = -n - np.mean((2 * rank - 1) * logs)
    return dict(kolmogorov_smirnov=float(gap), anderson_darling=float(square))


def _label(values: dict, probabilities: FloatArray, units: str) -> xr.Dataset:
    with_units = ("location", "scale", "upper_bound", "return_level", "block_maximum")
    variables = {}
    for name, value in values.items():
        dims = ("level",) if name.startswith("return_level") else ()
        dims = ("block",) if name == "block_maximum" else dims
        dims += ("bound",) if name.endswith("_interval") else ()
        unit = units if name.removesuffix("_interval") in with_units else "1"
        variables[name] = (dims, value, meant(name.replace("_", " "), unit))
    attributes = meant("probability that a block maximum stays below")
    return xr.Dataset(variables, {"level": ("level", probabilities, attributes), "bound": BOUND})
