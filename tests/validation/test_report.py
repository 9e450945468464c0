"""The quick report: what passes, what was made wrong, and that both files tell it alike."""

from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

from studies import fig07_nodal_diameters as fig07
from tests.validation import of_studies, paper
from tests.validation.__main__ import main
from tests.validation.comparison import Verdict, compared, computed, missing

WRONG = "a resonance that is made wrong"


@pytest.fixture(scope="module")
def outcome(tmp_path_factory):
    """Exit code, output, folder and texts of all pages, where one landmark is wrong."""
    folder, landmarks, pages = tmp_path_factory.mktemp("report"), fig07.landmarks, []

    def one_wrong(dataset):
        first, *others = landmarks(dataset)
        moved = replace(first, name=WRONG, expected=first.computed * (1 + 2 * first.tolerance) + 1)
        return [moved, *others]

    class Watched(paper.PdfPages):
        def savefig(self, figure=None, **options):
            super().savefig(figure, **options)
            page = figure.axes[0]
            ends = [text.get_window_extent() for text in page.texts]
            pages.append((figure.bbox, [text.get_text() for text in page.texts], ends))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(fig07, "landmarks", one_wrong)
        patch.setattr(paper, "PdfPages", Watched)
        given = ["--quick", "--output", str(folder), fig07.NAME]
        done = CliRunner().invoke(main, given)
    return done, folder, pages


@pytest.mark.slow
def test_one_wrong_landmark_is_told_first(outcome):
    done, folder, pages = outcome
    assert done.exit_code == 1
    failed = [line for line in done.stderr.splitlines() if line.startswith("FAILED: ")]
    assert len(failed) == 1
    assert WRONG in failed[0]
    html = (folder / "validation.html").read_text(encoding="utf-8")
    first, rest = html.split("<h2>Scope</h2>")
    assert WRONG in first
    assert WRONG in rest
    assert "1 of " in first.split("</p>")[0]
    assert rest.count("<strong>FAILED</strong>") == 1
    # On paper it is on the first page, and again in its part.
    texts = [" ".join(texts) for _, texts, _ in pages]
    told = [number for number, text in enumerate(texts) if "made wrong" in text]
    assert told[0] == 0
    assert len(told) == 2
    assert "comparisons FAILED" in texts[0]


@pytest.mark.slow
def test_pages_are_numbered_and_nothing_leaves_them(outcome):
    _, folder, pages = outcome
    assert (folder / "validation.pdf").read_bytes().startswith(b"%PDF")
    for number, (sheet, texts, ends) in enumerate(pages, 1):
        assert f"page {number} of {len(pages)}" in texts
        for text, box in zip(texts, ends, strict=True):
            assert not text or box.x0 >= 0, text
            assert box.x1 <= sheet.x1, text
            assert box.y0 >= 0, text
            assert box.y1 <= sheet.y1, text


@pytest.mark.slow
def test_what_the_quick_report_holds(outcome):
    done, folder, _ = outcome
    html = (folder / "validation.html").read_text(encoding="utf-8")
    parts = (
        "Contact force",
        "Published frequencies, modes and cycles",
        "Programs of others",
        "Linear structure",
    )
    for words in (*parts, "What is not covered", "CPU time", "casadi", "NLvib"):
        assert words in html
    assert "0 passed, 1 FAILED" not in done.stdout
    assert set(of_studies.QUICK) < set(of_studies.chosen(quick=False))


@pytest.mark.parametrize(
    ("found", "expected", "verdict"),
    [
        (1.0 + 1e-7, 1.0, Verdict.PASSED),
        (1.0 + 1e-5, 1.0, Verdict.FAILED),
        (np.nan, 1.0, Verdict.FAILED),
        ([1.0, np.nan], [1.0, 1.0], Verdict.FAILED),
        ([1.0], [1.0, 1.0], Verdict.FAILED),
        ([], [], Verdict.FAILED),
        (1e-300, 0.0, Verdict.FAILED),
        (0.0, 0.0, Verdict.PASSED),
    ],
)
def test_verdicts(found, expected, verdict):
    assert compared("x", found, expected, 1e-6, "s").verdict is verdict


@pytest.mark.slow
def test_errors_fail_and_missing_programs_do_not():
    def wrong():
        raise ArithmeticError("no number")

    part = computed("title", "words", wrong)
    assert part.count(Verdict.FAILED) == 1
    assert part.rows[0].found == "ArithmeticError: no number"
    assert missing("what", "source", "why").verdict is Verdict.MISSING
