"""What users of finite-element sectors run: rings of many degrees of freedom and contacts."""

import warnings
from typing import Any, NamedTuple

import click
import numpy as np
import scipy.sparse as sp
from scipy.linalg import lu_factor

import symhbm as sh
from tests.benchmarks.clock import cpu, repeated
from tests.benchmarks.table import Table, ratio, seconds

N_SECTORS, ORDER, BAND = 20, 3, (142.0, 156.0)
"""The band [Hz] begins below the resonance of the engine order, where shrouds begin to slip."""


class Ring(NamedTuple):
    """A ring of ``n_nodes`` nodes a sector with planar contacts at ``n_contacts`` of them each."""

    n_nodes: int
    n_contacts: int
    harmonics: tuple[int, ...]
    points: int

    def problem(self) -> sh.HarmonicBalance:
        """The ring, condensed to displacements of its contacts."""
        model, force = self.model(), self.force()
        given = model, force, BAND, self.harmonics
        small = sh.condense(*given, keep="displacements", progress=False)
        return sh.HarmonicBalance(small, force, self.harmonics)

    def model(self) -> sh.Model:
        """Blades of bars that bend both ways, alike but for 2 % of their stiffness."""
        size, rng = 3 * self.n_nodes, np.random.default_rng(1)
        scatter = 1 + 0.02 * rng.standard_normal(N_SECTORS)
        parts = sp.block_diag([share * self._chain() + self._rest() for share in scatter])
        to_next = np.eye(N_SECTORS) - np.roll(np.eye(N_SECTORS), 1, axis=1)
        roots = sp.diags_array(5e5 * (np.arange(size) < 3))
        joined = sp.kron(to_next.T @ to_next, roots)
        mass = 0.05 * 20 / self.n_nodes * sp.eye_array(parts.shape[0])
        damping = sh.RayleighDamping(2.0, 2e-6)
        stiffness = sp.csc_array(parts + joined)
        return sh.Model(mass, damping, stiffness, contacts={"shroud": self._shroud()})

    def force(self) -> sh.forces.HarmonicForce:
        """A wave of the engine order upon the tips."""
        size, lag = 3 * self.n_nodes, 2 * np.pi * ORDER / N_SECTORS * np.arange(N_SECTORS)
        cosine, sine = np.zeros((2, N_SECTORS * size))
        cosine[size - 3 :: size], sine[size - 3 :: size] = np.cos(lag), np.sin(lag)
        return sh.forces.HarmonicForce(cosine={1: cosine}, sine={1: sine}, amplitude=2.0)

    def _chain(self) -> sp.csc_array:
        """Springs from node to node in each direction."""
        n = self.n_nodes
        ones = np.ones(n - 1)
        difference = sp.diags_array([-ones, ones], offsets=[0, 1], shape=(n - 1, n))
        along = difference.T @ difference * (n / 20)
        return sp.csc_array(sp.kron(along, sp.diags_array([2e6, 3e6, 6e6])))

    def _rest(self) -> sp.csc_array:
        """What holds the root, and what couples the directions of a node."""
        root = np.zeros(3 * self.n_nodes)
        root[:3] = 4e6, 4e6, 8e6
        coupling = (
            4e5 / self.n_nodes * np.array([[2, -0.5, -0.5], [-0.5, 2, -0.5], [-0.5, -0.5, 2]])
        )
        whole = sp.diags_array(root) + sp.kron(sp.eye_array(self.n_nodes), coupling)
        return sp.csc_array(whole)

    def _shroud(self) -> sh.Contacts:
        """Planar contacts of the outer nodes with those of the next blade, pressed across."""
        size = 3 * self.n_nodes
        nodes = self.n_nodes - 1 - 2 * np.arange(self.n_contacts)
        first = (size * np.arange(N_SECTORS)[:, None] + 3 * nodes).ravel()
        second = (size * (np.arange(1, N_SECTORS + 1) % N_SECTORS)[:, None] + 3 * nodes).ravel()
        along, normal, across = (
            list(zip((first + k).tolist(), (second + k).tolist(), strict=True)) for k in range(3)
        )
        return sh.Friction(
            tangential=along, across=across, normal=normal, contact_stiffness=2e4,
            normal_stiffness=4e4, friction_coefficient=0.3, normal_load=2.0,
        )  # fmt: skip


CASES = {
    "60 degrees of freedom, 120 contacts, (0, 1)": Ring(20, 6, (0, 1), 20),
    "60 degrees of freedom, 40 contacts, (0, 1, 2, 3)": Ring(20, 2, (0, 1, 2, 3), 12),
    "690 degrees of freedom, 120 contacts, (0, 1)": Ring(230, 6, (0, 1), 20),
}


def elements() -> list[Table]:
    """The first points of curves of rings as finite elements make them."""
    header = ["each of 20 sectors", "unknowns", "condensing", "points", "events", "linear solves"]
    header += ["per point", "per solve", "LAPACK", "solve / LAPACK"]
    caption = (
        "**Rings of finite elements**, mistuned, condensed to the displacements of planar contacts "
        "under a load that varies: the first points from "
        f"{BAND[0]:g} Hz on, with all events and peaks between them. LAPACK is one factorisation "
        "of a full matrix of the size."
    )
    table = Table(caption, header)
    for case, ring in CASES.items():
        made = cpu(ring.problem)
        problem, size = made.result, made.result.n_unknowns + 1
        options: dict[str, Any] = dict(max_points=ring.points, keep=["amplitude"])
        options |= dict(stability=False, progress=False)

        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="the curve is incomplete")  # as it is meant
            sh.frf(problem, BAND, **(options | {"max_points": 2}))  # compiles
            timed = cpu(lambda p=problem, o=options: sh.frf(p, BAND, **o))
        names = ("n_points", "n_events", "linear_solves")
        points, events, solves = (int(timed.result[name]) for name in names)
        square = np.eye(size) + np.random.default_rng(0).random((size, size))
        lapack = repeated(lambda a=square: lu_factor(a, check_finite=False), calls=2)
        each = timed.seconds / points, timed.seconds / solves
        click.echo(f"{case}: {seconds(each[0])} a point", err=True)
        row = [case, str(problem.n_unknowns), seconds(made.seconds), str(points), str(events)]
        row += [str(solves), *map(seconds, each), seconds(lapack), ratio(each[1] / lapack)]
        table.rows.append(row)
    return [table]
