"""A page for every study, and thumbnails of all: ``.. gallery::`` and ``.. study:: NAME``.

Pictures, archives and landmarks are those of ``data/results``, where ``python -m studies`` writes
them. Of those that are not there the build computes the quick ones, which take no longer than
``gallery_seconds``. The others have a page without numbers, that tells the command, and the picture
of ``data/pictures`` where there is one.
"""

import re
from collections.abc import Iterable, Sequence
from importlib import import_module
from io import BytesIO
from pathlib import Path

import matplotlib.pyplot as plt
from docutils import nodes
from docutils.statemachine import StringList
from PIL import Image
from sphinx import addnodes
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from sphinx.util.docutils import SphinxDirective

import symhbm as sh
from studies.__main__ import STUDIES, statements, study
from studies.index import COLUMNS, Section, parameters
from studies.landmark import Landmark, number

FOLDER = Path("gallery", "generated")
THUMBNAIL = 720, 540
"""Largest size of a thumbnail [pixels]."""
DOTS, MARGIN = 200, 5
"""Dots per inch from which thumbnails are made, and dots around the panel that they show."""
GROUPS = {
    "Figures of the source": lambda name: name.startswith("fig"),
    "Questions around it": lambda name: not name.startswith("fig"),
}
CODE = re.compile(r"(`+)(.+?)\1")


def results(app: Sphinx) -> Path:
    """Where studies write."""
    return app.srcdir.parent / "data" / "results"


def picture(app: Sphinx, name: str) -> Path | None:
    """Return the picture of a study: the computed one, or that of the repository."""
    places = results(app), app.srcdir.parent / "data" / "pictures"
    found = [place / f"{name}.png" for place in places if (place / f"{name}.png").exists()]
    return found[0] if found else None


def section(app: Sphinx, name: str) -> Section:
    """Return what there is to say of a study; without numbers where it is not computed."""
    module = import_module(f"studies.{name}")
    archive = results(app) / f"{name}.nc"
    document = module.__doc__ or ""
    if not archive.exists():
        return Section(name, document)
    dataset = sh.load(archive)
    return Section(
        name=name,
        document=document,
        parameters=parameters(dataset),
        archive=archive.name,
        landmarks=module.landmarks(dataset),
        claims=statements(module, "claims", dataset),
        findings=statements(module, "findings", dataset),
    )


def compute(name: str, folder: Path) -> None:
    """Compute a study; an error ends the build."""
    if error := study(name, folder, say=lambda _: None).error:
        raise ExtensionError(f"studies.{name}: {error}")


def write_pages(app: Sphinx) -> None:
    """Compute quick studies, and write the pages and thumbnails of all."""
    folder = app.srcdir / FOLDER
    folder.mkdir(exist_ok=True)
    wanted = set()
    for name, seconds in STUDIES.items():
        if seconds <= app.config.gallery_seconds and not (results(app) / f"{name}.nc").exists():
            compute(name, results(app))
        title = Section(name, import_module(f"studies.{name}").__doc__ or "").title
        path, text = folder / f"{name}.rst", f"{title}\n{'=' * len(title)}\n\n.. study:: {name}\n"
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")
        wanted.add(path)
        if original := picture(app, name):
            small = folder / f"{name}.png"
            if not small.exists() or small.stat().st_mtime < original.stat().st_mtime:
                thumbnail(app, name, original).save(small)
            wanted.add(small)
    for path in {*folder.iterdir()} - wanted:
        path.unlink()


def thumbnail(app: Sphinx, name: str, original: Path) -> Image.Image:
    """Return a small picture of a study.

    Of one that was computed it is the largest panel: all of them would be hard to read.
    """
    image, archive = Image.open(original), results(app) / f"{name}.nc"
    if archive.exists():
        figure, drawn = import_module(f"studies.{name}").draw(sh.load(archive)), BytesIO()
        figure.savefig(drawn, dpi=DOTS)  # what is outside of panels finds its place now
        panel = max(figure.axes, key=lambda ax: ax.get_position().width * ax.get_position().height)
        box = panel.get_tightbbox()
        image = Image.open(drawn)
        if box is not None:
            left, low, right, high = DOTS / figure.dpi * box.padded(MARGIN).extents
            image = image.crop((left, image.height - high, right, image.height - low))
        plt.close(figure)
    image.thumbnail(THUMBNAIL)
    return image


class Gallery(SphinxDirective):
    """Thumbnails of all studies, and a hidden list of their pages."""

    def run(self) -> list[nodes.Node]:
        """Return a grid for each group."""
        lines = [".. toctree::", "   :hidden:", "", *(f"   generated/{name}" for name in STUDIES)]
        for title, belongs in GROUPS.items():
            lines += ["", f".. rubric:: {title}", "", ".. grid:: 1 1 2 2", "   :gutter: 3", ""]
            for name in filter(belongs, STUDIES):
                lines += [f"   {line}" for line in self.card(name)]
        node = nodes.section(document=self.state.document)
        self.state.nested_parse(StringList(lines, "<gallery>"), self.content_offset, node)
        return node.children

    def card(self, name: str) -> list[str]:
        """Return the lines of one card."""
        document = import_module(f"studies.{name}").__doc__ or ""
        card = [".. grid-item-card:: " + Section(name, document).title]
        card += [f"   :link: generated/{name}", "   :link-type: doc", "   :class-card: study"]
        thumbnail = self.env.srcdir / FOLDER / f"{name}.png"
        if thumbnail.exists():
            self.env.note_dependency(str(thumbnail))
            card += [f"   :img-top: generated/{name}.png", f"   :img-alt: {name}"]
            if not (results(self.env.app) / f"{name}.nc").exists():
                card += ["", "   Picture of the repository, not computed here."]
            return [*card, ""]
        return [*card, "", f"   Not computed here: some {STUDIES[name]} s.", ""]


class Study(SphinxDirective):
    """What a study is about, its pictures, numbers and code."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Return the page of a study below its title."""
        name, app = self.arguments[0], self.env.app
        self.env.note_dependency(str(results(app) / f"{name}.nc"))
        one = section(app, name)
        found = [words(text) for text in one.paragraphs]
        found += [self.figure(name, path) for path in self.pictures(name)]
        return [*found, *self.command(one), *numbers(one), *self.code(name)]

    def pictures(self, name: str) -> list[Path]:
        """Return the pictures of a study, that on the axes of the source first."""
        computed = results(self.env.app) / f"{name}_source_axes.png"
        return [path for path in (computed, picture(self.env.app, name)) if path and path.exists()]

    def figure(self, name: str, path: Path) -> nodes.figure:
        """Return a picture; one of the repository says so."""
        inside = path.relative_to(self.env.srcdir.parent)
        figure = nodes.figure()
        figure += nodes.image(uri=f"/../{inside.as_posix()}", alt=name)
        if path.parent != results(self.env.app):
            figure += nodes.caption(
                "",
                "",
                words(
                    "A picture kept in the repository: its numbers were not computed here."
                ).children[0],
            )
        elif path.stem.endswith("_source_axes"):
            figure += nodes.caption("", "On the axes of the source.")
        return figure

    def command(self, one: Section) -> list[nodes.Node]:
        """Return how to compute it, and the archive."""
        line = nodes.literal_block("", f"python -m studies.{one.name}", language="sh")
        text = words(f"Not computed where this page was made. It takes some {STUDIES[one.name]} s:")
        if one.archive:
            path = results(self.env.app) / one.archive
            version = sh.load(path).attrs["symhbm_version"]
            text = words(f"Computed by symhbm {version}; the archive, for `sh.load` or xarray: ")
            link = addnodes.download_reference(
                "", "", nodes.literal("", one.archive), reftarget=f"/../data/results/{one.archive}"
            )
            text += [
                link,
                nodes.Text(
                    f" ({path.stat().st_size / 1e6:.1f} MB). To compute it "
                    f"again takes some {STUDIES[one.name]} s:"
                ),
            ]
        return [text, line]

    def code(self, name: str) -> list[nodes.Node]:
        """Return the file of a study."""
        path = self.env.srcdir.parent / "studies" / f"{name}.py"
        self.env.note_dependency(str(path))
        return [
            nodes.rubric("", "Code"),
            nodes.literal_block("", path.read_text(encoding="utf-8"), language="python"),
        ]


def numbers(one: Section) -> Iterable[nodes.Node]:
    """Parameters, landmarks, claims of the source and findings of a study."""
    if one.parameters:
        yield nodes.rubric("", "Parameters")
        yield table(("parameter", "value"), one.parameters)
    if one.landmarks:
        yield nodes.rubric("", "Landmarks")
        yield table(COLUMNS, [cells(landmark) for landmark in one.landmarks])
    if one.claims:
        yield nodes.rubric("", "Claims of the source")
        rows = [(claim.words, claim.where, claim.computed, claim.verdict) for claim in one.claims]
        yield table(("claim", "where", "computed", "verdict"), rows)
    if one.findings:
        yield nodes.rubric("", "Findings")
        rows = [(finding.words, finding.computed) for finding in one.findings]
        yield table(("finding", "computed"), rows)


def cells(landmark: Landmark) -> tuple[str, ...]:
    """Return a landmark beside what is expected."""
    unit = f" {landmark.unit}" if landmark.unit else ""
    digits = 6 if landmark.expected else 3
    return (
        landmark.name,
        number(landmark.computed, digits) + unit,
        number(landmark.expected, digits) + unit,
        str(landmark.source),
        number(landmark.difference, 2) + (unit if landmark.expected == 0 else ""),
        landmark.verdict,
    )


def words(text: str) -> nodes.paragraph:
    """Return a paragraph, with what is between back-quotes as code."""
    paragraph = nodes.paragraph()
    for place, part in enumerate(CODE.split(text)):
        if place % 3 == 0:
            paragraph += nodes.Text(part)
        elif place % 3 == 2:
            paragraph += nodes.literal("", part)
    return paragraph


def table(columns: Sequence[str], rows: Iterable[Sequence[str]]) -> nodes.table:
    """Return a table with a head."""
    group = nodes.tgroup("", *(nodes.colspec(colwidth=1) for _ in columns), cols=len(columns))
    head, body = nodes.thead(), nodes.tbody()
    for part, lines in ((head, [columns]), (body, rows)):
        part += [nodes.row("", *(nodes.entry("", words(c)) for c in line)) for line in lines]
    group += [head, body]
    return nodes.table("", group, classes=["landmarks"])


def setup(app: Sphinx) -> dict[str, bool]:
    """Write the pages before Sphinx looks for them."""
    app.add_config_value("gallery_seconds", 3, "env", [int])
    app.add_directive("gallery", Gallery)
    app.add_directive("study", Study)
    app.connect("config-inited", lambda app, _: write_pages(app))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
