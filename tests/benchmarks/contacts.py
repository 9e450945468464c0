"""Contacts that slip, open and close: located events beside samples, and beside pyHarm."""

from functools import partial

import numpy as np

import symhbm as sh
from symhbm.model.contacts import Motions, graph_of
from symhbm.numerics import Compiled, FourierBasis
from tests.benchmarks.clock import repeated
from tests.benchmarks.programs import MissingError, optional
from tests.benchmarks.table import Table, ratio, seconds

LAW = sh.laws.VariableLoadFriction()
NUMBERS, HIGHEST = (1, 13, 100), (1, 3, 5, 9)
FEW, MANY, CONVERGED = 256, 4096, 2**16
"""Samples of a period: the usual number, one for an error of 1e-3, and what no longer counts."""
VALUES = dict(
    contact_stiffness=1.0, normal_stiffness=1.0, friction_coefficient=0.5, normal_load=0.3
)


PEER_CASES = {
    "preload 2 N, stays closed": dict(preload=2.0, gap=0.0),
    "preload 0.5 N, opens": dict(preload=0.5, gap=0.0),
    "touches without preload": dict(preload=0.0, gap=0.0),
    "gap 0.5 m": dict(preload=0.0, gap=0.5),
}
"""Of a contact with springs of 1 N/m and a friction coefficient of 0.5."""
PEER_MOTION = np.array([0.0, 3.0, 0.0, 0.5, 0.0, 0.0, 0.0, 1.0, 0.3, 0.0])
"""Tangential and normal displacement, harmonics 0 to 2 [m]."""


def motions_of(basis: FourierBasis, n: int) -> np.ndarray:
    """Motions (n, 2 K) of contacts that slip, and mostly open."""
    drawn = np.random.default_rng(0).normal(size=(20 * n, 2 * basis.n_components))
    drawn /= (1 + np.tile(basis.order, 2)) ** 2
    slips, _, touches = LAW.locate(Motions(basis, drawn, 1.0, values_of(len(drawn)))).states.T
    return drawn[slips & touches][:n]


def values_of(n: int, given: dict[str, float] = VALUES) -> dict[str, np.ndarray]:
    """The same contact so many times."""
    return {name: np.full(n, value) for name, value in given.items()}


def located(basis: FourierBasis, motions: np.ndarray, given: dict[str, float] = VALUES):
    """A call that evaluates force and Jacobian as a balance does."""
    n, values = len(motions), values_of(len(motions), given)
    force = Compiled(graph_of(LAW, basis).force.map(n))
    packed = np.array([values[name] for name in LAW.parameters]).T.ravel()
    travel, frequency = np.abs(motions).ravel(), np.ones(n)

    def evaluate():
        events = LAW.locate(Motions(basis, motions, 1.0, values)).events
        return force(motions.ravel(), travel, frequency, packed, events.ravel())

    return evaluate


def whole(basis: FourierBasis, force: np.ndarray) -> np.ndarray:
    """Coefficients (n, 2 K) of forces with the preload that the equilibrium holds."""
    force = force.reshape(-1, 2 * basis.n_components).copy()
    force[:, basis.n_components] += VALUES["normal_load"]
    return force


def contacts() -> list[Table]:
    """Force and Jacobian of contacts, per contact, and how wrong samples are."""
    names = [f"{FEW} samples", f"{FEW} in runs", f"{MANY} samples", f"{MANY} in runs"]
    ratios = [f"located / {names[0]}", f"located / {names[1]}"]
    caption = (
        "**Contacts that slip, open and close**: CPU time per contact of the force and its exact "
        "Jacobian, located as a balance evaluates them, and marched over samples in loops "
        "compiled by numba. *Samples*: force and Jacobian added up sample by sample, the sample "
        "at which the slider came to rest remembered. *In runs*: the least that sampling takes, "
        "from sums before each sample of the functions and their products. In brackets the error "
        "of the worst force coefficient of these random motions over the largest coefficient."
    )
    table = Table(caption, ["contacts", "harmonics", "located", *names, *ratios])
    try:
        pressing = optional("pressing")
    except MissingError as error:
        table.remarks.append(str(error))
        return [table]
    farthest = 0.0
    for highest in HIGHEST:
        basis = FourierBasis(tuple(range(highest + 1)))
        tables = {n: pressing.samples_of(basis, n) for n in (FEW, MANY, CONVERGED)}
        for n in NUMBERS:
            motions = motions_of(basis, n)
            ours = located(basis, motions)
            exact = whole(basis, ours()[0])
            values = np.column_stack([values_of(n)[name] for name in VALUES])
            force, slope = np.empty(motions.shape), np.empty((*motions.shape, motions.shape[1]))
            at = motions, values, force, slope
            pressing.by_runs(tables[CONVERGED], *at)
            farthest = max(farthest, np.abs(force - exact).max() / np.abs(exact).max())
            calls = max(200 // n, 4)
            times, cells = [repeated(ours, calls) / n], []
            for samples in (FEW, MANY):
                for loop in (pressing.by_samples, pressing.by_runs):
                    call = partial(loop, tables[samples], *at)
                    call()
                    wrong = np.abs(force - exact).max() / np.abs(exact).max()
                    times.append(repeated(call, calls) / n)
                    cells.append(f"{seconds(times[-1])} ({wrong:.0e})")
            both = [ratio(times[0] / times[k]) for k in (1, 2)]
            row = [str(n), f"0 to {highest}", seconds(times[0]), *cells, *both]
            table.rows.append(row)
    table.remarks.append(f"Over {CONVERGED} samples the largest error is {farthest:.0e}.")
    return [table]


def penalty() -> list[Table]:
    """The law of pyHarm: where it is the same as here, and where it is not."""
    errors = [f"error of {force}, {n} samples" for force in ("T", "N") for n in (FEW, MANY)]
    caption = (
        "**The law `Penalty3D` of pyHarm** beside the one of this library: differences of the "
        "force coefficients of one motion over the largest, tangential and normal. They fall with "
        "the number of samples where both laws are the same. CPU time of one force with its "
        "Jacobian."
    )
    header = ["contact", *errors, f"pyHarm, {FEW} samples", "located", "pyHarm / located"]
    table = Table(caption, header)
    try:
        peer = optional("peer_penalty")
    except MissingError as error:
        table.remarks.append(str(error))
        return [table]
    basis, size = FourierBasis((0, 1, 2)), len(PEER_MOTION) // 2
    springs = {name: value for name, value in VALUES.items() if name != "normal_load"}
    for case, given in PEER_CASES.items():
        load = given["preload"] - springs["normal_stiffness"] * given["gap"]
        ours = located(basis, PEER_MOTION[None], springs | dict(normal_load=load))
        exact, wrong = ours()[0], []
        for samples in (FEW, MANY):
            force, _ = peer.force_of(basis, springs | given, samples)(PEER_MOTION)
            wrong.append(np.abs(force - exact).reshape(2, size).max(axis=1) / np.abs(exact).max())
        theirs = peer.force_of(basis, springs | given, FEW)
        times = repeated(lambda call=theirs: call(PEER_MOTION), 20), repeated(ours)
        cells = [f"{error:.0e}" for error in np.transpose(wrong).ravel()]
        table.rows.append([case, *cells, *map(seconds, times), ratio(times[0] / times[1])])
    return [table]
