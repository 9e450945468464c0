"""Archives that hold anything: nothing of them is executed, and the page says what it lacks."""

import re

import numpy as np
import pytest

import symhbm as sh
from tests.problems import ring_of_blades
from tests.quick import quick_first

SCRIPT = "<script>window.hacked = 1</script><img src=x onerror='window.hacked = 2'>"
ATTACKS = (
    SCRIPT,
    "</script><script>window.hacked = 3</script>",
    "</title></style><svg onload=window.hacked=4>",
    '"><a href="javascript:window.hacked=5">x</a><b onmouseover=window.hacked=6>',
    "<!-- peaks --> %{x} ${window.hacked = 7} {{constructor}} \u202e\u0000 $\\frac{1}{2}$",
)
PROBLEM = sh.HarmonicBalance(
    ring_of_blades(3, contact_stiffness=1e6, normal_load=10),
    sh.forces.EngineOrder(1),
)  # fmt: skip
ALL = "".join(ATTACKS)


@pytest.fixture(scope="module")
def response():
    draws = sh.mistuning.uniform(PROBLEM.model, 3, seed=1, contact_stiffness=0.1)
    return sh.frf(PROBLEM, (100, 300), over=draws, progress=False)


def with_texts(response):
    """Every text of the archive is an attack, and so are its labels."""
    hostile = response.copy(deep=True)
    hostile = hostile.assign_coords(sample=[f"{k}{text}" for k, text in enumerate(ATTACKS[:3])])
    for name in ("peak_kind", "event_kind", "status"):
        values = hostile[name].values
        values[values != ""] = ALL
    for variable in hostile.variables.values():
        for key in ("long_name", "units"):
            if key in variable.attrs:
                variable.attrs[key] = ALL
    for key in ("title", "references", "symhbm_version"):
        hostile.attrs[key] = ALL
    hostile.attrs["note"] = ALL * 2000
    hostile.attrs["problem"] = hostile.attrs["problem"].replace("EngineOrder", "<b>EngineOrder")
    labels = [*(ATTACKS[:3])]
    named = hostile.assign_coords(
        node=("dof", [1, 2, 3]),
        direction=("dof", np.array(labels, dtype=object)),
        label=("dof", np.array(labels, dtype=object)),
    )
    return named.assign_coords(contact=np.array(labels, dtype=object))


def test_texts_run_nothing(response, look, tmp_path):
    seen = look(sh.view(with_texts(response), tmp_path / "texts.html", name=ALL))
    assert (
        seen.trace("points")[0]["x"]
        == response.frequency.values[0][: int(response.n_points[0])].tolist()
    )
    seen.hover(
        float(response.frequency[0, 5]), 20 * np.log10(response.amplitude[0, 5].max().item())
    )
    seen.choose("dim-0", 1)
    seen.choose("place", 2)
    seen.page.locator("button.go").first.click()
    for summary in seen.page.locator("summary").all():
        summary.click()
    for link in seen.page.locator("a[href]").all():
        assert "javascript" not in (link.get_attribute("href") or "")
    assert seen.run("window.hacked === undefined")
    assert (
        seen.run("[...document.querySelectorAll('main img, main script, svg [onload]')].length")
        == 0
    )
    assert "window.hacked = 1" in seen.text("#status")


@pytest.mark.slow
def test_the_policy_of_the_page_stops_scripts_that_got_in(response, look, tmp_path):
    path = sh.view(response.isel(sample=0), tmp_path / "policy.html")
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("</main>", f"{SCRIPT}</main>"), encoding="utf-8")
    seen = look(path)
    assert seen.run("window.hacked === undefined")
    # The browser says that it refused both.
    assert seen.wrong
    assert all("Content Security Policy" in each or "file:" in each for each in seen.wrong)
    seen.wrong.clear()
    seen.asked.clear()


def nothing_known(response):
    unknown = response.copy(deep=True)
    for variable in unknown.variables.values():
        if variable.dtype.kind == "f" and variable.ndim:
            variable.values[...] = np.nan
    return unknown


def infinite(response):
    endless = response.copy(deep=True)
    endless["amplitude"].values[:, ::3] = np.inf
    endless["peak_amplitude"].values[...] = np.inf
    endless["event_frequency"].values[...] = -np.inf
    return endless


def wrong_types(response):
    wrong = response.copy(deep=True)
    for name in ("amplitude", "peak_amplitude", "contact_state", "residual_norm"):
        wrong[name] = wrong[name].astype(str).astype(object)
    wrong["event_contact"] = wrong["event_contact"].astype(float) + 0.5
    wrong.attrs["problem"] = "[1, 2"
    wrong.attrs["swept"] = '{"a": 3}'
    return wrong


def other_dimensions(response):
    return response.rename(point="place").drop_vars("status")


def without_points(response):
    return response.isel(point=slice(0), peak=slice(0), event=slice(0))


def without_attributes(response):
    return response.assign_attrs(problem="{}", followed="{}").drop_vars("frequency")


BROKEN = [
    wrong_types, infinite, without_points, nothing_known, other_dimensions, without_attributes,
    lambda response: response.drop_vars(list(response.variables)).assign_attrs(response.attrs),
]  # fmt: skip


@pytest.mark.parametrize("broken", quick_first(BROKEN, 1))
def test_pages_of_broken_archives_say_what_they_lack(broken, response, look, tmp_path):
    seen = look(sh.view(broken(response), tmp_path / "broken.html"))
    body = seen.text("body")
    assert "What this page leaves out" in body
    assert len(body) < 40_000
    said = re.search(r"cannot be shown|not on the page|no peaks|0 of 0|not shown|unbounded", body)
    assert said, body[:2000]


@pytest.mark.slow
def test_long_texts_are_cut(response, tmp_path):
    long = response.copy(deep=True)
    long.attrs["note"] = "x" * 10_000_000
    long["status"].values[0] = "y" * 10_000_000
    path = sh.view(long, tmp_path / "long.html")
    assert path.stat().st_size < 6e6
    assert "10000000 characters in all" in path.read_text(encoding="utf-8")
