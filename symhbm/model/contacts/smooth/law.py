"""A force of displacements, velocities and parameters that an expression gives.

The force over a period is a sum over samples, whose number depends on the motion: it is found by
`locate`, with its exact first derivatives. What `force` makes of them is its expansion to first
order about the motion, which has the value and the derivatives of the sums there.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symhbm.model.contacts.memoryless import Instants, MemorylessLaw
from symhbm.model.contacts.motions import Events, Located, Motions, Parameter, Values
from symhbm.model.contacts.smooth import expression as graph
from symhbm.model.contacts.smooth import sums
from symhbm.model.contacts.smooth.breaks import Motion, find_breaks
from symhbm.model.contacts.smooth.expression import Force, Sizes, arguments_of, force_of
from symhbm.numerics import FloatArray, FourierBasis, check

ROUND_OFF = 1e-9
"""Share of a force within which it is the opposite of another one."""
_SIZES = 10.0 ** np.repeat(np.arange(-9.0, 2.0), 4)
"""Sizes of motions that are tried [m, m/s]."""


class SmoothForce(MemorylessLaw):
    """The law of `symhbm.laws.SmoothLaw`: a force whose ``graph`` is plain operations.

    Beside the force it tells as many functions of ``breakpoints``; ``odd``, whether the opposite
    motion has the opposite force.

    Raises ValueError for a graph that is none of so many directions and parameters.
    """

    def __init__(
        self,
        graph: str,
        parameters: Mapping[str, Parameter],
        directions: Sequence[str],
        breakpoints: int,
        odd: bool,
    ):
        self.graph, self.breakpoints = graph, check.integer("breakpoints", breakpoints, minimum=0)
        self.odd = check.flag("odd", odd)  # type: ignore[misc]
        self.parameters = dict(parameters)  # type: ignore[misc]
        self.directions = tuple(map(str, directions))  # type: ignore[misc]
        _ = self.instants

    @property
    def instants(self) -> Force:
        """The force at instants, compiled."""
        sizes = Sizes(len(self.directions), len(self.parameters), self.breakpoints)
        return force_of(self.graph, sizes)

    @property
    def has_kinks(self) -> bool:
        """Whether it has operations that choose, as a maximum of two."""
        return graph.has_choices(self.graph)

    sums_samples = True

    def tried(self, values: Values, opposite: bool = False) -> FloatArray:
        """Forces (44, n, m) [N] of motions of all sizes, or sums of those of opposite ones."""
        given, rng = self._given(values), np.random.default_rng(0)
        m = len(self.directions)
        way = rng.uniform(0.5, 1.5, (2, len(_SIZES), 1, m)) * rng.choice(
            [-1, 1], (2, len(_SIZES), 1, m)
        )
        displacement, velocity = way * _SIZES[:, None, None]
        with np.errstate(all="ignore"):
            force = self.instants.force(arguments_of(displacement, velocity, given))
            if opposite:
                force = force + self.instants.force(arguments_of(-displacement, -velocity, given))
        return force

    @property
    def gives_back(self) -> bool:
        """Where one displacement alone has the force."""
        m = len(self.directions)
        return m == 1 and not self._depends(m)

    def _depends(self, first: int) -> bool:
        """Whether any force depends on displacements, or on velocities."""
        m, sizes = len(self.directions), self.instants.sizes
        arguments = ca.SX.sym("arguments", sizes.arguments)
        results = graph.read(self.graph, ca.vertsplit(arguments), m + sizes.breakpoints)[:m]
        chosen = arguments[first : first + m]
        return bool(ca.which_depends(ca.vertcat(*results), chosen, 1, True).count(True))

    def _given(self, values: Values) -> FloatArray:
        """Values of the parameters contact by contact, (n, p)."""
        return np.array([values[name] for name in self.parameters], dtype=float).T

    def _motion(self, at: Motions) -> Motion:
        return Motion(*at.numbers(self))

    def results(self, at: Motions, located: Located) -> dict[str, FloatArray]:
        """The energy that it dissipates, where it does not give back what it takes."""
        return {} if self.gives_back else super().results(at, located)

    def acts(self, values: Values) -> NDArray[np.bool_]:
        """Those with a force at any of the motions that are tried."""
        return np.any(self.tried(values) != 0, axis=(0, 2))

    def holds(self, values: Values) -> NDArray[np.bool_]:
        """Those that act, where displacements have a force."""
        return self.acts(values) & self._depends(0)

    def stiffest(self, values: Values) -> FloatArray:
        """Without bound where displacements have a force, else none."""
        return np.where(self.holds(values), np.inf, 0.0)

    def n_events(self, basis: FourierBasis) -> int:
        """Coefficients of the expansion, and its slopes."""
        size = len(self.directions) * basis.n_components
        return size * (2 + size + len(self.parameters))

    def locate(self, at: Motions, held: NDArray[np.bool_] | None = None) -> Located:
        """The force by sums over samples, and its derivatives; details are those of the sums."""
        motion = self._motion(at)
        force, slope, details = sums.coefficients(self.instants, at.basis, motion)
        variables = np.column_stack([motion.coefficients, motion.frequency, motion.parameters])
        constant = force - np.einsum("niv,nv->ni", slope, variables)
        n, size = at.motion.shape
        events = np.concatenate([constant, slope.transpose(0, 2, 1).reshape(n, -1)], axis=1)
        none = np.zeros((n, 0))
        return Located(events, none.astype(bool), none, np.zeros((n, 0, size)), details)

    def force(self, at: Motions, events: Any) -> Any:
        """The expansion about the motion of the events: exact to first order there."""
        size = at.motion.shape[0]
        slope = ca.reshape(events[size:], size, -1)
        return events[:size] + slope @ self.event_variables(at)

    def moving(self, at: Motions, located: Located) -> Events:
        """The break points."""
        return sums.moving(self.instants, at.basis, self._motion(at), located.details)

    def moving_events(self, at: Motions, located: Located, weights: FloatArray) -> FloatArray:
        """All second derivatives of the sums, which the expansion has none of."""
        motion = self._motion(at)
        fixed = sums.bends(self.instants, at.basis, motion, located.details, weights)
        return fixed + super().moving_events(at, located, weights)

    def sampling_errors(self, located: Located) -> FloatArray:
        """How far the last doubling of samples moved the coefficients of the force."""
        return located.details.error

    def at_instants(
        self, displacement: FloatArray, velocity: FloatArray, frequency: float, values: Values
    ) -> Instants:
        """Those of the expression."""
        arguments = arguments_of(displacement, velocity, self._given(values))
        force, slope = self.instants.slopes(arguments)
        m = len(self.directions)
        return Instants(force, slope[..., :m], slope[..., m : 2 * m])

    def damping(self, at: Motions) -> FloatArray:
        """Sums of the slopes by velocities."""
        motion = self._motion(at)
        details = sums.coefficients(self.instants, at.basis, motion)[2]
        return sums.damping(self.instants, at.basis, motion, details)

    def breaks(self, at: Motions) -> list[FloatArray]:
        """Zeros of the functions of break points."""
        breaks = find_breaks(self.instants, at.basis, self._motion(at))
        return [each.angle for each in breaks]

    def __repr__(self) -> str:
        return f"SmoothForce({', '.join(self.parameters)})"
