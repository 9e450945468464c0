"""Structures whose contacts have normal loads that move, for tests of motions in time."""

import json
from pathlib import Path
from typing import Any

import numpy as np

import symhbm as sh
from symhbm.time_domain.exact_motion import ExactMotion, exact_motion

TURN = 2 * np.pi
FILE = Path(__file__).parent.parent / "data" / "reference" / "varying_normal_load.json"
CASES = {case["name"]: case for case in json.loads(FILE.read_text())["cases"]}


def structure(mass, damping, stiffness, force, tangential, normal, preload="balanced", **values):
    """The balance of a structure with these contacts; negative loads are those of gaps."""
    load = np.asarray(values.pop("normal_load"), dtype=float)
    if np.any(load < 0):
        values["gap"] = -load / values["normal_stiffness"]
    else:
        values["normal_load"] = load
    law = sh.VariableLoadFriction("gap" if "gap" in values else "normal_load", preload)
    contacts = {"shroud": sh.Contacts(law, tangential, normal, **values)}
    model = sh.Model(mass, damping, stiffness, contacts=contacts)
    return sh.HarmonicBalance(model, force, range(4))


def two_way(preload="balanced", **values):
    """One mass that moves in both directions of a contact to the ground."""
    given = dict(
        contact_stiffness=1e4, normal_stiffness=1e4, friction_coefficient=0.3, normal_load=5.0
    )
    force = sh.HarmonicForce(cosine={1: [10, 0]}, sine={1: [0, 10]})
    parts = np.eye(2), np.diag([2.0, 3.0]), np.diag([1e4, 2.25e4])
    return structure(*parts, force, [(0,)], [(1,)], preload, **given | values)


def gap_stop(**values):
    """One mass with a preloaded stop, a contact without friction."""
    given = dict(
        contact_stiffness=0.0, normal_stiffness=2e4, friction_coefficient=0.0, normal_load=10.0
    )
    force = sh.HarmonicForce(cosine={1: [5]})
    return structure([[1]], [[2]], [[1e4]], force, [(0,)], [(0,)], **given | values)


def two_blades():
    """Two blades that move in both directions of the contact between them."""
    force = sh.HarmonicForce(cosine={1: [10, 5, 0, 0]}, sine={1: [0, 0, 10, -5]})
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
    force = sh.HarmonicForce(cosine={1: [10]})
    return structure([[1]], [[2]], [[1e4]], force, [(0,)], [(0,)], preload, **along)


def reference(case):
    """The structure of one of the cases of `CASES`."""
    directions = [[np.array(contact[key]) for contact in case["contacts"]] for key in "tn"]
    ends = [[(*np.flatnonzero(w > 0), *np.flatnonzero(w < 0)) for w in each] for each in directions]
    pairs = [[tuple(map(int, pair)) for pair in each] for each in ends]
    wave = np.array(case["force"]["1"])
    force = sh.HarmonicForce(cosine={1: wave[:, 0]}, sine={1: -wave[:, 1]})
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
