"""Random problems to identify, by their number: structures, contacts, unknowns, levels."""

from typing import Any, NamedTuple

import numpy as np

import symhbm as sh
from tests.measurements import measured_responses
from tests.problems import one_blade, ring_of_blades
from tests.problems import problem as catalogued

N_PROBLEMS = 40
_RINGS = 22
"""Problems of lumped blades; others are of the catalogue of structures and laws."""
_ONE_OF_PRODUCT = 0.85
"""Share of problems in which only one of load and friction coefficient may be unknown."""
_HARMONICS = [(1,), (1, 3), (1, 3, 5), (1, 3, 5, 7), (1, 3, 5, 7, 9)]
_CELLS = [
    *("coulomb blade point 13", "coulomb chain point 1", "coulomb rotor point 13"),
    *("coulomb sector order 1", "planar blade point 1", "planar chain point 13"),
    *("planar sector order 13", "planar rotor point 1", "varying blade point 0123"),
    *("varying chain point 0123", "varying blade static 0123", "pressed blade point 0123"),
    *("varying sector order 0123", "pressed blade static 0123", "stop blade static 0123"),
    *("coulomb mistuned order 1", "coulomb condensed point 13", "varying rotor point 0123"),
]


class RandomFit(NamedTuple):
    """A problem with the ``true`` values of its unknowns, the problem to start from, and data."""

    problem: sh.HarmonicBalance
    start: sh.HarmonicBalance
    true: dict[str, float]
    data: Any


def random_fit(number: int) -> RandomFit:
    """The problem of a number, whose start is off by a factor of 3 in each unknown."""
    rng = np.random.default_rng(1000 + number)
    levels = np.array([0.5, 1.0, 3.0])
    if number < _RINGS:
        n_blades = int(rng.choice([1, *range(3, 14)]))
        contact = float(np.exp(rng.uniform(np.log(3e3), np.log(3e4))))
        given = dict(damping=rng.uniform(1, 4), contact_stiffness=contact)
        given["normal_load"] = rng.uniform(1, 5)
        model = one_blade(**given) if n_blades == 1 else ring_of_blades(n_blades, **given)
        engine_order = n_blades > 1 and rng.random() < 0.6
        order = int(rng.integers(1, n_blades // 2 + 1)) if engine_order else 0
        force: Any = sh.forces.EngineOrder(order) if engine_order else sh.forces.PointForce()
        harmonics = _HARMONICS[int(rng.integers(0, 5 if engine_order or n_blades < 4 else 2))]
        problem = sh.HarmonicBalance(model, force, harmonics)
        top = 16.0 * np.sqrt(1 + (4 if n_blades > 1 else 1) * contact / 1e4) * 1.15
        frequencies = np.linspace(13.0, top, 24)
        pool = ["contact_stiffness", "normal_load", "friction_coefficient", "damping", "mass"]
    else:
        problem = catalogued(_CELLS[number - _RINGS])
        frequencies = np.linspace(17.0, 36.0, 16)
        own = problem.model.groups.owners
        pool = [name for name in own if np.size(problem.parameters[name])]
        pool = [name for name in pool if np.all(problem.parameters[name] > 0)]
    if rng.random() < _ONE_OF_PRODUCT:  # of a constant load only the product is seen
        one = str(rng.choice(["friction_coefficient", "normal_load"]))
        pool = [name for name in pool if name != one]
    n_unknown = min(int(rng.integers(1, 5)), len(pool))
    names = sorted(rng.choice(pool, n_unknown, replace=False).tolist())
    true = {name: float(np.ravel(problem.parameters[name])[0]) for name in names}
    off = {name: value * 3.0 ** rng.choice([-1, 1]) for name, value in true.items()}
    place = (
        0 if problem.model.kept is not None else int(rng.integers(0, min(3, problem.model.n_dof)))
    )
    levels *= problem.excitation.amplitude
    data = measured_responses(problem, levels, frequencies, place=place)
    return RandomFit(problem, problem.with_parameters(**off), true, data)
