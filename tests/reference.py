"""Values to check against, each with its source in `data/reference/README.md`."""

import json
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parent.parent / "data" / "reference"


def _values(name: str) -> dict[str, Any]:
    return json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))


EXACT = _values("exact_values")
PRESSED = _values("varying_normal_load")["cases"]
STATED = _values("stated_values")
CASES = _values("published_cases")
