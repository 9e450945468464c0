"""Explicit samples of parameters, and patterns around the disk."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from symhbm.balance import HarmonicBalance
from symhbm.ensembles.mistuning.samples import labelled_samples, nominal_values
from symhbm.model import Structure
from symhbm.numerics import FloatArray, check


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
