"""What a finite-element program tells of a structure beside matrices and mesh."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from symhbm.model.records import Record, record
from symhbm.numerics import FloatArray


@record
class Modes(NamedTuple):
    """Natural modes that the program computed, of a sector in waves or of the whole.

    ``frequency`` (n,) [Hz]; ``nodal_diameter`` (n,), None of a whole structure; ``shape`` (n,
    n_nodes, 3), complex in waves, over the nodes of the mesh, None where it was not written. The
    program's own sense of nodal diameters: `read_structure` finds whether it is the one here.
    """

    frequency: FloatArray
    nodal_diameter: NDArray[np.int64] | None = None
    shape: Any = None


@dataclass(frozen=True, eq=False, repr=False)
class Program(Record):
    """What a program told, in SI units once `read_structure` gives it, over nodes of the mesh.

    Parameters
    ----------
    name
        The program, with its version where it is known.
    speed
        Speed of rotation [1/min] that the stiffness is of, None where it is at rest.
    axis, n_sectors
        ``"x"``, ``"y"`` or ``"z"``, and the sectors of the disk; None where nobody told.
    sides
        Names of the two sets that it joins by cyclic symmetry, in any order.
    materials : {name: {quantity: value}}
        ``density`` [kg/m^3], ``modulus`` [N/m^2], ``poisson``, ``mass_share`` [1/s],
        ``stiffness_share`` [s].
    mass : (n_nodes,)
        Share of each node of the mass [kg].
    moment : (n_nodes, 3)
        Mass of each node times its place [kg m]; its part across the axis, times the square of the
        angular speed, is the centrifugal load.
    displacement : (n_nodes, 3)
        Of the static analysis at the speed [m].
    held : (n, 2)
        Node, and direction 0 to 2, of supports that are no degrees of freedom of the matrices;
        None where nobody told which they are.
    modes
        Its natural `Modes`.
    account
        What was found out about it, in lines.
    """

    name: str
    speed: float | None = None
    axis: str | None = None
    n_sectors: int | None = None
    sides: tuple[str, str] | None = None
    materials: Any = None
    mass: Any = None
    moment: Any = None
    displacement: Any = None
    held: Any = None
    modes: Modes | None = None
    account: Any = ()

    def __repr__(self) -> str:
        return f"Program: {self.name}, {len(self.account)} lines of account"

    def in_si(self, length: float, mass: float, time: float) -> Program:
        """The same of values in other units, of which 1 is so many metres, kilograms, seconds."""
        powers = {
            "density": mass / length**3,
            "modulus": mass / length / time**2,
            "mass_share": 1 / time,
            "stiffness_share": time,
        }
        materials = {
            name: {key: value * powers.get(key, 1.0) for key, value in values.items()}
            for name, values in (self.materials or {}).items()
        }
        modes = self.modes and self.modes._replace(frequency=self.modes.frequency / time)
        changed: dict[str, Any] = dict(materials=materials, modes=modes)
        changed["speed"] = None if self.speed is None else self.speed / time
        if self.displacement is not None:
            changed["displacement"] = length * self.displacement
        return replace(self, **changed)
