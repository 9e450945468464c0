"""OP4 files of Nastran, where pyYeti is installed."""

import sys

import pytest
import rods

import symhbm as sh


def test_without_pyyeti_it_says_what_to_install(tmp_path, monkeypatch):
    (tmp_path / "rod.op4").write_bytes(b"")
    monkeypatch.setitem(sys.modules, "pyyeti.nastran", None)
    with pytest.raises(ImportError, match=r"pip install symhbm\[nastran\]"):
        sh.read_structure(tmp_path / "rod.op4")


@pytest.mark.parametrize("binary", [True, False])
@pytest.mark.parametrize("form", ["bigmat", "nonbigmat", "dense"])
def test_op4(tmp_path, binary, form):
    op4 = pytest.importorskip("pyyeti.nastran.op4")
    path = tmp_path / "rod.op4"
    held = dict(zip(("maa", "baa", "kaa"), rods.matrices(), strict=True))
    op4.write(str(path), {k: m.tocoo() for k, m in held.items()}, sparse=form, binary=binary)
    assert rods.same(rods.read(path))
    model = rods.read(path, names={"mass": "MAA", "damping": "BAA"})
    assert rods.same(model)
    rods.halved(path)
    with pytest.raises(ValueError, match="truncated, damaged, or no OP4 file") as caught:
        sh.read_structure(path)
    assert "\n" not in str(caught.value)
    path.write_text("no matrices")
    with pytest.raises(ValueError, match="no OP4 file"):
        sh.read_structure(path)
