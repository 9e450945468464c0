"""Nastran OUTPUT4, read by pyYeti."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from symhbm.model.files.contents import Contents, contents_of, told


def read(files: dict[str, Path], names: Mapping[str, str]) -> Contents:
    """The matrices of one file; ImportError without pyYeti."""
    try:
        from pyyeti.nastran import op4  # type: ignore[import-not-found]
    except ImportError:
        raise ImportError("reading OP4 needs pyYeti: pip install symhbm[nastran]") from None
    [path] = files.values()
    if not path.exists():
        raise FileNotFoundError(f"path={str(path)!r}: no such file")
    with told(path, "OP4 file"):
        held = dict[str, Any](op4.read(str(path), into="dct", sparse=True))  # type: ignore[arg-type]
    lower = {kind: name.lower() for kind, name in names.items()}
    return contents_of(path, held, lower)
