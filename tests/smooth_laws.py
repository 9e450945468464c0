"""Contact laws of an expression, and two masses that one of them joins."""

import casadi as ca
import numpy as np

import symhbm as sh

GAP = {"k": (3e4, "N/m"), "g": (3e-4, "m")}


def beyond(y, v, p):
    return y - p["g"]


def rubbing(y, v, p):
    """Friction that grows with the load of a gap: two directions."""
    load = p["k"] * ca.fmax(y[1] - p["g"], 0)
    return load * ca.vertcat(0.3 * ca.tanh(v[0] / p["e"]), 1)


LAWS = {
    "dashpot": (lambda y, v, p: p["c"] * v, {"c": (3, "N s/m")}, ()),
    "spring": (lambda y, v, p: p["k5"] * y**5, {"k5": (1e13, "N/m^5")}, ()),
    "rounded": (
        lambda y, v, p: p["F"] * ca.tanh(v / p["e"]),
        {"F": (3, "N"), "e": (0.1, "m/s")},
        (),
    ),
    "drag": (
        lambda y, v, p: p["c"] * v * ca.fabs(v),
        {"c": (3, "N s2 m-2")},
        lambda y, v, p: v,
    ),
    "gap": (lambda y, v, p: p["k"] * ca.fmax(y - p["g"], 0), GAP, beyond),
    "hertz": (
        lambda y, v, p: p["k"] * ca.fmax(y - p["g"], 0) ** 1.5,
        {"k": (3e6, "1"), "g": (3e-4, "m")},
        beyond,
    ),
    "magnet": (
        lambda y, v, p: -p["b"] / (p["g"] - y) ** 2,
        {"b": (1e-3, "N m2"), "g": (2e-2, "m")},
        (),
    ),
    "rubbing": (rubbing, GAP | {"e": (0.1, "m/s")}, lambda y, v, p: y[1] - p["g"]),
}


def group_of(name, **values):
    expression, parameters, breakpoints = LAWS[name]
    parameters = {k: (values.get(k, entry[0]), *entry[1:]) for k, entry in parameters.items()}
    directions = {"along": [(0,)], "across": [(1,)]} if name == "rubbing" else [(0, 1)]
    return sh.laws.SmoothLaw(expression, parameters, directions, breakpoints)


def problem_of(group, harmonics=(0, 1, 2, 3), amplitude=2.0, **others):
    contacts = {"own": group, **others}
    stiffness = [[1e4, -1e3], [-1e3, 2e4]]
    model = sh.Model(np.eye(2), np.diag([2.0, 3.0]), stiffness, contacts=contacts)
    return sh.HarmonicBalance(model, sh.forces.PointForce(amplitude=amplitude), harmonics)
