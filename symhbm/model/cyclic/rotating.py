"""Structures whose matrices change with the speed of rotation."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import scipy.sparse as sp

from symhbm.model.excitation import Excitation
from symhbm.model.frame import CACHED
from symhbm.model.matrices import Model, matrix_of
from symhbm.numerics import check

PER_MINUTE = 2 * np.pi / 60
"""Angular speed [rad/s] of one turn per minute."""
_MOST = 3
"""Speeds that the stiffness may be known at: as many powers of the square of the speed."""
_SKEW = 1e-9
"""Symmetric share of a matrix of Coriolis forces that is round-off of a file."""


class RotatingModel(Model):
    """A structure that turns with the angular speed ``Omega``, seen from its rotating frame.

    ``M x'' + (C + Omega G) x' + (K_0 + Omega^2 K_1 + Omega^4 K_2) x + contacts = F(t)``.

    Along an engine order E the frequency is ``omega = E Omega``: a response to it moves speed and
    frequency together, in each harmonic with
    ``Z_n = K_0 + (omega / E)^2 K_1 + (omega / E)^4 K_2 + i n omega (C + omega / E G)
    - (n omega)^2 M``. `at` gives the structure at one speed.

    Parameters
    ----------
    structure
        Mass, damping and contacts; its stiffness is not used.
    stiffness : {speed: (n_dof, n_dof)}
        Stiffness matrices [N/m] at two or three speeds [1/min], from static analyses under
        rotation: stress stiffening and spin softening included. Two make ``K_0`` and ``K_1``, three
        ``K_2`` as well.
    coriolis : (n_dof, n_dof)
        ``G`` [kg], skew-symmetric, None without.

    Raises
    ------
    TypeError, ValueError
        For a structure that is no Model, for speeds that are negative or of another number, for
        matrices that do not fit, for one of Coriolis forces that is not skew-symmetric.

    Notes
    -----
    Contacts are pressed by rotation with ``centrifugal_load=`` of `symhbm.Friction` and
    `symhbm.Gap`; static loads stay constant. What follows an engine order has no matrices of its
    own: motions in time, stability and reductions need `at` one speed.

    Examples
    --------
    A blade whose natural frequency rises from 15.9 Hz at rest to 19.5 Hz at 300 turns a minute,
    swept along the third engine order:

    >>> import symhbm as sh
    >>> blade = sh.Model(
    ...     [[1.0]], [[0.5]], [[1e4]], contacts=[(0,)],
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> rotor = sh.RotatingModel(blade, stiffness={0: [[1e4]], 300: [[1.5e4]]})
    >>> sh.natural_modes(rotor.at(300)).frequency.values.round(2)
    array([19.49])
    >>> problem = sh.HarmonicBalance(rotor, sh.forces.EngineOrder(3, amplitude=2.0))
    >>> response = sh.frf(problem, (10, 40), progress=False)
    >>> response.peak_speed.values.round(0)  # turns per minute
    array([487.])
    """

    WITHOUT_MATRICES = (
        "expected matrices that do not change with the frequency, along an engine order they do; "
        "use the structure at one speed, RotatingModel.at(speed)"
    )

    def __init__(self, structure: Model, stiffness: Mapping[float, Any], coriolis: Any = None):
        if not isinstance(structure, Model) or isinstance(structure, RotatingModel):
            raise TypeError(f"structure={check.shown(structure)}: expected a Model")
        speeds, parts = _of_speed(stiffness, structure.n_dof)
        gyroscopic = None if coriolis is None else _skew(coriolis, structure.n_dof)
        given = {name: value for name, value in vars(structure).items() if name not in CACHED}
        self._store(**given, **{"speeds": speeds, "coriolis": gyroscopic})
        # Its stiffness is no longer one value per blade.
        self._store(stiffness_matrix=parts[0], stiffening=parts[1:], engine_order=None)
        self._store(lumped=False)

    has_matrices = False  # type: ignore[override]  # along an engine order they change
    speeds: tuple[float, ...]
    stiffening: tuple[Any, ...]
    coriolis: Any
    engine_order: float | None

    def at(self, speed: float) -> Model:
        """The structure at one speed [1/min], Coriolis forces in its damping matrix.

        Loads of contacts that rotation presses are those of the speed, and damping by a rule is of
        the stiffness there.
        """
        speed = check.scalar("speed", speed, "non-negative")
        turning = PER_MINUTE * speed
        values = {name: value for name, value in vars(self).items() if name not in _OF_ROTATION}
        stiffness = self.stiffness_matrix
        for power, part in enumerate(self.stiffening, 1):
            stiffness = stiffness + turning ** (2 * power) * part
        stiffness = sp.csc_array(stiffness)
        stiffness.data.setflags(write=False)
        # Above a critical speed spin softening leaves a negative one, and Coriolis forces hold it.
        values["stiffness_matrix"] = stiffness
        name = "damping_matrix" if self.damping is None else "coriolis_matrix"
        if self.damping is not None:
            values.pop("damping_matrix", None)  # that of the stiffness at rest
        if self.coriolis is not None:
            still = values.get(name)
            turned = turning * self.coriolis
            values[name] = matrix_of(name, turned if still is None else still + turned, self.n_dof)
        values["groups"] = self.groups.at(speed)
        values["speed"] = speed
        result = object.__new__(Model)
        result._store(**values)
        return result

    def along(self, excitation: Excitation) -> RotatingModel:
        """The structure along the engine order of an excitation; ValueError without one."""
        if self.damping is not None and self.damping.stiffness_share is None:
            raise ValueError(
                f"excitation={excitation!r}: expected damping that follows the speed along an "
                f"engine order, {self.damping!r} is of the modes at one; give a RayleighDamping, a "
                "StructuralDamping or a damping matrix, that of RotatingModel.at(speed) for "
                "example, or use the structure at one speed"
            )
        ratios = excitation.speed_ratios
        if len(ratios) != 1:
            raise ValueError(
                f"excitation={excitation!r}: expected one engine order, which tells the speed at "
                "each frequency, or the structure at one speed, RotatingModel.at(speed)"
            )
        return self._copy(engine_order=next(iter(ratios)))

    def rotation_powers(self, harmonic: int) -> dict[int, Any]:
        """What stiffening and Coriolis forces add, by powers of the frequency."""
        if self.engine_order is None:
            raise ValueError("engine_order=None: expected a structure under an engine order")
        order, result = self.engine_order, {}
        lossy = 1 + 1j * self.loss_factor * (harmonic > 0)
        for k, part in enumerate(self.stiffening, 1):
            part = part / order ** (2 * k)
            result[2 * k] = lossy * part
            share = 0.0 if self.damping is None else self.damping.stiffness_share
            if share and harmonic:
                result[2 * k + 1] = 1j * harmonic * share * part
        if self.coriolis is not None and harmonic:
            result[2] = result[2] + 1j * harmonic / order * self.coriolis
        return result


_OF_ROTATION = {"speeds", "stiffening", "coriolis", "engine_order", *CACHED}


def _of_speed(given: Any, size: int) -> tuple[tuple[float, ...], tuple[Any, ...]]:
    """Speeds [1/min] and coefficients of powers of the square of the speed [rad/s]."""
    check.instance("stiffness", given, Mapping, "{speed: matrix}")
    speeds = tuple(check.scalar("speed of stiffness", speed, "non-negative") for speed in given)
    if len({*speeds}) != len(speeds) or not 2 <= len(speeds) <= _MOST:
        raise ValueError(f"stiffness: expected two or three different speeds, got {speeds}")
    matrices = [matrix_of(f"stiffness[{s:g}]", m, size) for s, m in given.items()]
    # The speeds are scaled to 1, so that powers have the same size.
    largest = max(speeds)
    squares = (np.array(speeds) / largest) ** 2
    shares = np.linalg.inv(np.vander(squares, increasing=True))
    parts = []
    for power, row in enumerate(shares):
        part = sum(share * matrix for share, matrix in zip(row, matrices, strict=True))
        parts.append(sp.csc_array(part) / (PER_MINUTE * largest) ** (2 * power))
    parts[0].data.setflags(write=False)
    return speeds, tuple(parts)


def _skew(given: Any, size: int) -> Any:
    matrix = sp.csc_array(given, dtype=float)
    if matrix.shape != (size, size):
        raise ValueError(f"coriolis: expected shape {(size, size)}, got {matrix.shape}")
    check.array("coriolis entries", matrix.data)
    largest = abs(matrix).max()
    symmetric = abs(matrix + matrix.T).max()
    if symmetric > _SKEW * largest:
        raise ValueError(
            "coriolis: expected a skew-symmetric matrix, G = -G^T, its symmetric part is "
            f"{symmetric / largest:.1e} of it"
        )
    return matrix
