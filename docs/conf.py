"""How the site is built from these pages: ``sphinx-build -W -n -b html docs build/site``.

Nothing is fetched, neither by the build nor by a browser that shows its pages.
"""

import os
import sys
from importlib.metadata import version as version_of
from pathlib import Path

DOCS = Path(__file__).resolve().parent
# The notebooks run with the package of this folder, too.
os.environ["PYTHONPATH"] = os.pathsep.join(
    [str(DOCS.parent), *filter(None, [os.environ.get("PYTHONPATH")])]
)
sys.path[:0] = [str(DOCS.parent), str(DOCS / "extensions")]

project = "symhbm"
author = "the symhbm authors"
copyright = author  # noqa: A001
version = release = version_of("symhbm")

extensions = [
    "myst_nb",
    "sphinx_design",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.intersphinx",
    "sphinx.ext.viewcode",
    "docstrings",
    "gallery",
    "mathml",
    "reference",
    "sources",
]
exclude_patterns = ["extensions", "inventories", "static", "release", "paper.md"]
nitpicky = True

myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_heading_anchors = 4

nb_execution_mode = "force"
nb_execution_in_temp = True
nb_execution_raise_on_error = True
nb_execution_timeout = 300
nb_output_stderr = "remove"
"""Bars of progress; a test looks for anything else."""
autosummary_generate = False
autodoc_typehints_format = "short"
autodoc_member_order = "groupwise"
default_role = "py:obj"
maximum_signature_line_length = 88
toc_object_entries_show_parents = "hide"

PAGES = {
    "casadi": "https://web.casadi.org/",
    "matplotlib": "https://matplotlib.org/stable/",
    "numpy": "https://numpy.org/doc/stable/",
    "pandas": "https://pandas.pydata.org/docs/",
    "python": "https://docs.python.org/3/",
    "scipy": "https://docs.scipy.org/doc/scipy/",
    "xarray": "https://docs.xarray.dev/en/stable/",
}
intersphinx_mapping = {
    name: (page, str(DOCS / "inventories" / f"{name}.inv")) for name, page in PAGES.items()
}
"""Inventories are lists of the few names that are needed, so that nothing is fetched."""

html_theme = "pydata_sphinx_theme"
html_title = "symhbm"
html_math_renderer = "mathml"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_copy_source = False
ALONE = (
    "theory",
    "trust",
    "extending",
    "architecture",
    "benchmarks",
    "changelog",
    "glossary",
    "validation",
    "getting-started",
    "contributing",
    "releasing",
)
html_sidebars = {page: [] for page in ALONE}
html_theme_options = {
    "header_links_before_dropdown": 7,
    "navigation_with_keys": False,
    "show_toc_level": 2,
    "footer_start": ["copyright"],
    "footer_end": [],
}
