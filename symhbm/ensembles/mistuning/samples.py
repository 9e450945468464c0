"""Samples of parameters as labelled datasets: what may be drawn, explicit ones, patterns."""

import json
from collections.abc import Collection, Mapping
from importlib.metadata import version
from typing import Any

import numpy as np
import xarray as xr

from symhbm.balance import HarmonicBalance
from symhbm.model import BLADE_PARAMETERS, CONTACT_PARAMETERS, PARAMETERS, Structure
from symhbm.numerics import FloatArray, check
from symhbm.results import DRAWN, SCHEMA_VERSION

# The position of a name is the number of its random stream: add names at the end only.
_FIRST = (*CONTACT_PARAMETERS, *BLADE_PARAMETERS, "force_amplitude")
_NOT_HERE = {name for name, about in PARAMETERS.items() if about.per == "blade"} | {"engine_order"}
DRAWABLE = (*_FIRST, *(name for name in PARAMETERS if name not in {*_FIRST, *_NOT_HERE}))


def nominal_values(
    problem: Structure | HarmonicBalance, names: Collection[str]
) -> dict[str, FloatArray]:
    """Nominal values of the named parameters, without an axis where they are scalar.

    Raises TypeError, ValueError and KeyError for anything that cannot be drawn.
    """
    if not isinstance(problem, Structure | HarmonicBalance):
        raise TypeError(f"problem={check.shown(problem)}: expected a Model or a HarmonicBalance")
    allowed = [name for name in problem.parameters if name != "engine_order"]
    if not names:
        raise ValueError(f"expected at least one parameter by name of {', '.join(allowed)}")
    own = [problem.parameter_name(name, allowed, "parameter that can be drawn") for name in names]
    return {name: np.asarray(problem.parameters[name], dtype=float) for name in own}


def labelled_samples(
    problem: Structure | HarmonicBalance,
    values: dict[str, FloatArray],
    drawn: dict[str, dict[str, Any]],
) -> xr.Dataset:
    """Dataset of samples (n_samples, ...) by parameter, and the description of each draw."""
    n_samples = len(next(iter(values.values())))
    model = problem if isinstance(problem, Structure) else problem.model
    variables = {}
    for name, array in values.items():
        units, long_name = model.about(name)[:2]
        attributes = {"units": units, "long_name": long_name, DRAWN: json.dumps(drawn[name])}
        variables[name] = (("sample", *model.dims_of(name)), array, attributes)
    sample = ("sample", np.arange(n_samples), {"long_name": "sample", "units": "1"})
    attributes = {
        "title": "Draws of mistuned parameters",
        "symhbm_schema": SCHEMA_VERSION,
        "symhbm_version": version("symhbm"),
    }
    return xr.Dataset(variables, {"sample": sample}, attributes)


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

    Examples
    --------
    Two patterns of contact stiffnesses around a disk, as factors:

    >>> import symhbm as sh
    >>> disk = sh.bladed_disk(
    ...     13, mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e6, friction_coefficient=0.5, normal_load=10,
    ... )
    >>> soft = sh.mistuning.pattern("AB", 13, A=0.9, B=1.1)
    >>> wave = sh.mistuning.harmonic(13, 3, 0.1)
    >>> factors = {"AB": soft, "wave": wave}
    >>> draws = sh.mistuning.explicit(disk, relative=True, contact_stiffness=factors)
    >>> draws.contact_stiffness.sizes
    Frozen({'sample': 2, 'contact': 13})
    """
    nominal = nominal_values(problem, values)
    model = problem if isinstance(problem, Structure) else problem.model
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
            name, array * nominal[name] if relative else array, model.about(name).bound
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

    Examples
    --------
    >>> import symhbm as sh
    >>> sh.mistuning.pattern("AAB", 5, A=0.97, B=1.03)
    array([0.97, 0.97, 1.03, 0.97, 0.97])
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

    Examples
    --------
    >>> import symhbm as sh
    >>> sh.mistuning.harmonic(4, 1, 0.1).round(2)
    array([1.1, 1. , 0.9, 1. ])
    """
    n_blades = check.integer("n_blades", n_blades, minimum=1)
    nodal_diameter = check.integer("nodal_diameter", nodal_diameter, minimum=0)
    angle = 2 * np.pi * nodal_diameter / n_blades * np.arange(n_blades)
    wave = np.cos(angle + check.scalar("phase", phase))
    return 1 + check.scalar("amplitude", amplitude) * wave
