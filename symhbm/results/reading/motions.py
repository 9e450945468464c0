"""`motion`: phases, complex amplitudes, velocities and accelerations of stored responses."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from symhbm.numerics import RADIANS, check
from symhbm.results.description import largest_of, motions_of, spread_of
from symhbm.results.reading.selection import At
from symhbm.results.reading.selection import at as chosen_points
from symhbm.results.schema import check_dataset, check_present

_KINDS = {"points": "", "peaks": "peak_"}
MOTIONS = {
    "complex_amplitude": ("m", "complex amplitude a - i b of the harmonic"),
    "harmonic_amplitude": ("m", "amplitude of the harmonic"),
    "phase_lag": ("rad", "lag of the harmonic behind cos(n omega t)"),
    "peak_to_peak": ("m", "largest less smallest displacement over the period"),
    "velocity_amplitude": ("m s-1", "largest absolute velocity over the period"),
    "acceleration_amplitude": ("m s-2", "largest absolute acceleration over the period"),
}
"""Units and meanings of what every motion has."""
HISTORIES = {
    "displacement": ("m", "displacement"),
    "velocity": ("m s-1", "velocity"),
    "acceleration": ("m s-2", "acceleration"),
}
"""The same over the ``angle`` of the period, by the number of the derivative."""


def motion(
    result: xr.Dataset,
    kind: str = "points",
    *,
    at: At | None = None,
    angle: ArrayLike | None = None,
) -> xr.Dataset:
    """Phases, complex amplitudes, velocities and accelerations of the motions in a result.

    A displacement is ``x(t) = sum_n a_n cos(n omega t) + b_n sin(n omega t)`` in the convention of
    ``coefficient``. Its complex amplitudes are ``X_n = a_n - i b_n``, hence ``x = Re sum_n X_n
    exp(i n omega t)``, and those of the velocity ``i n omega X_n``. A harmonic is ``|X_n| cos(n
    omega t - lag)``, with a positive ``phase_lag`` where it comes later than ``cos(n omega t)``, as
    which a `symhbm.forces.PointForce` without phase acts.

    Parameters
    ----------
    result
        A result with ``coefficient``, from `frf`, `follow`, `solve` or `periodic_motion`. Of large
        archives, select first: all coefficients are read.
    kind
        The motions at ``"points"``, or at ``"peaks"`` by ``peak_coefficient``.
    at
        One point of each curve alone, as of `symhbm.datasets.at`.
    angle
        Angles ``omega t`` (n,) [rad] for histories; None for none.

    Returns
    -------
    Dataset with the dimensions of ``coefficient`` and, for each ``dof`` and ``harmonic``,

    * ``complex_amplitude`` [m], complex, as no archive holds it;
    * ``harmonic_amplitude`` [m], its size;
    * ``phase_lag`` [rad] in (-pi, pi], NaN where there is no motion;

    for each ``dof``, exact for the series,

    * ``peak_to_peak`` [m], the largest less the smallest displacement;
    * ``velocity_amplitude`` [m/s] and ``acceleration_amplitude`` [m/s^2], largest absolute values;

    and with ``angle``, along it, ``displacement`` [m], ``velocity`` [m/s] and ``acceleration``
    [m/s^2]. Padding and what did not converge is NaN.

    Raises
    ------
    TypeError, KeyError, ValueError
        For what is no dataset, a result without the coefficients, an unknown kind or bad angles.

    Notes
    -----
    Harmonics left out weigh n times in velocities and n^2 times in accelerations what they weigh in
    displacements. Friction forces have kinks, and `periodic_motion` has no truncation.

    Examples
    --------
    A quarter of a period behind the force, at the resonance of a linear blade:

    >>> import symhbm as sh
    >>> blade = sh.Model([[1.0]], [[0.5]], [[1e4]])
    >>> point = sh.solve(sh.HarmonicBalance(blade, sh.forces.PointForce()), 100 / 6.283185307179586)
    >>> round(sh.datasets.motion(point).phase_lag.item(), 6)
    1.570796
    >>> round(sh.datasets.motion(point).velocity_amplitude.item(), 6)
    2.0
    """
    check_dataset("result", result)
    prefix = _KINDS[check.one_of("kind", kind, _KINDS)]
    result = result if at is None else chosen_points(result, at)
    frequency_name = f"{prefix}frequency" if f"{prefix}frequency" in result else "frequency"
    check_present(result, f"{prefix}coefficient", frequency_name, container="result")
    coefficient = result[f"{prefix}coefficient"].transpose(..., "harmonic", "component")
    frequency = result[frequency_name]
    outer = [str(dim) for dim in coefficient.dims[:-2]]
    basis, motions = motions_of(coefficient)
    speed = RADIANS * frequency.broadcast_like(coefficient.isel(harmonic=0, component=0, drop=True))
    omega = speed.transpose(*outer).values[..., None]
    derivatives = [motions]
    for _ in range(2):
        derivatives.append(derivatives[-1] @ basis.derivative_matrix.T * omega)
    phasor = basis.phasors(motions)
    size, by_harmonic = np.abs(phasor), [*outer, "harmonic"]
    values: dict[str, Any] = {
        "complex_amplitude": (by_harmonic, phasor),
        "harmonic_amplitude": (by_harmonic, size),
        "phase_lag": (by_harmonic, np.where(size > 0, np.angle(phasor.conj()), np.nan)),
        "peak_to_peak": (outer, spread_of(basis, motions)),
    }
    for name, of in zip(("velocity", "acceleration"), derivatives[1:], strict=True):
        values[f"{name}_amplitude"] = outer, largest_of(basis, of)
    coordinates = dict(coefficient.drop_vars("component").coords) | {frequency_name: frequency}
    about = dict(MOTIONS)
    if angle is not None:
        angle = np.atleast_1d(check.array("angle", angle))
        if angle.ndim != 1:
            raise ValueError(f"angle={check.shown(angle)}: expected one dimension")
        functions = basis.values(angle).T
        for name, of in zip(HISTORIES, derivatives, strict=True):
            values[name] = [*outer, "angle"], of @ functions
        coordinates["angle"] = xr.Variable(
            "angle", angle, {"units": "rad", "long_name": "angle of the period, omega t"}
        )
        about |= HISTORIES
    variables = {
        name: (*of, {"units": about[name][0], "long_name": about[name][1]})
        for name, of in values.items()
    }
    return xr.Dataset(variables, coordinates)
