"""The mesh of an archive in its page: as pictures draw it, with what import found, or a note."""

import base64
import re
import warnings
from io import BytesIO

import matplotlib.image
import pytest
import swept_bricks

import symhbm as sh
from tests.archives import run
from tests.problems import one_blade


@pytest.fixture(scope="module")
def archive(tmp_path_factory):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        model = sh.read_structure(
            [swept_bricks.DATA / "brick8" / f"{job}.inp" for job in ("still", "waves")]
        )
    tip = f"{model.places.nodes_of('tip')[0]}:z"
    disk = sh.Sector(model, "left", "right", 6, rotation="z").with_contacts(
        joint=sh.Friction(
            tangential=(tip,), contact_stiffness=1.0, friction_coefficient=1.0, normal_load=1.0
        )
    )
    problem = sh.HarmonicBalance(disk, sh.forces.EngineOrder(2, pattern={tip: 1.0}), (1,))
    return sh.save(sh.solve(problem, 100.0), tmp_path_factory.mktemp("mesh") / "sector.nc")


def test_the_page_shows_mesh_sets_sides_contacts_and_account(archive):
    page = sh.view(sh.load(archive), archive.with_suffix(".html")).read_text(encoding="utf-8")
    image, words = re.search(
        r'<img src="data:image/png;base64,([^"]*)" alt="([^"]*)">', page
    ).groups()
    assert "22 nodes, 5 elements, 48 degrees of freedom" in words
    for label in ("left, 6 nodes", "right, 6 nodes", "held, 6", "contacts, 1"):
        assert label in words
    pixels = matplotlib.image.imread(BytesIO(base64.b64decode(image)))
    coloured = pixels[..., :3].max(axis=2) - pixels[..., :3].min(axis=2) > 0.2
    assert 0.002 < coloured.mean() < 0.5  # the side of the sector that is seen
    assert "sector of 6, 60 degrees about z" in page
    assert "<li>LOOK: nodal diameters of all modes of the program are of the other sense" in page


def test_a_structure_without_a_mesh_has_no_picture(tmp_path):
    problem = sh.HarmonicBalance(one_blade(), sh.forces.PointForce(), harmonics=(1,))
    page = sh.view(sh.solve(problem, 20.0), tmp_path / "blade.html").read_text(encoding="utf-8")
    assert "<img" not in page


def test_a_mesh_that_is_damaged_is_told(archive, tmp_path):
    dataset = sh.load(archive)
    dataset.attrs["problem"] = dataset.attrs["problem"].replace('"hexahedron"', '"cube<b>"')
    page = sh.view(dataset, tmp_path / "sector.html").read_text(encoding="utf-8")
    assert "The mesh cannot be shown: " in page
    assert "cube&lt;b&gt;" in page


def test_a_structure_has_a_page_of_its_own(tmp_path, opened):
    job = swept_bricks.DATA / "brick8" / "still.inp"
    assert run("import", job, "--output", tmp_path / "sector.nc")[0] == 0
    assert run("view", tmp_path / "sector.nc") == (0, f"{tmp_path / 'sector.html'}\n", "")
    seen = opened(tmp_path / "sector.html")
    assert seen.text("h1") == "sector.nc"
    assert (
        seen.run("[...document.querySelectorAll('h2')].filter((e) => e.offsetHeight).length") == 1
    )
    assert seen.run("document.querySelector('#mesh img').naturalWidth") > 1000
    assert "supports: 18 directions of 6 nodes" in seen.text("#mesh")
    assert not seen.wrong
    with pytest.raises(ValueError, match="expected a structure whose places have a mesh"):
        sh.view(one_blade(), tmp_path / "blade.html")


def test_browsers_draw_it(archive, opened):
    seen = opened(sh.view(sh.load(archive), archive.with_name("seen.html")))
    size = seen.run("[...document.querySelectorAll('#mesh img')].map((e) => e.naturalWidth)")
    assert len(size) == 1
    assert size[0] > 1000
    assert not seen.wrong
