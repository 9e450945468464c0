"""How far a place is from where it rests, in the mean over a cycle."""

from dataclasses import dataclass
from typing import Any, ClassVar

import casadi as ca
import scipy.sparse as sp

from symhbm.balance.goals.goal import Goal, Solution
from symhbm.model import Place, Structure


@dataclass(frozen=True, repr=False)
class MeanDisplacement(Goal):
    """Magnitude of a displacement in the mean over a cycle [m].

    Attributes
    ----------
    place
        The number of a degree of freedom, or its name as ``"tip:x"``.

    Examples
    --------
    A blade that a stop pushes off, at its peak:

    >>> import symhbm as sh
    >>> stop = sh.Gap(normal=[(0,)], normal_stiffness=1e4, gap=2e-4)
    >>> blade = sh.Model([[1]], [[2]], [[1e4]], contacts={"stop": stop})
    >>> problem = sh.HarmonicBalance(
    ...     blade, sh.forces.PointForce(), harmonics=(0, 1, 2, 3),
    ...     peaks_of=sh.goals.MeanDisplacement(0),
    ... )
    >>> response = sh.frf(problem, (10, 20), progress=False)
    >>> response.peak_amplitude.values.round(8)
    array([0.00087654])
    """

    place: Place
    units: ClassVar[str] = "m"
    meaning: ClassVar[str] = "magnitude of a mean displacement"

    def check(self, model: Structure, harmonics: tuple[int, ...]) -> None:
        """As of all goals, and ValueError where motions have no mean."""
        self._row(model)
        if 0 not in harmonics:
            raise ValueError(
                f"{self!r}: expected harmonic 0 among those of the problem, {harmonics}"
            )

    def value(self, at: Solution) -> Any:
        """That of harmonic 0, in which all sectors that move alike are where the first one is."""
        row, n_dof = self._row(at.model), at.coefficients.shape[1]
        means = at.coefficients[at.basis.component(0), :]
        shares = zip(row.coords[1].tolist(), row.data.tolist(), strict=True)
        return ca.fabs(sum((share * means[dof % n_dof] for dof, share in shares), ca.SX(0)))

    def _row(self, model: Structure) -> Any:
        """The place as a row over the degrees of freedom of a structure."""
        seen = model.with_outputs({"place": {self.place: 1.0}}, "m")
        return sp.coo_array(seen.outputs["place"].rows)
