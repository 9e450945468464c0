"""Confidence of statistics of a number of samples, mostly without an assumed distribution.

The samples are assumed to be independent. Intervals of a likelihood are of its profile: the values
that it does not make much less likely.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy import optimize, stats

from symhbm.ensembles.statistics.population import (
    BOUND,
    Values,
    check_confidence,
    check_probabilities,
    meant,
    numbers,
)
from symhbm.numerics import FloatArray, check

_LARGEST = "largest_amplification_of_peaks"


def convergence(
    values: Values,
    sizes: ArrayLike | None = None,
    quantiles: Sequence[float] = (0.05, 0.5, 0.95),
    *,
    confidence: float = 0.95,
    of: str = _LARGEST,
) -> xr.Dataset:
    """Mean, standard deviation, quantiles and maximum over growing numbers of samples.

    Parameters
    ----------
    values : (n_samples,)
        One number per sample, NaN where it failed, or a dataset whose variable ``of`` they are.
    sizes : (n,), ascending
        Numbers of samples, 2 or more; by default 10, 20, 50, 100 and so on, and all.
    quantiles
        Probabilities between 0 and 1.
    confidence
        Of the intervals.
    of
        The variable of a dataset.

    Returns
    -------
    Dataset along ``n_samples``: ``mean_value`` with an interval of Student's distribution and
    ``standard_deviation`` with one from the fourth moment, for many samples both, and the
    ``..._standard_error`` of each; ``quantile_value`` (n_samples, quantile) with an interval of
    order statistics, which holds for any distribution and is infinite where samples are too few;
    ``maximum`` with ``share_below_maximum``: at this confidence, at least that share of the whole
    population lies below it.

    Raises
    ------
    TypeError, ValueError, KeyError
        For bad arguments.

    Examples
    --------
    >>> import numpy as np
    >>> import symhbm as sh
    >>> values = np.random.default_rng(1).normal(2.0, 0.3, 200)
    >>> mean = sh.statistics.convergence(values, sizes=[50, 200])
    >>> mean.mean_value.values.round(2), mean.maximum.values.round(2)
    (array([1.99, 1.98]), array([2.64, 2.86]))
    """
    data = numbers(values, of)
    n = data.values.size
    probabilities = check_probabilities("quantiles", quantiles)
    confidence = check_confidence(confidence)
    if sizes is None:
        steps = [digit * 10**power for power in range(1, 16) for digit in (1, 2, 5)]
        sizes = [*(size for size in steps if size < n), n]
    chosen = np.atleast_1d(check.array("sizes", sizes, "positive"))
    whole = np.all(chosen == np.round(chosen)) and np.all(np.diff(chosen) > 0)
    if chosen.ndim != 1 or chosen.size == 0 or not whole or chosen[0] < 2 or chosen[-1] > n:
        raise ValueError(
            f"sizes={check.shown(sizes)}: expected ascending integers from 2 to the {n} samples "
            "that did not fail"
        )
    rows = [_summary(data.values[: int(k)], probabilities, confidence) for k in chosen]
    dims = {
        "quantile_value": ("quantile",),
        "quantile_interval": ("quantile", "bound"),
        "mean_interval": ("bound",),
        "standard_deviation_interval": ("bound",),
    }
    variables = {}
    for name in rows[0]:
        units = "1" if name == "share_below_maximum" else data.units
        attributes = meant(f"{name.replace('_', ' ')} of the {data.meaning}", units)
        values_by_size = np.array([row[name] for row in rows])
        variables[name] = (("n_samples", *dims.get(name, ())), values_by_size, attributes)
    n_samples = "n_samples", chosen.astype(np.int64), meant("number of samples")
    shares = "quantile", probabilities, meant("share of the samples below")
    coordinates = {"n_samples": n_samples, "quantile": shares, "bound": BOUND}
    result = xr.Dataset(variables, coordinates, {"confidence": confidence})
    return data.labelled(result, "Convergence of statistics with the number of samples")


def _summary(values: FloatArray, probabilities: FloatArray, confidence: float) -> dict:
    n, tail = values.size, (1 - confidence) / 2
    mean, deviation = values.mean(), values.std(ddof=1)
    error = deviation / np.sqrt(n)
    # The variance of the variance follows from the fourth moment, and from it the error of the
    # standard deviation.
    moment = np.mean((values - mean) ** 4)
    variance = max((moment - deviation**4 * (n - 3) / (n - 1)) / n, 0.0)
    spread = np.sqrt(variance) / (2 * deviation) if deviation > 0 else 0.0
    ordered = np.concatenate([[-np.inf], np.sort(values), [np.inf]])
    low = stats.binom.ppf(tail, n, probabilities).astype(int)
    high = stats.binom.ppf(1 - tail, n, probabilities).astype(int) + 1
    ends = np.array([-1.0, 1.0])
    return dict(
        mean_value=mean,
        mean_standard_error=error,
        mean_interval=mean + ends * error * stats.t.ppf(1 - tail, n - 1),
        standard_deviation=deviation,
        standard_deviation_standard_error=spread,
        standard_deviation_interval=deviation + ends * spread * stats.norm.ppf(1 - tail),
        quantile_value=np.quantile(values, probabilities),
        quantile_interval=np.stack([ordered[low], ordered[high]], axis=-1),
        maximum=values.max(),
        share_below_maximum=(1 - confidence) ** (1 / n),
    )


def samples_needed(
    values: Values,
    relative: float = 0.01,
    quantile: float | None = None,
    *,
    confidence: float = 0.95,
    of: str = _LARGEST,
) -> int:
    """How many samples, about, tell the mean or a quantile to a relative error.

    Parameters
    ----------
    values : (n_samples,)
        One number per sample of a first ensemble, NaN where it failed, or a dataset whose variable
        ``of`` they are.
    relative
        Half the width of the interval over the value, 0.01 for 1 %.
    quantile
        The probability of a quantile; by default the mean is meant.
    confidence
        Of the interval.
    of
        The variable of a dataset.

    Returns
    -------
    The number of samples. Intervals shrink with the root of it: that of these samples is scaled.

    Raises
    ------
    TypeError, ValueError, KeyError
        For bad arguments, a mean of 0, and too few samples for the interval of a quantile.

    Examples
    --------
    >>> import numpy as np
    >>> import symhbm as sh
    >>> values = np.random.default_rng(1).normal(2.0, 0.3, 200)
    >>> sh.statistics.samples_needed(values, 0.01)
    769
    """
    data = numbers(values, of)
    relative = check.scalar("relative", relative, "positive")
    share = check_probabilities("quantile", [0.5 if quantile is None else quantile])
    known = _summary(data.values, share, check_confidence(confidence))
    name = "mean" if quantile is None else "quantile"
    value = np.ravel(known[f"{name}_value"])[0]
    low, high = np.ravel(known[f"{name}_interval"])
    if not np.isfinite([low, high]).all() or value == 0 or data.values.size < 2:
        raise ValueError(
            f"values: expected more of them for the interval of the {name} of {data.values.size}; "
            "a quantile= nearer to 0.5 or a lower confidence= needs fewer"
        )
    width = (high - low) / 2 / abs(value)
    return max(2, int(np.ceil(data.values.size * (width / relative) ** 2)))


def position(
    values: Values,
    value: float,
    n: int = 25,
    *,
    quantiles: Sequence[float] = (0.05, 0.5, 0.95),
    confidence: float = 0.95,
    of: str = _LARGEST,
) -> xr.Dataset:
    """Where a value lies in the distribution of the worst of ``n`` samples.

    Parameters
    ----------
    values : (n_samples,)
        One number per sample, NaN where it failed, or a dataset whose variable ``of`` they are.
    value
        The value to place, for example a published one.
    n
        Number of samples whose largest is meant.
    quantiles
        Probabilities of the worst of ``n`` that are wanted as well.
    confidence
        Of the interval.
    of
        The variable of a dataset.

    Returns
    -------
    Dataset with ``share_below``, the share of samples below the value, ``probability`` that the
    worst of ``n`` independent samples is below it, the power ``n`` of that share, both with their
    exact (Clopper-Pearson) intervals, and ``worst_quantile`` (quantile), the quantiles of the worst
    of ``n``, infinite where there are too few samples for them.

    Raises
    ------
    TypeError, ValueError, KeyError
        For bad arguments.

    Examples
    --------
    >>> import numpy as np
    >>> import symhbm as sh
    >>> values = np.random.default_rng(1).normal(2.0, 0.3, 1000)
    >>> place = sh.statistics.position(values, 2.5, n=25)
    >>> place.share_below.item(), round(place.probability.item(), 3)
    (0.953, 0.3)
    """
    data = numbers(values, of)
    value = check.scalar("value", value)
    n = check.integer("n", n, minimum=1)
    probabilities = check_probabilities("quantiles", quantiles)
    confidence = check_confidence(confidence)
    size = data.values.size
    below = int(np.sum(data.values < value))
    share = below / size
    test = stats.binomtest(below, size)
    interval = np.array(test.proportion_ci(confidence, method="exact"))
    ordered = np.append(np.sort(data.values), np.inf)
    rank = np.ceil(probabilities ** (1 / n) * (size + 1)).astype(int) - 1
    of_share = meant(f"share of samples below {value:g}")
    of_worst = meant(f"probability that the worst of {n} is below {value:g}")
    of_quantile = meant(f"probability of the worst of {n}")
    of_value = meant(f"quantile of the worst of {n}", data.units)
    result = xr.Dataset(
        {
            "share_below": ((), share, of_share),
            "share_below_interval": ("bound", interval, of_share),
            "probability": ((), share**n, of_worst),
            "probability_interval": ("bound", interval**n, of_worst),
            "worst_quantile": ("quantile", ordered[np.minimum(rank, size)], of_value),
        },
        {"bound": BOUND, "quantile": ("quantile", probabilities, of_quantile)},
        {"confidence": confidence, "value": value, "worst_of": n},
    )
    return data.labelled(result, f"Position of a value in the distribution of the worst of {n}")


_LIKELIHOOD = 1e-5
"""Digits of the largest likelihood at one value: far below the drop that ends an interval."""
_MOST_STEPS, _HALVINGS = 60, 10
"""Steps, each twice the last, after which an interval has no end; and halvings of the last one,
which leave a thousandth of it."""


def drop(n_values: int, n_parameters: int, confidence: float) -> float:
    """How much the logarithm of the likelihood may fall within an interval.

    As of normally distributed values, for which Student's distribution makes it exact; for many
    values it is half the quantile of chi squared.
    """
    free = n_values - n_parameters
    quantile = stats.t.ppf((1 + confidence) / 2, free)
    return n_values / 2 * float(np.log1p(quantile**2 / free))


def profile_interval(
    minus_log: Callable[[float, FloatArray], float],
    value: float,
    others: FloatArray,
    step: float,
    most: float,
) -> tuple[float, float]:
    """Ends of the values around the likeliest one whose likelihood falls by ``most`` at the most.

    ``minus_log`` is that of the likelihood, of a value and of ``others`` (n,), which are the
    likeliest at each; ``step`` is about the width. An end that is not found is infinite.
    """
    lowest = minus_log(value, others)
    options = dict(xatol=_LIKELIHOOD, fatol=_LIKELIHOOD)

    def end(sign: float) -> float:
        likeliest = others

        def inside(distance: float) -> bool:
            nonlocal likeliest
            at = value + sign * distance
            best = optimize.minimize(
                lambda rest: minus_log(at, rest), likeliest, method="Nelder-Mead", options=options
            )
            if best.fun - lowest > most:
                return False
            likeliest = best.x
            return True

        low, high = 0.0, step
        for _ in range(_MOST_STEPS):
            if not inside(high):
                break
            low, high = high, 2 * high
        else:
            return sign * np.inf
        for _ in range(_HALVINGS):
            middle = (low + high) / 2
            low, high = (middle, high) if inside(middle) else (low, middle)
        return value + sign * low

    return end(-1.0), end(1.0)
