"""What a release depends on: known vulnerabilities, and licences that it may not stand beside."""

import json
from pathlib import Path

from tests.release.installation import fresh, run

REFUSED = ("AGPL", "Affero", "non-commercial", "Proprietary")
"""Words of licences that a library under BSD-3-Clause must not ask its users to accept."""
LICENCES = """
import importlib.metadata, json
def told(one):
    about = one.metadata
    kinds = [kind.split(" :: ")[-1] for kind in about.get_all("Classifier") or ()
             if kind.startswith("License ::")]
    lines = (about.get("License") or "").splitlines()
    return about.get("License-Expression") or ", ".join(kinds) or "".join(lines[:1]) or "unknown"
every = importlib.metadata.distributions()
print(json.dumps({f"{one.metadata['Name']}=={one.version}": told(one) for one in every}))
"""


def licences(python: Path, folder: Path) -> dict[str, str]:
    """The licence of each package of an environment, by ``name==version``."""
    return json.loads(run([python, "-c", LICENCES], folder))


def refused(found: dict[str, str]) -> list[str]:
    """Packages whose licence is unknown, or none that users of the library should have to take."""
    wrong = [(name, words) for name, words in found.items() if words == "unknown"]
    wrong += [(n, words) for n, words in found.items() if any(word in words for word in REFUSED)]
    return [f"{name}: {words}" for name, words in wrong]


def check_dependencies(python: Path, folder: Path) -> str:
    """Audit an environment; SystemExit for a known vulnerability or a licence that is refused."""
    found = licences(python, folder)
    own = ("symhbm", "pip", "setuptools")
    found = {name: words for name, words in found.items() if name.split("==")[0] not in own}
    if wrong := refused(found):
        raise SystemExit("licences to look at:\n" + "\n".join(wrong))
    wanted = folder / "requirements.txt"
    wanted.write_text("\n".join(sorted(found)) + "\n", encoding="utf-8")
    tools = fresh(folder / "audit", ["pip-audit"])
    run([tools, "-m", "pip_audit", "--no-deps", "--disable-pip", "-r", wanted], folder)
    rows = (f"{name}: {words}" for name, words in sorted(found.items(), key=str))
    return "\n".join(["no known vulnerability in", *rows])
