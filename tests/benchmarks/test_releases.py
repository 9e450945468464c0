"""Ratios over releases are those of the page, and are drawn release by release."""

import pytest

from tests.benchmarks import releases

TABLES = """
Measured on a machine; Python 3.11, symhbm 0.2.0, numpy 2.

**One blade**, in words.

| load | time | a / b | b / c |
| --- | --- | --- | --- |
| 1 | 3 ms | 2.0 | - |
| 2 | 4 ms | 8.0 | 5.0 |

**Ring**

| case | a / b |
| --- | --- |
| all | 0.5 |
"""


def test_geometric_means_of_columns():
    version, ratios = releases.ratios_in(TABLES)
    assert version == "0.2.0"
    assert ratios == {"One blade: a / b": 4.0, "One blade: b / c": 5.0, "Ring: a / b": 0.5}
    with pytest.raises(ValueError, match="expected the version"):
        releases.ratios_in("**One blade**")


def test_the_history_holds_what_the_page_says():
    """``python -m tests.benchmarks --write`` makes both."""
    version, ratios = releases.ratios_in(releases.PAGE.read_text(encoding="utf-8"))
    assert len(ratios) > 15
    assert releases.history()[version] == ratios


def test_releases_are_drawn_beside_each_other():
    first = {"One blade: a / b": 4.0, "Ring: a / b": 2.0}
    figure = releases.drawn({"0.1.0": first, "0.2.0": first | {"Ring: a / b": 0.5}})
    [ax] = figure.axes
    marks = [scatter.get_offsets().tolist() for scatter in ax.collections]
    assert marks == [[[4.0, 1.0], [2.0, 0.0]], [[4.0, 1.0], [0.5, 0.0]]]
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["0.1.0", "0.2.0"]
