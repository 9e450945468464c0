"""Forces that change with the frequency: sums of forces times powers of the angular frequency."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Self

from symhbm.model.excitation.excitation import Changing, Excitation, check_excitation
from symhbm.model.places import Place
from symhbm.numerics import FloatArray, FourierBasis, check


@dataclass(frozen=True, repr=False)
class FrequencyForce(Changing):
    """Force ``amplitude sum_p omega^p F_p``: a force F_p for each power p of the angular frequency.

    ``forces`` maps integer powers, negative ones too, to forces; ``omega`` is in rad/s.
    ``units`` and ``meaning`` are those of the amplitude, as results state them. Derivatives by the
    frequency are exact.

    Raises TypeError or ValueError for what is no power, no force, or a force that has a static part
    or changes with the frequency itself.

    Examples
    --------
    An unbalance of 2e-3 kg m on a rotor drives it with ``m e omega^2``:

    >>> import symhbm as sh
    >>> force = sh.forces.FrequencyForce(
    ...     {2: sh.forces.PointForce()}, amplitude=2e-3, units="kg m", meaning="unbalance"
    ... )
    >>> rotor = sh.Model([[10.0]], [[100.0]], [[1e6]])
    >>> response = sh.frf(sh.HarmonicBalance(rotor, force), (20, 100))
    >>> response.peak_frequency.values.round(3)
    array([50.342])
    """

    forces: Mapping[int, Excitation]
    amplitude: float = 1.0
    units: str = "N"
    meaning: str = "amplitude of the exciting force"
    base: Excitation | None = None

    def __post_init__(self):
        put = object.__setattr__
        put(self, "amplitude", check.scalar("amplitude", self.amplitude))
        if not isinstance(self.forces, Mapping) or not self.forces:
            raise TypeError(
                f"forces={check.shown(self.forces)}: expected {{power: force}}, as in "
                "{2: symhbm.forces.PointForce()}"
            )
        forces = {}
        for power, force in self.forces.items():
            check_excitation(f"forces[{power!r}]", force)
            if force.changes or any(map(_is_static, leaves(force))):
                raise ValueError(
                    f"forces[{power!r}]={check.shown(force)}: expected a force that oscillates "
                    "alone and does not change with the frequency"
                )
            forces[check.integer("power of forces", power)] = force
        put(self, "forces", forces)
        for name in ("units", "meaning"):
            check.text(name, getattr(self, name))

    def along_base(self, translation: Callable[[Any], Any]) -> Excitation:
        """The same force, its base with where it takes a reduced structure."""
        if self.base is None:
            return self
        return replace(self, base=replace(self.base, influence=translation(self.base)))  # type: ignore

    def with_forces(self, forces: dict[int, Excitation]) -> Excitation:
        """The same amplitude with these forces."""
        return replace(self, forces=forces)

    @property
    def parts(self) -> tuple[Excitation, ...]:
        """The forces, by ascending powers."""
        return tuple(self.forces[power] for power in sorted(self.forces))

    def shapes(self, structure: Any, basis: FourierBasis) -> dict[int, FloatArray]:
        """Coefficients at unit amplitude by the power of the angular frequency."""
        return {
            power: force.amplitude * structure.force_shape(force, basis)
            for power, force in self.forces.items()
        }

    def placed(self, number_of: Callable[[Place], int]) -> Self:
        """The same forces on numbered degrees of freedom."""
        forces = {power: force.placed(number_of) for power, force in self.forces.items()}
        return replace(self, forces=forces)


def _is_static(force: Excitation) -> bool:
    return "force_amplitude" not in force.parameters or getattr(force, "mean", None) is not None


def leaves(force: Excitation) -> tuple[Excitation, ...]:
    """The forces that others are made of, with amplitudes of their own."""
    parts = getattr(force, "scaled", None) or getattr(force, "parts", None)
    return (force,) if not parts else tuple(leaf for part in parts for leaf in leaves(part))
