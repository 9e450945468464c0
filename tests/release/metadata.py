"""What pyproject.toml, CHANGELOG.md and README.md say of a version."""

import re
import tomllib
from pathlib import Path

from packaging.requirements import Requirement

ROOT = Path(__file__).parent.parent.parent


def project(root: Path = ROOT) -> dict:
    """The table `[project]` of pyproject.toml."""
    return tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def lowest(root: Path = ROOT) -> list[str]:
    """Each dependency at its lower bound, as constraints of pip: ``numpy==2.0.0``."""
    pins = []
    for line in project(root)["dependencies"]:
        requirement = Requirement(line)
        (bound,) = (one.version for one in requirement.specifier if one.operator == ">=")
        pins.append(f"{requirement.name}=={bound}")
    return pins


def disagreements(root: Path = ROOT) -> list[str]:
    """Where CITATION.cff, the recipe or CHANGELOG.md tell of another version than the project."""
    version = project(root)["version"]
    cited = re.search(r"^version: (.*)$", (root / "CITATION.cff").read_text("utf-8"), re.MULTILINE)
    found = []
    if cited is None or cited[1] != version:
        found.append(f"CITATION.cff: expected version: {version}, got {cited and cited[1]}")
    recipe = (root / "docs" / "release" / "recipe.yaml").read_text("utf-8")
    if f'version: "{version}"' not in recipe:
        found.append(f'docs/release/recipe.yaml: expected version: "{version}"')
    headings = re.findall(r"^## (.*)$", (root / "CHANGELOG.md").read_text("utf-8"), re.MULTILINE)
    if not headings or not re.fullmatch(rf"{re.escape(version)} - \d{{4}}-\d\d-\d\d", headings[0]):
        found.append(
            f"CHANGELOG.md: expected the first heading '## {version} - YYYY-MM-DD', "
            f"got '## {headings[0] if headings else ''}'"
        )
    return found


def quick_start(readme: str) -> tuple[str, list[str]]:
    """The script of the first study in README.md, and the commands below it."""
    code = re.search(r"```python\n(.*?)```", readme, re.DOTALL)
    assert code, "README.md: expected a block of Python"
    commands = re.findall(r"^symhbm [^#\n]*", readme[code.end() :], re.MULTILINE)
    return code[1], [command.strip() for command in commands]


def for_an_index(readme: str, repository: str | None) -> str:
    """README.md for a page that has no files beside it.

    Its links lead into the repository. Without the address of one, pictures go and words stay.
    """
    target = r"\((?!https?:|#)([^)\s]+)\)"
    if repository is None:
        readme = re.sub(rf"!\[[^\]]*\]{target}\n*", "", readme)
        return re.sub(rf"\[([^\]]+)\]{target}", r"\1", readme)
    files = f"{repository.rstrip('/')}/raw/HEAD"
    readme = re.sub(rf"(!\[[^\]]*\]){target}", rf"\1({files}/\2)", readme)
    pages = f"{repository.rstrip('/')}/blob/HEAD"
    return re.sub(rf"(\[[^\]]+\]){target}", rf"\1({pages}/\2)", readme)
