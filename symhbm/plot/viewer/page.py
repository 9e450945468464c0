"""One page of HTML: style, scripts, data, and a policy that runs nothing else."""

import base64
import hashlib
import json
import re
from html import escape
from pathlib import Path
from typing import Any

_HERE = Path(__file__).parent
_SCRIPTS = ("data.js", "states.js", "charts.js", "page.js")
"""Our own scripts, which are one in the page."""
_EMPTY = re.compile(
    r"<section>(<details><summary>)?<h2>[^<]*</h2>(</summary>)?\s*"
    r"(</details>|<details><summary>[^<]*</summary>\s*</details>)?</section>\n?"
)
"""Sections of which a page has nothing to show."""


def plotting_library() -> str:
    """The script of plotly; ImportError that names what to install where it is missing."""
    try:
        from plotly.offline import get_plotlyjs
    except ImportError as error:
        raise ImportError(
            "symhbm view needs plotly, which is not installed; "
            "pip install 'symhbm[view]' installs it"
        ) from error
    return get_plotlyjs()


def page_of(title: str, sections: list[tuple[str, str]], data: dict[str, Any]) -> str:
    """The page: ``sections`` are texts of HTML by their names, ``data`` what the scripts draw."""
    library = plotting_library()
    own = "\n".join((_HERE / name).read_text(encoding="utf-8") for name in _SCRIPTS)
    style = (_HERE / "page.css").read_text(encoding="utf-8")
    body = (_HERE / "page.html").read_text(encoding="utf-8")
    for name, text in sections:
        body = body.replace(f"<!-- {name} -->", text, 1)
    body = _EMPTY.sub("", body)
    policy = (
        f"default-src 'none'; script-src {_hash(library)} {_hash(own)}; "
        "style-src 'unsafe-inline'; img-src data: blob:; base-uri 'none'; form-action 'none'"
    )
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta name="color-scheme" content="light dark">\n'
        '<link rel="icon" href="data:,">\n'
        f"<title>{escape(title)}</title>\n<style>\n{style}</style>\n</head>\n<body>\n{body}\n"
        f'<script type="application/json" id="data">{embedded(data)}</script>\n'
        f"<script>{library}</script>\n<script>{own}</script>\n</body>\n</html>\n"
    )


def _hash(script: str) -> str:
    """What the policy calls a script that may run."""
    digest = hashlib.sha256(script.encode("utf-8")).digest()
    return f"'sha256-{base64.b64encode(digest).decode('ascii')}'"


def embedded(data: Any) -> str:
    """JSON that may stand inside of any element of a page."""
    text = json.dumps(data, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    for sign in "<>&":
        text = text.replace(sign, f"\\u{ord(sign):04x}")
    return text
