"""Structures whose contacts have normal loads that move, for tests of motions in time."""

from typing import Any

import numpy as np

import symhbm as sh
from symhbm.time_domain.exact_motion import ExactMotion, exact_motion
from tests.reference import PRESSED

TURN = 2 * np.pi
CASES = {case["name"]: case for case in PRESSED}


def structure(mass, damping, stiffness, force, tangential, normal, preload="balanced", **values):
    """The balance of a structure with these contacts; negative loads are those of gaps."""
    load = np.asarray(values.pop("normal_load"), dtype=float)
    if np.any(load < 0):
        values["gap"] = -load / values["normal_stiffness"]
    else:
        values["normal_load"] = load
    law = sh.laws.VariableLoadFriction("gap" if "gap" in values else "normal_load", preload)
    contacts = {"shroud": sh.Contacts(law, tangential, normal, **values)}
    model = sh.Model(mass, damping, stiffness, contacts=contacts)
    return sh.HarmonicBalance(model, force, range(4))


def two_way(preload="balanced", **values):
    """One mass that moves in both directions of a contact to the ground."""
    given = dict(
        contact_stiffness=1e4, normal_stiffness=1e4, friction_coefficient=0.3, normal_load=5.0
    )
    force = sh.forces.HarmonicForce(cosine={1: [10, 0]}, sine={1: [0, 10]})
    parts = np.eye(2), np.diag([2.0, 3.0]), np.diag([1e4, 2.25e4])
    return structure(*parts, force, [(0,)], [(1,)], preload, **given | values)


def shroud(tangential=(0,), normal=(1,), **values):
    """A contact that rubs and opens, under a load of 4 N."""
    given = dict(contact_stiffness=1e4, normal_stiffness=2e4, friction_coefficient=0.4)
    return sh.Friction(
        tangential=tangential, normal=normal, **given | {"normal_load": 4.0} | values
    )


def pressed_mass(**values):
    """One mass that moves in both directions of a shroud, which its stiffness couples."""
    matrices = np.eye(2), np.diag([2.0, 3.0]), np.array([[1e4, 1e3], [1e3, 2.25e4]])
    return sh.Model(*matrices, contacts={"shroud": shroud(**values)})


def stop(mass, damping, stiffness, force, normal_stiffness, normal_load=None, gap=None):
    """The balance of one mass with a stop, a contact without friction, in its direction."""
    given = {"normal_load": normal_load} if gap is None else {"gap": gap}
    law = sh.laws.UnilateralSpring(*given)
    contacts = {"stop": sh.Contacts(law, [(0,)], normal_stiffness=normal_stiffness, **given)}
    model = sh.Model([[mass]], [[damping]], [[stiffness]], contacts=contacts)
    return sh.HarmonicBalance(model, force, range(4))


def gap_stop(**given):
    """The stop that has three motions, under preload."""
    force = sh.forces.HarmonicForce(cosine={1: [5]})
    return stop(1, 2, 1e4, force, 2e4, **(given or {"normal_load": 10.0}))


def two_blades():
    """Two blades that move in both directions of the contact between them."""
    force = sh.forces.HarmonicForce(cosine={1: [10, 5, 0, 0]}, sine={1: [0, 0, 10, -5]})
    parts = np.eye(4), np.diag([2.0, 3, 2, 3]), np.diag([1e4, 2.25e4, 1.04e4, 2.3e4])
    values = dict(
        contact_stiffness=1e4, normal_stiffness=2e4, friction_coefficient=0.4, normal_load=4.0
    )
    return structure(*parts, force, [(0, 2)], [(1, 3)], **values)


def inclined(preload="balanced", **values):
    """One mass on a line at 30 degrees to the contact: ``u = x cos, v = x sin``.

    Along the line: ``k_t cos^2``, ``k_n sin^2``, ``mu cos / sin``, and ``N0 sin``.
    """
    given = dict(
        contact_stiffness=1e4, normal_stiffness=1e4, friction_coefficient=0.5, normal_load=5.0
    )
    given |= values
    cos, sin = np.cos(np.pi / 6), 0.5
    shares = cos**2, sin**2, cos / sin, sin
    along = {name: share * given[name] for name, share in zip(given, shares, strict=True)}
    force = sh.forces.HarmonicForce(cosine={1: [10]})
    return structure([[1]], [[2]], [[1e4]], force, [(0,)], [(0,)], preload, **along)


def reference(case):
    """The structure of one of the cases of `CASES`."""
    directions = [[np.array(contact[key]) for contact in case["contacts"]] for key in "tn"]
    ends = [[(*np.flatnonzero(w > 0), *np.flatnonzero(w < 0)) for w in each] for each in directions]
    pairs = [[tuple(map(int, pair)) for pair in each] for each in ends]
    wave = np.array(case["force"]["1"])
    force = sh.forces.HarmonicForce(cosine={1: wave[:, 0]}, sine={1: -wave[:, 1]})
    keys = dict(
        contact_stiffness="kt", normal_stiffness="kn", friction_coefficient="mu", normal_load="N0"
    )
    values = {name: [contact[key] for contact in case["contacts"]] for name, key in keys.items()}
    return structure(case["M"], case["C"], case["K"], force, *pairs, **values)


def solved(problem: sh.HarmonicBalance, hertz: float, start: Any = None) -> ExactMotion:
    """The exact motion, which must have been found."""
    motion = exact_motion(problem, TURN * hertz, start)
    assert motion.converged, motion.status
    return motion


def random_structure(seed: int) -> tuple[sh.HarmonicBalance, float]:
    """Up to 6 degrees of freedom and contacts of all laws, and a frequency [Hz]."""
    rng = np.random.default_rng(seed)
    n_dof, contacts = int(rng.integers(1, 7)), {}
    spread = rng.normal(size=(n_dof, n_dof))
    stiffness = 1e4 * (np.diag(rng.uniform(0.5, 2, n_dof)) + 0.2 * spread @ spread.T / n_dof)

    def places():
        ends = [rng.permutation(n_dof)[: int(rng.integers(1, 3))] for _ in range(n_contacts)]
        return [tuple(map(int, each)) for each in ends]

    for name in ("first", "second", "third")[: int(rng.integers(1, 4))]:
        n_contacts, law = int(rng.integers(1, 3)), rng.integers(4)
        values = dict(normal_stiffness=10 ** rng.uniform(3, 5, n_contacts))
        friction = dict(
            contact_stiffness=10 ** rng.uniform(3, 5, n_contacts),
            friction_coefficient=rng.uniform(0.1, 2, n_contacts),
        )
        values["gap"] = rng.normal(size=n_contacts) * 10 ** rng.uniform(-5, -3, n_contacts)
        values["gap"] *= rng.random(n_contacts) < 0.9
        preload = ("balanced", "coupled")[int(rng.integers(2))]
        if law == 0:
            load = 10 ** rng.uniform(-1, 1, n_contacts)
            contacts[name] = sh.Contacts(sh.laws.Coulomb(), places(), **friction, normal_load=load)
        elif law == 1:
            contacts[name] = sh.Contacts(
                sh.laws.UnilateralSpring("gap", preload), places(), **values
            )
        else:
            tangential = places()
            normal = tangential if rng.random() < 0.3 else places()
            pressed = sh.laws.VariableLoadFriction("gap", preload)
            contacts[name] = sh.Contacts(pressed, tangential, normal, **friction, **values)
    model = sh.Model(
        np.diag(rng.uniform(0.5, 2, n_dof)),
        np.diag(rng.uniform(0.1, 3, n_dof)),
        stiffness,
        contacts=contacts,
    )
    cosine = {n: 5 * rng.normal(size=n_dof) for n in (0, 1, 2) if n == 1 or rng.random() < 0.3}
    force = sh.forces.HarmonicForce(cosine=cosine, sine={1: 5 * rng.normal(size=n_dof)})
    return sh.HarmonicBalance(model, force, range(6)), float(rng.uniform(8, 35))
