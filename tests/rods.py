"""A rod of nodes with three directions, and the files that finite-element programs make of it."""

import warnings

import numpy as np
import scipy.sparse as sp

import symhbm as sh

NODES = [3, 5, 8, 13]
AXES = ["x", "y", "z"]


def matrices(n=4):
    """Mass, damping and stiffness (3 n, 3 n), which couple all directions of neighbours."""
    rng = np.random.default_rng(4)
    block = rng.normal(size=(3, 3))
    block = block @ block.T + 3 * np.eye(3)
    chain = sp.diags_array([-np.ones(n - 1), 2 * np.ones(n), -np.ones(n - 1)], offsets=[-1, 0, 1])
    neighbours = sp.diags_array(
        [np.ones(n - 1), 4 * np.ones(n), np.ones(n - 1)], offsets=[-1, 0, 1]
    )
    stiffness = sp.csc_array(sp.kron(1e7 * chain, block))
    mass = sp.csc_array(sp.kron(neighbours, 0.1 * np.eye(3)))
    return mass, 1e-5 * stiffness, stiffness


def places(n=4):
    node = np.repeat(NODES, 3)
    along = np.repeat(np.arange(n, dtype=float), 3)
    coordinates = np.column_stack([along, 0 * along, 0 * along])
    return sh.Places(node, np.tile(AXES, n), coordinates).labelled({"tip": 13})


def same(model, damping=True):
    """Whether a model has the matrices of the rod."""
    expected = dict(zip(("mass", "damping", "stiffness"), matrices(), strict=True))
    for kind, matrix in expected.items():
        if kind == "damping" and not damping:
            matrix = 0 * matrix
        given = getattr(model, f"{kind}_matrix").toarray()
        np.testing.assert_allclose(given, matrix.toarray(), rtol=1e-12, atol=0)
    return True


def read(*arguments, **options):
    """A structure that is read without a word."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return sh.read_structure(*arguments, **options)


def saved(path, **changes):
    """A file of NumPy with the matrices of the rod, and what is changed or there beside them."""
    held = dict(zip("MCK", (matrix.toarray() for matrix in matrices()), strict=True))
    np.savez(path, **(held | changes))
    return path


def halved(path, share=0.6):
    """Cut the end of a file off."""
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    return path
