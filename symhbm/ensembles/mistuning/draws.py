"""Random draws around nominal values, explicit samples, and patterns around the disk."""

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
from symhbm.ensembles.mistuning.samples import (
    DRAWABLE,
    labelled_samples,
    nominal_values,
)
from symhbm.model import Structure, dims_of
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
        Such correlations between parameters at the same blade or contact, by pairs of names.
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
    distribution = _Distribution(
        "uniform", "relative half-width", 1.0, lambda share, h: 1 + h * (2 * share - 1)
    )
    return _draw(
        problem, n_samples, seed, sampling, correlation, between, distribution, half_widths
    )


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
    """
    cut = check.scalar("cut", cut, "positive")
    low = ndtr(-cut)

    def factor(share: FloatArray, deviation: FloatArray) -> FloatArray:
        return 1 + deviation * ndtri(low + share * (1 - 2 * low))

    distribution = _Distribution(
        "truncated normal", "relative standard deviation", cut, factor, cut
    )
    return _draw(
        problem, n_samples, seed, sampling, correlation, between, distribution, standard_deviations
    )


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
    """

    def factor(share: FloatArray, variation: FloatArray) -> FloatArray:
        variance = np.log1p(variation**2)
        return np.exp(np.sqrt(variance) * ndtri(share) - variance / 2)

    distribution = _Distribution("lognormal", "coefficient of variation", 0.0, factor)
    spreads = coefficients_of_variation
    return _draw(problem, n_samples, seed, sampling, correlation, between, distribution, spreads)


def explicit(
    problem: Structure | HarmonicBalance, *, relative: bool = False, **values: Any
) -> xr.Dataset:
    """Explicit samples, checked and labelled.

    Parameters
    ----------
    problem
        The structure or problem whose parameters they are.
    relative
        The values are factors of the nominal ones.
    values
        By parameter: an array ``(n_samples, n)`` with a value per blade or contact, or patterns
        ``(n,)`` by name, one a sample, whose names become the coordinate ``pattern``. Scalar
        parameters have one value per sample.

    Returns
    -------
    Dataset as that of `uniform`.

    Raises
    ------
    TypeError, ValueError, KeyError
        For bad arguments and values out of range.
    """
    nominal = nominal_values(problem, values)
    values = dict(zip(nominal, values.values(), strict=True))
    relative = check.flag("relative", relative)
    samples: dict[str, FloatArray] = {}
    labels: dict[str, list[str]] = {}
    for name, value in values.items():
        if isinstance(value, Mapping):
            labels[name] = [str(label) for label in value]
            value = list(value.values())
        expected = nominal[name].shape
        array = check.array(name, value)
        if array.ndim != 1 + len(expected) or array.shape[1:] != expected or len(array) == 0:
            shape = ", ".join(["n_samples", *map(str, expected)])
            raise ValueError(f"{name}: expected values of shape ({shape}), got {array.shape}")
        samples[name] = check.array(
            name, array * nominal[name] if relative else array, problem.about(name).bound
        )
    for expectation, by_name in {
        "as many samples of each parameter": {name: len(array) for name, array in samples.items()},
        "the same patterns of each parameter": labels,
    }.items():
        if any(value != next(iter(by_name.values())) for value in by_name.values()):
            raise ValueError(f"values: expected {expectation}, got {check.shown(by_name)}")
    drawn = {"distribution": "explicit", "relative": relative}
    result = labelled_samples(problem, samples, dict.fromkeys(samples, drawn))
    for names in labels.values():
        result = result.assign_coords(pattern=("sample", np.array(names, dtype=object)))
        result["pattern"].attrs = {"long_name": "name of the pattern", "units": "1"}
    return result


def pattern(letters: str, n_blades: int, **factors: float) -> FloatArray:
    """Factors ``(n_blades,)`` of types of blades that repeat around the disk, as in ``"AAB"``.

    ``factors`` gives that of each letter, as in ``A=0.97, B=1.03``. Where the number of blades is
    no multiple the last turn is cut short. Raises KeyError for a letter without a factor, and
    TypeError and ValueError for bad arguments.
    """
    n_blades = check.integer("n_blades", n_blades, minimum=1)
    if not isinstance(letters, str) or not letters:
        raise ValueError(f"letters={check.shown(letters)}: expected text such as 'AAB'")
    for letter in letters:
        check.known(letter, factors, "type of blade")
    values = {letter: check.scalar(letter, value) for letter, value in factors.items()}
    return np.resize([values[letter] for letter in letters], n_blades)


def harmonic(
    n_blades: int, nodal_diameter: int, amplitude: float, phase: float = 0.0
) -> FloatArray:
    """Factors ``1 + amplitude cos(2 pi nodal_diameter i / n_blades + phase)`` of blades ``i``.

    ``phase`` in rad; shape ``(n_blades,)``. Raises TypeError and ValueError for bad arguments.
    """
    n_blades = check.integer("n_blades", n_blades, minimum=1)
    nodal_diameter = check.integer("nodal_diameter", nodal_diameter, minimum=0)
    angle = 2 * np.pi * nodal_diameter / n_blades * np.arange(n_blades)
    wave = np.cos(angle + check.scalar("phase", phase))
    return 1 + check.scalar("amplitude", amplitude) * wave


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
    widths = {
        name: _spread(name, spread, nominal[name], distribution, problem.about(name).bound)
        for name, spread in spreads.items()
    }
    sizes = {name: values.size for name, values in nominal.items()}
    copula = Copula(sizes, correlation, between)
    model = problem if isinstance(problem, Structure) else problem.model
    counts = {"dof": model.n_dof, "contact": model.n_contacts, "": 1}
    streams = {name: counts["".join(dims_of(name))] for name in DRAWABLE}
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
        values[name] = nominal[name] * factor.reshape(n_samples, *nominal[name].shape)
        law = {"distribution": distribution.name, distribution.spread: _plain(spreads[name])}
        drawn[name] = law | settings
    return labelled_samples(problem, values, drawn)


def _spread(
    name: str, spread: ArrayLike, nominal: FloatArray, distribution: _Distribution, bound: str
) -> FloatArray:
    """One spread per blade or contact; ValueError if values could leave their range."""
    size = nominal.size
    width = check.one_or_each(name, spread, size, "blade or contact", "non-negative")
    lowest = 1 - distribution.reach * width
    low = lowest <= 0 if bound == "positive" else lowest < 0
    if bound != "any" and np.any(low):
        least = "> 0" if bound == "positive" else ">= 0"
        side = "below" if bound == "positive" else "up to"
        raise ValueError(
            f"{name}={check.shown(spread)}: expected a {distribution.spread} {side} "
            f"{1 / distribution.reach:g}, values must stay {least}"
        )
    if size and np.any(width) and not np.any(nominal):
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
