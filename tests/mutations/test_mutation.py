"""Changes can be made, and leave sources that Python reads."""

import ast

import pytest

from tests.mutations.mutation import ROOT, mutations_of

FILES = ["numerics/check.py", "continuation/path.py", "model/contacts/gap.py"]


@pytest.mark.parametrize("file", FILES)
def test_changes_can_be_made(file):
    path = ROOT / "symhbm" / file
    source, chosen = path.read_text(encoding="utf-8"), list(mutations_of(path))
    assert len({one.key for one in chosen}) == len(chosen) > 3
    for one in chosen[:: 1 + len(chosen) // 20]:
        changed = one.applied(source)
        assert changed != source
        ast.parse(changed)
