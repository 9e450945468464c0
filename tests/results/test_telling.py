"""One account of a dataset: what the command line prints, pages write."""

import re
from html import unescape

import pytest

import symhbm as sh
from symhbm.results.telling import account, as_text
from symhbm.results.telling.words import Words
from tests.problems import one_blade


@pytest.fixture(scope="module")
def response():
    stop = sh.Gap(normal=(0,), normal_stiffness=2e4, gap=1e-3)
    model = sh.Model([[1.0]], [[2.0]], [[1e4]], contacts={"stop": stop})
    problem = sh.HarmonicBalance(model, sh.forces.PointForce(amplitude=15.0), (0, 1, 2, 3))
    return sh.frf(problem, (15, 18), over={"gap": [1e-3, 2e-3]}, progress=False)


def test_pages_tell_the_account_of_the_command_line(response, tmp_path):
    text = sh.view(response, tmp_path / "stop.html").read_text(encoding="utf-8")
    told = [unescape(each) for each in re.findall(r"<dd>([^<]*)</dd>", text)]
    rows = [row for _, section in account(response, digits=8) for row in section]
    assert [label.strip() for label, _ in rows[:4]] == [
        "title",
        "made by",
        "reference",
        "structure",
    ]
    # The meaning of a parameter stands behind its value.
    assert all(
        said.startswith(" ".join(text.split())) for (_, text), said in zip(rows, told, strict=True)
    )
    assert any(said.startswith("swept, 2 values: 0.001, 0.002 m (") for said in told)


def test_numbers_have_the_digits_that_are_asked_for(response):
    short, long = (
        dict(row for _, section in account(response, digits=n) for row in section) for n in (3, 8)
    )
    top = float(response.amplitude.max())
    assert short["largest response"].startswith(f"{top:.3g} m (")
    assert long["largest response"].startswith(f"{top:.8g} m (")


def test_contact_laws_and_parameters_are_told(response):
    text = as_text(response)
    assert re.search(r"^contact laws +stop: UnilateralSpring$", text, re.MULTILINE)
    assert re.search(r"^  gap +swept, 2 values: 0.001, 0.002 m$", text, re.MULTILINE)


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (3.00034, 0.0021, "3.0003 ± 0.0021"),
        (1e4, 12.3, "10000 ± 12"),
        (1e4, 1234.0, "(1.00 ± 0.12)e+04"),
        (3.08e-4, 1.2e-6, "(3.080 ± 0.012)e-04"),
        (-2.5, 0.0999, "-2.50 ± 0.10"),
        (5.123456789, 9.0, "5.12346"),
        (5.123456789, float("nan"), "5.12346"),
        (0.0, 0.1, "0"),
    ],
)
def test_numbers_are_told_to_the_second_digit_of_their_error(response, value, error, text):
    assert Words(response).within(value, error) == text


def test_peaks_have_the_error_of_truncation():
    problem = sh.HarmonicBalance(one_blade(), sh.forces.PointForce())
    found = sh.frf(problem, (12, 28), accuracy=1e-2, progress=False)
    peak, error = found.peak_amplitude.item(), found.peak_truncation_error.item()
    told = re.search(r"highest peak +\(([\d.]+) ± ([\d.]+)\)e-04 m", as_text(found))
    assert told is not None
    assert float(told[2]) * 1e-4 == pytest.approx(error * peak, rel=0.05)
    assert abs(float(told[1]) * 1e-4 - peak) < 0.05 * error * peak
