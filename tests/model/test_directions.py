"""Directions of contacts: pairs of places, weights, arrays, and what reads them."""

from typing import ClassVar

import matplotlib.pyplot as plt
import numpy as np
import pytest
import scipy.sparse as sp

import symhbm as sh
from symhbm.model.contacts import Weights
from tests.problems import Coupled
from tests.refusals import refused

FRICTION = dict(contact_stiffness=8e3, friction_coefficient=0.4, normal_load=2.0)


def matrices(n, seed=0):
    rng = np.random.default_rng(seed)
    chain = 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    mass = np.eye(n) + np.diag(0.3 * rng.random(n))
    return mass, 0.4 * mass + 1e-5 * 1e4 * chain, 1e4 * chain + 3e3 * np.eye(n)


PAIRS = [(0, 2), (3,)]
SAME = {
    "weights": [{0: 1.0, 2: -1.0}, {3: 1}],
    "turned round": [{2: -1, 0: 1}, {3: np.float64(1)}],
    "array": np.array([[1.0, 0, -1, 0], [0, 0, 0, 1]]),
    "integers": np.array([[1, 0, -1, 0], [0, 0, 0, 1]]),
    "sparse": sp.coo_array(np.array([[1.0, 0, -1, 0], [0, 0, 0, 1]])),
    "places of another model": (Weights((0, 2), (1.0, -1.0)), (3,)),
}


@pytest.mark.parametrize("given", SAME.values(), ids=SAME)
def test_pairs_and_weights_are_the_same_contact(given):
    """To the bit: directions, residual, Jacobian."""
    one, other = (
        sh.Model(*matrices(4), contacts={"a": sh.Contacts(sh.laws.Coulomb(), each, **FRICTION)})
        for each in (PAIRS, given)
    )
    short = sh.Model(*matrices(4), contacts=given, **FRICTION)
    unknowns = 1e-3 * np.random.default_rng(1).normal(size=12)
    for model in (other, short):
        assert model.touched == {0, 2, 3}
        np.testing.assert_array_equal(model.directions.toarray(), one.directions.toarray())
        found, expected = (
            sh.HarmonicBalance(m, sh.forces.PointForce(), (0, 1)).evaluate(unknowns, 90.0)
            for m in (model, one)
        )
        np.testing.assert_array_equal(found.residual, expected.residual)
        assert found.magnitude == expected.magnitude


def test_pairs_stay_as_they_were():
    """What old programs and archives read."""
    model = sh.Model(*matrices(4), contacts=PAIRS, **FRICTION)
    assert model.contacts == ((0, 2), (3,))
    named = sh.Contacts(Coupled(), [(0,), (0, 1)], [(1,), (2,)], hardening=1.0)
    model = sh.Model(*matrices(4), contacts={"corner": named})
    assert model.contacts == (((0,), (1,)), ((0, 1), (2,)))
    assert sh.Model(*matrices(4), contacts=SAME["array"], **FRICTION).contacts == tuple(PAIRS)


def test_one_contact_may_stand_alone():
    for alone in ((0, 2), (1,), {0: 0.5}, {0: 0.3, 1: -2.0, 3: 1.0}):
        group = sh.Contacts(sh.laws.Coulomb(), alone, **FRICTION)
        assert len(group) == 1
        model, listed = (
            sh.Model(*matrices(4), contacts={"a": sh.Contacts(sh.laws.Coulomb(), each, **FRICTION)})
            for each in (alone, [alone])
        )
        assert model.contacts == listed.contacts
    weighted = model.contacts[0]
    assert (weighted.dofs, weighted.weights) == ((0, 1, 3), (0.3, -2.0, 1.0))
    assert repr(weighted) == "{0: 0.3, 1: -2.0, 3: 1.0}"
    again = sh.Contacts(sh.laws.Coulomb(), weighted, **FRICTION)
    assert again.directions["tangential"].ends == (weighted,)


def test_directions_by_name():
    """In the order of the law or by name, in any order."""
    across, tangential = [{2: 0.5, 3: -0.5}], [(0, 1)]
    forms = [
        sh.Contacts(Coupled(), tangential, across, hardening=1e8),
        sh.Contacts(Coupled(), across=across, hardening=1e8, tangential=tangential),
        sh.Contacts(Coupled(), tangential, across=across[0], hardening=1e8),
        sh.Contacts(
            Coupled(), tangential=tangential[0], across=np.array([[0, 0, 0.5, -0.5]]), hardening=1e8
        ),
    ]
    models = [sh.Model(*matrices(4), contacts={"corner": group}) for group in forms]
    for model in models:
        assert model.contacts == models[0].contacts
        assert model.groups.row_ends == ((0, 1), Weights((2, 3), (0.5, -0.5)))


@pytest.mark.parametrize("n", [4, 30])
def test_pictures_draw_weighted_contacts(n):
    contacts = {
        "rub": sh.Contacts(sh.laws.Coulomb(), [{0: 0.2, 1: -0.9, 3: 0.4}, {2: 0.5}], **FRICTION)
    }
    figure = sh.plot.model(sh.Model(*matrices(n), contacts=contacts))
    (ax,) = figure.axes
    assert "weights of 2 displacements of contacts" in ax.get_xlabel().replace("\n", " ")
    if n > 16:
        labels = [text.get_text() for text in ax.get_legend().get_texts()]
        assert {"friction damper between, 1", "friction damper to the ground, 1"} <= {*labels}
    plt.close(figure)


FLAT = "expected \\(first, second\\)"


class Clash(Coupled):
    parameters: ClassVar = {"across": sh.laws.Parameter("N", "a load")}

    def force_at(self, displacement, frequency, values):
        return values["across"] * displacement


class Twice(Coupled):
    directions = ("across", "across")


def rubbing(given):
    return sh.Contacts(sh.laws.Coulomb(), given, **FRICTION)


def inside(given):
    return sh.Model(*matrices(4), contacts={"a": rubbing(given)})


def corner(*given, law=Coupled, **named):
    return sh.Contacts(law(), *given, **named, hardening=1.0)


ONE = [(0,)]
test_wrong_directions_say_what_is_expected = refused([
    *((lambda given=given: rubbing(given), error, words) for given, error, words in (
        ([0, 2], TypeError, rf"tangential\[0\]=0: {FLAT}.* or weights"),
        (np.array([1.0, -1.0]), TypeError, rf"tangential=.*{FLAT}"),
        ([[0, 2]], TypeError, rf"tangential\[0\]=\[0, 2\]: {FLAT}"),
        ([np.array([1.0, -1])], TypeError, rf"tangential\[0\]=.*{FLAT}"),
        (np.array([[0, 2]]), TypeError, "list\\(map\\(tuple, array\\)\\)"),
        ((0, 1, 2), ValueError, "one or two DOFs, or a mapping"),
        ((0.5, -0.5), ValueError, "tangential=0.5: expected an integer"),
        ({}, ValueError, "tangential={}: expected weights that are not 0"),
        ({0: 1.0, 1: 0.0}, ValueError, "expected weights that are not 0"),
        (np.array([[1.0, 0, 0], [0, 0, 0]]), ValueError, r"tangential\[1\]: .*not all 0"),
        ((2, 2), ValueError, "joins two different DOFs"),
        ({0: np.nan}, ValueError, r"tangential\[0\]=nan: expected values finite"),
        (np.array([[1.0, np.nan, 0]]), ValueError, r"entry \[0, 1\] is not"),
        (sp.csr_array([[1.0, np.inf, 0]]), ValueError, "tangential=.*finite"),
        ((True, 0), TypeError, "tangential=True: expected an integer"),
        ({0: True}, TypeError, r"tangential\[0\]=True: expected real numbers"),
        ({True: 1.0}, TypeError, "degree of freedom=True"),
        (np.array([[True, False, True]]), TypeError, "tangential=.*real numbers"),
        ({0: 1j}, TypeError, r"tangential\[0\]=1j"),
        ({"0": 1.0}, TypeError, "degree of freedom='0'"),
        ({-1: 1.0}, ValueError, "degree of freedom=-1"),
        (np.zeros((1, 2, 3)), TypeError, "or an array \\(n, n_dof\\)"),
        (3, TypeError, "tangential=3: expected a sequence"),
    )),
    (lambda: inside({0: 1.0, 4: 0.5}),
     ValueError, r"contacts\['a'\], tangential\[0\]=4: expected an integer from 0 to 3"),
    (lambda: inside([(0,), (1, 4)]), ValueError, r"contacts\['a'\], tangential\[1\]=4"),
    (lambda: inside(np.eye(3)),
     ValueError, r"contacts\['a'\], tangential: expected an array of 4 columns .*, got 3"),
    (lambda: corner(ONE, ONE, across=ONE), TypeError, "across: expected once"),
    (lambda: corner(across=ONE), ValueError, "tangential, across, got 1"),
    (lambda: corner(ONE, ONE, ONE), ValueError, "tangential, across, got 3"),
    (lambda: sh.Contacts(sh.laws.Coulomb(), ONE, radial=ONE, **FRICTION),
     KeyError, "'radial' is no parameter"),
    (lambda: sh.Contacts(Clash(), ONE, across=ONE),
     ValueError, "'across' names a direction and a parameter"),
    (lambda: corner(ONE, ONE, law=Twice), ValueError, "'across' names two directions"),
])  # fmt: skip
