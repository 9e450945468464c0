"""The path that contacts slip per cycle."""

from dataclasses import dataclass
from typing import Any, ClassVar

from symhbm.balance.goals.dissipation import Dissipation
from symhbm.balance.goals.goal import ContactSymbols
from symhbm.model import Structure
from symhbm.model.contacts import Coulomb


@dataclass(frozen=True, repr=False)
class SlipDistance(Dissipation):
    """Path that contacts slip per cycle [m], of friction under a load that motion leaves constant.

    Attributes
    ----------
    group
        The name of a group of contacts, all of them by default, whose paths are summed. Of a
        `symhbm.Sector` they are those of one sector, as in its results.
    contact
        The number of one contact within the group.

    Examples
    --------
    A load that keeps the peak and the wear of a damper small: 1 mm of slip per cycle is as bad as
    0.2 mm of the peak.

    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    >>> best = sh.minimise_peak(
    ...     problem, "normal_load", bounds=(0.1, 20), frequency_band=(5, 40),
    ...     peaks={"tip": {}, "wear": {"goal": sh.goals.SlipDistance()}},
    ...     objective=lambda peaks, _: peaks["tip"] + 0.2 * peaks["wear"], progress=False,
    ... )
    >>> best.design_value.values.round(6), best.named_peak_amplitude.values.round(6)
    (array([3.625919]), array([0.000315, 0.000535]))
    """

    units: ClassVar[str] = "m"
    meaning: ClassVar[str] = "path that contacts slip per cycle"
    law: ClassVar[type] = Coulomb

    def check(self, model: Structure, harmonics: tuple[int, ...]) -> None:
        """As of the energy, and TypeError for contacts without a constant limit."""
        super().check(model, harmonics)
        chosen = [group for group in model.groups if self.group in (None, group.name)]
        slip = [
            group
            for group in chosen
            if self.group is not None or any(one.name == "slip" for one in group.law.switches)
        ]
        for group in slip or chosen:
            if not isinstance(group.law, Coulomb):
                raise TypeError(
                    f"{self!r}: expected friction under a constant load, the contacts "
                    f"{group.name!r} have the law {group.law!r}; symhbm.goals.Dissipation is known "
                    "of all laws"
                )

    def of(self, contact: ContactSymbols) -> Any:
        """What one contact dissipates, over its limit."""
        _, _, frequency, values = contact.at
        assert isinstance(contact.law, Coulomb)
        return super().of(contact) / contact.law.slip_limit(frequency, values)
