"""Formulas as MathML."""

import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parent.parent.parent / "docs" / "extensions"))

from mathml import MathError, mathml


def test_an_accent_stays_on_its_letter():
    """By itself docutils centres the index below the letter."""
    written = mathml(r"\hat f_j")
    assert "munderover" not in written
    assert written.index("msub") < written.index("mover") < written.index(">j<")


def test_names_of_functions_have_space():
    assert 'rspace="0.17em">cos<' in mathml(r"a_n \cos n\theta")


def test_unknown_commands_raise():
    with pytest.raises(MathError, match="frobnicate"):
        mathml(r"\frobnicate x")
