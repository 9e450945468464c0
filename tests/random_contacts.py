"""Random structures with contacts of mixed laws, one band through resonance each."""

import numpy as np

import symhbm as sh

KINDS = ("constant load", "varying load", "varying load, gap", "preloaded stop", "stop", "cubic")
SHARES = (0.2, 0.25, 0.15, 0.15, 0.15, 0.1)


def random_system(seed: int) -> tuple[sh.HarmonicBalance, tuple[float, float]]:
    """One to six degrees of freedom, one to four contacts, and a band around one resonance [Hz]."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 7))
    natural = 2 * np.pi * np.sort(rng.uniform(10, 60, n))
    modes = np.linalg.qr(rng.normal(size=(n, n)))[0]
    stiffness = modes @ np.diag(natural**2) @ modes.T
    damping = modes @ np.diag(2 * rng.uniform(0.004, 0.02, n) * natural) @ modes.T
    contacts = {}
    for j in range(int(rng.integers(1, 5))):
        kind = str(rng.choice(KINDS, p=SHARES))
        contacts[f"c{j}"] = _contact(rng, kind, n, natural[0] ** 2)
    model = sh.Model(np.eye(n), damping, stiffness, contacts=contacts)
    shape = dict(cosine={1: rng.normal(size=n)}, sine={1: rng.normal(size=n)})
    force = sh.forces.HarmonicForce(**shape, amplitude=10 ** rng.uniform(-0.5, 1.0))
    centre = natural[int(rng.integers(n))] / 2 / np.pi
    return sh.HarmonicBalance(model, force, (0, 1, 2, 3)), (0.6 * centre, 1.6 * centre)


def _contact(rng: np.random.Generator, kind: str, n: int, scale: float) -> sh.Contacts:
    def place() -> tuple[int, ...]:
        if n == 1 or rng.random() < 0.5:
            return (int(rng.integers(n)),)
        first, second = rng.choice(n, 2, replace=False).tolist()
        return first, second

    tangential, normal = place(), place()
    stiffness, press = scale * rng.uniform(0.1, 1, 2)
    friction, load, gap = rng.uniform([0.2, 0.5, 1e-4], [0.7, 5, 1e-3])
    pulls = dict(tangential=tangential, contact_stiffness=stiffness, friction_coefficient=friction)
    presses = dict(normal=normal, normal_stiffness=press)
    if kind == "constant load":
        return sh.Friction(**pulls, normal_load=load)
    if kind == "varying load":
        return sh.Friction(**pulls, **presses, normal_load=load)
    if kind == "varying load, gap":
        return sh.Friction(**pulls, **presses, gap=gap)
    if kind == "preloaded stop":
        return sh.Gap(**presses, normal_load=load)
    if kind == "stop":
        return sh.Gap(**presses, gap=gap)
    return sh.Contacts(sh.laws.CubicSpring(), tangential, cubic_stiffness=1e6 * stiffness)
