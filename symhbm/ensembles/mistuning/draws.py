"""Random draws of parameters around their nominal values."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib.metadata import version
from typing import Any, Literal, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy.special import ndtr, ndtri

from symhbm.balance import HarmonicBalance
from symhbm.ensembles.mistuning.copula import Copula, unit_samples
from symhbm.ensembles.mistuning.samples import DRAWABLE, labelled_samples, nominal_values
from symhbm.model import PARAMETERS, Structure
from symhbm.model.contacts import Parameter
from symhbm.numerics import FloatArray, check

Sampling = Literal["random", "sobol", "latin_hypercube"]
Correlation = ArrayLike | Mapping[str, ArrayLike] | None


class _Distribution(NamedTuple):
    """A distribution of factors of the nominal value.

    ``factor(share, spread)`` is the quantile of the factor at a probability ``share``. The lowest
    value is ``reach`` spreads below the nominal one.
    """

    name: str
    spread: str
    reach: float
    factor: Callable[[FloatArray, FloatArray], FloatArray]
    cut: float | None = None


def uniform(
    problem: Structure | HarmonicBalance,
    n_samples: int,
    *,
    seed: int,
    sampling: Sampling = "random",
    correlation: Correlation = None,
    between: Mapping[tuple[str, str], float] | None = None,
    **half_widths: ArrayLike,
) -> xr.Dataset:
    """Uniform draws around the nominal value of each blade or contact.

    Parameters
    ----------
    problem
        The structure or problem with the nominal values.
    n_samples
        Number of samples; of Sobol points, powers of 2 fill the space most evenly.
    seed
        A non-negative integer that fixes the draws.
    sampling
        Independent random samples, or points that fill the space evenly: a scrambled Sobol
        sequence, or a Latin hypercube (stratified per value; correlation undoes that).
    correlation
        Between blades or contacts, in their order around the ring: a correlation length in blades
        ``L``, by the kernel ``exp(-d / L)`` of the distance ``d`` around the ring, or a matrix
        ``(n, n)``; for all parameters, or by name. It holds for Gaussian variables of which each
        value is a monotone function (a Gaussian copula), so the distributions do not change.
    between
        Such correlations between parameters at the same blade or contact, by pairs of names, whose
        ``correlation`` is the same.
    half_widths
        Largest deviation by parameter, relative to the nominal value: one, or one per blade or
        contact.

    Returns
    -------
    Dataset of the parameters along ``sample`` and ``dof`` or ``contact``.

    Raises
    ------
    TypeError, ValueError, KeyError
        For bad arguments, and spreads that lead out of the allowed range.

    Examples
    --------
    >>> import symhbm as sh
    >>> disk = sh.bladed_disk(
    ...     13, mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e6, friction_coefficient=0.5, normal_load=10,
    ... )
    >>> draws = sh.mistuning.uniform(disk, 25, seed=1, contact_stiffness=0.2, normal_load=0.3)
    >>> dict(draws.sizes)
    {'sample': 25, 'contact': 13}
    """

    def factor(share: FloatArray, half_width: FloatArray) -> FloatArray:
        return 1 + half_width * (2 * share - 1)

    law = _Distribution("uniform", "relative half-width", 1.0, factor)
    return _draw(problem, n_samples, seed, sampling, correlation, between, law, half_widths)


def truncated_normal(
    problem: Structure | HarmonicBalance,
    n_samples: int,
    *,
    seed: int,
    cut: float = 3.0,
    sampling: Sampling = "random",
    correlation: Correlation = None,
    between: Mapping[tuple[str, str], float] | None = None,
    **standard_deviations: ArrayLike,
) -> xr.Dataset:
    """Normal draws, cut on both sides at ``cut`` standard deviations.

    ``standard_deviations`` by parameter are relative to the nominal value, and those before the
    cut. Everything else as in `uniform`.

    Examples
    --------
    >>> import symhbm as sh
    >>> disk = sh.bladed_disk(
    ...     13, mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e6, friction_coefficient=0.5, normal_load=10,
    ... )
    >>> draws = sh.mistuning.truncated_normal(disk, 100, seed=1, normal_load=0.1)
    >>> float(abs(draws.normal_load / 10 - 1).max()) < 0.3
    True
    """
    cut = check.scalar("cut", cut, "positive")
    low = ndtr(-cut)

    def factor(share: FloatArray, deviation: FloatArray) -> FloatArray:
        return 1 + deviation * ndtri(low + share * (1 - 2 * low))

    law = _Distribution("truncated normal", "relative standard deviation", cut, factor, cut)
    spreads = standard_deviations
    return _draw(problem, n_samples, seed, sampling, correlation, between, law, spreads)


def lognormal(
    problem: Structure | HarmonicBalance,
    n_samples: int,
    *,
    seed: int,
    sampling: Sampling = "random",
    correlation: Correlation = None,
    between: Mapping[tuple[str, str], float] | None = None,
    **coefficients_of_variation: ArrayLike,
) -> xr.Dataset:
    """Lognormal draws whose mean is the nominal value.

    ``coefficients_of_variation`` by parameter: standard deviation over mean. Everything else as in
    `uniform`.

    Examples
    --------
    >>> import symhbm as sh
    >>> disk = sh.bladed_disk(
    ...     13, mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e6, friction_coefficient=0.5, normal_load=10,
    ... )
    >>> draws = sh.mistuning.lognormal(disk, 100, seed=1, normal_load=0.3)
    >>> draws.normal_load.dims, bool((draws.normal_load > 0).all())
    (('sample', 'contact'), True)
    """

    def factor(share: FloatArray, variation: FloatArray) -> FloatArray:
        variance = np.log1p(variation**2)
        return np.exp(np.sqrt(variance) * ndtri(share) - variance / 2)

    law = _Distribution("lognormal", "coefficient of variation", 0.0, factor)
    spreads = coefficients_of_variation
    return _draw(problem, n_samples, seed, sampling, correlation, between, law, spreads)


def _draw(
    problem: Structure | HarmonicBalance,
    n_samples: int,
    seed: int,
    sampling: str,
    correlation: Correlation,
    between: Mapping[tuple[str, str], float] | None,
    distribution: _Distribution,
    spreads: dict[str, ArrayLike],
) -> xr.Dataset:
    nominal = nominal_values(problem, spreads)
    spreads = dict(zip(nominal, spreads.values(), strict=True))
    n_samples = check.integer("n_samples", n_samples, minimum=1)
    seed = check.integer("seed", seed, minimum=0)
    model = problem if isinstance(problem, Structure) else problem.model
    widths = {
        name: _spread(name, spread, nominal[name], distribution, model.about(name))
        for name, spread in spreads.items()
    }
    sizes = {name: values.size for name, values in nominal.items()}
    copula = Copula.of(sizes, correlation, between)
    counts = {"dof": model.n_dof, "contact": model.n_contacts, "": 1}
    streams = {name: counts["".join(PARAMETERS[name].dims)] for name in DRAWABLE}
    streams |= {name: nominal[name].size for name in nominal if name not in streams}
    shares = copula.couple(unit_samples(sampling, seed, n_samples, sizes, streams))
    settings = {
        "cut": distribution.cut,
        "sampling": sampling,
        "seed": seed,
        "n_samples": n_samples,
        "correlation": _plain(correlation),
        "between": {" ".join(pair): float(value) for pair, value in (between or {}).items()},
        **{package: version(package) for package in ("symhbm", "numpy", "scipy")},
    }
    values, drawn = {}, {}
    for name, share in shares.items():
        factor = distribution.factor(share, widths[name])
        factor = factor.reshape(n_samples, *nominal[name].shape)
        about = model.about(name)
        values[name] = nominal[name] + factor - 1 if about.deviation else nominal[name] * factor
        law = {"distribution": distribution.name, distribution.spread: _plain(spreads[name])}
        drawn[name] = law | settings
    return labelled_samples(problem, values, drawn)


def _spread(
    name: str, spread: ArrayLike, nominal: FloatArray, distribution: _Distribution, about: Parameter
) -> FloatArray:
    """One spread per blade or contact; ValueError if values could leave their range."""
    size = nominal.size
    width = check.one_or_each(name, spread, size, "blade or contact", "non-negative")
    lowest = 1 - distribution.reach * width
    # Damping may be negative, but a scatter that changes its sign is hardly meant.
    signed = about.bound == "any" and about.per == "dof"
    bound = "positive" if about.deviation else "non-negative" if signed else about.bound
    low = lowest <= 0 if bound == "positive" else lowest < 0
    if bound != "any" and np.any(low):
        least = "> 0" if bound == "positive" else ">= 0"
        side = "below" if bound == "positive" else "up to"
        raise ValueError(
            f"{name}={check.shown(spread)}: expected a {distribution.spread} {side} "
            f"{1 / distribution.reach:g}, values must stay {least}"
        )
    if size and np.any(width) and not np.any(nominal) and not about.deviation:
        raise ValueError(
            f"{name}={check.shown(spread)}: expected a parameter whose nominal value is not 0, "
            "spreads are relative to it"
        )
    return width


def _plain(value: Any) -> Any:
    """Numbers and lists of numbers for JSON."""
    if isinstance(value, Mapping):
        return {name: _plain(entry) for name, entry in value.items()}
    return None if value is None else np.asarray(value, dtype=float).tolist()
