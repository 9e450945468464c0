"""All kinds of data, and the curves that measurements of a test are on."""

from collections.abc import Sequence

import numpy as np

from symhbm.balance import HarmonicBalance
from symhbm.design.identification.kinds.curve import Curve, Members
from symhbm.design.identification.kinds.modes import ModeCurve
from symhbm.design.identification.kinds.peaks import PeakCurve
from symhbm.design.identification.kinds.responses import ResponseCurve
from symhbm.design.identification.observations import Rows

_KINDS: dict[str, type[Curve]] = {
    form: kind for kind in (ResponseCurve, PeakCurve, ModeCurve) for form in kind.forms
}
"""The kind of each form of measurements."""


def curves_of(
    problem: HarmonicBalance, rows: Rows, names: Sequence[str], alike: bool
) -> list[Curve]:
    """The curves of all measurements; ``names`` are parameters that a fit changes.

    ``alike`` tells that it changes them of all sectors together.
    """
    settings = rows.settings(problem)
    for name in dict.fromkeys(name for one in settings for name in one):
        if name in names:
            raise ValueError(
                f"unknown[{name!r}]: expected a parameter that is not given with the data"
            )
    kinds = [_KINDS[form] for form in rows.form.tolist()]
    keys = [
        (*setting.items(), rows.sweep[i], kind, kind.asked(rows, i)[0])
        for i, (setting, kind) in enumerate(zip(settings, kinds, strict=True))
    ]
    curves = []
    for key in dict.fromkeys(keys):
        numbers = np.array([i for i, one in enumerate(keys) if one == key])
        setting = settings[numbers[0]]
        under = problem.with_parameters(**setting)
        curves.append(kinds[numbers[0]].of(Members(rows, numbers, under, setting, names, alike)))
    return curves
