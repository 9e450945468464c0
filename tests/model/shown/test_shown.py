"""What structures and problems show of themselves, in consoles and in notebooks."""

from xml.etree import ElementTree

import numpy as np
import pytest
import sectors

import symhbm as sh
from symhbm.model.shown import as_table, rows_of
from symhbm.numerics import check
from tests import designs

N = 1000
VALUES = np.linspace(1, 2, N)


def cells(html: str) -> dict[str, str]:
    """Texts of a table by their labels; its tags are closed, or it is no XML."""
    texts = ["".join(each.itertext()) for each in ElementTree.fromstring(html).iter()
             if each.tag in ("th", "td")]  # fmt: skip
    return dict(zip(texts[::2], texts[1::2], strict=True))


def many_blades():
    return sh.bladed_disk(
        N, mass=VALUES, stiffness=1e4 * VALUES, damping=0.5,
        contact_stiffness=1e6 * VALUES, friction_coefficient=0.5, normal_load=10 * VALUES,
    )  # fmt: skip


@pytest.mark.slow
def test_long_arrays_are_short_texts():
    rubs = dict(contact_stiffness=[*VALUES], friction_coefficient=0.5, normal_load=VALUES)
    damper = sh.Friction(tangential=[(i,) for i in range(N)], **rubs)
    forces = sh.forces.HarmonicForce(cosine={1: VALUES}) + sh.forces.StaticLoad(VALUES)
    places = sh.Places(range(N), ["z"] * N, label=[f"tip{i}" for i in range(N)])
    things = [many_blades(), damper, forces, places, sh.ModalDamping(VALUES)]
    things += [sh.HarmonicBalance(many_blades(), sh.forces.HarmonicForce(cosine={1: VALUES}))]
    for thing in things:
        assert len(repr(thing)) < 700
        assert len(repr(thing).splitlines()) < 12
    assert "1 .. 2 kg" in repr(things[0])
    assert "... 1000 labels" in repr(places)


def test_many_groups_are_some_lines():
    rubs = dict(contact_stiffness=1e4, friction_coefficient=0.5)
    groups = {
        f"damper{i}": sh.Friction(tangential=(i,), normal_load=1 + i, **rubs) for i in range(30)
    }
    model = sh.Model(np.eye(30), np.eye(30), 1e4 * np.eye(30), contacts=groups)
    assert len(repr(model).splitlines()) < 30
    assert "66 more parameters" in repr(model)
    assert "22 more groups" in cells(model._repr_html_())["contacts"]


def test_short_values_are_whole():
    assert repr(sh.forces.HarmonicForce(cosine={1: [1, 0]})) == (
        "HarmonicForce(cosine={1: (1.0, 0.0)}, sine={}, amplitude=1.0, mean=None)"
    )
    assert check.brief((1,)) == "(1,)"
    assert check.brief(np.arange(4)) == "[0, 1, 2, 3]"
    assert check.brief([*range(9)]) == "[0, 1, 2, ... 9 values]"
    assert check.brief({n: [n] for n in range(9)}) == "{0: [0], 1: [1], 2: [2], ... 9 entries}"
    assert check.brief(np.zeros((2, 3))) == "array of shape (2, 3)"


def test_table_of_a_problem():
    rows = cells(designs.blade((1, 3), normal_load=3)._repr_html_())
    assert rows["harmonics"] == "(1, 3)"
    assert rows["unknowns"] == "4"
    assert rows["structure"] == "1 lumped blade, 1 contact"
    assert rows["normal_load"] == "3 N"
    assert rows["natural frequencies, contacts open"] == "15.92 Hz"
    assert rows["natural frequencies, contacts stuck"] == "22.51 Hz"


@pytest.mark.parametrize("stuck", [False, True])
def test_natural_frequencies_are_those_of_the_verb(stuck):
    disk = designs.ring().model
    expected = sh.natural_modes(disk, count=4, stuck=stuck).frequency.values
    words = "stuck" if stuck else "open"
    text = dict(rows_of(disk))[f"natural frequencies, contacts {words}"]
    assert text == ", ".join(f"{value:.4g}" for value in expected) + ", ... Hz"


def test_what_takes_time_is_left_out():
    rows = dict(rows_of(many_blades()))
    assert not any("natural" in label for label in rows)


def test_no_frequencies_where_they_have_no_meaning():
    """Of what turns, of sectors, of gyroscopic motions."""
    eye, turn = np.eye(2), np.array([[0.0, 1.0], [-1.0, 0.0]])
    turning = sh.RotatingModel(
        sh.Model(eye, eye, 1e4 * eye), stiffness={0: 1e4 * eye, 600: 2e4 * eye}
    )
    sector = sectors.random_disk(5, True)
    for structure in (turning, sector, sh.Model(eye, eye + turn, 1e4 * eye)):
        rows = cells(structure._repr_html_())
        assert not any("natural" in label for label in rows)
        assert rows["structure"].startswith(f"{structure.n_dof} degree")


def test_frequencies_of_motions_that_have_mass():
    """A mass on two springs one behind the other."""
    spring = [[1e4, -1e4], [-1e4, 2e4]]
    rows = cells(sh.Model(np.diag([1.0, 0.0]), np.eye(2), spring)._repr_html_())
    assert rows["natural frequencies, contacts open"] == f"{np.sqrt(5e3) / (2 * np.pi):.4g} Hz"


def test_remarks_of_structures_that_were_made_of_others():
    eye, next_to = np.eye(12), np.eye(12, k=1) + np.eye(12, k=-1)
    damper = sh.Contacts(
        sh.laws.Coulomb(), [(0,)], contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3
    )
    whole = sh.Model(eye, 0.1 * eye, 1e4 * (2 * eye - next_to), contacts={"tip": damper})
    condensed = sh.condense(whole, sh.forces.PointForce(place=0), (5, 20), progress=False)
    reduced = sh.craig_bampton(whole, 5, (5, 20))
    for structure, word in ((condensed, "kept of 12"), (reduced, "reduced from 12")):
        assert word in repr(structure)
        assert word in cells(structure._repr_html_())[""]


def test_texts_are_escaped():
    html = as_table("<i>", [("<script>", "a & b")])
    assert "<script>" not in html
    assert "<i>" not in html
    assert cells(html) == {"<script>": "a & b"}
