"""What a page shows of an archive: collected part by part, with a note on each that fails."""

from collections import Counter
from collections.abc import Callable, Sequence
from html import escape
from typing import Any

import numpy as np
import xarray as xr

from symhbm.plot.viewer import ensemble, motions, tables
from symhbm.plot.viewer.curves import Limits, curve_of
from symhbm.plot.viewer.packing import DIGITS, plain
from symhbm.plot.viewer.page import mesh_html, page_of
from symhbm.plot.viewer.sets import (
    Layout,
    Sets,
    blades_of,
    contact_names,
    label_of,
    layout_of,
    place_names,
    sets_of,
    spoken,
    values_of,
)
from symhbm.results.reading import COMPLETE, curve_status
from symhbm.results.telling import account, differences

_VALUES, _LINES, _PLACES = 250_000, 250_000, 600
"""Most numbers of all points, most points of all drawn lines, and most lines of a page."""
_ONE_LINE = ("title", "subtitle", "thinning")
"""Sections of a page that are one line."""
_IN_MEMORY = 2**29
"""Bytes of an archive that are read at once."""


class Collected:
    """What is collected for a page, and what it cannot show."""

    def __init__(
        self, dataset: xr.Dataset, tuned: xr.Dataset | None, name: str, share: float = 1.0
    ):
        self.dataset, self.tuned, self.name, self.share = dataset, tuned, name, share
        self.before = 0  # curves of results ahead of this one
        self.notes: list[str] = []
        self.data: dict[str, Any] = {"digits": DIGITS, "curves": [], "dims": []}
        self.data["complete"] = [*COMPLETE]
        self.chosen: dict[tuple, dict[str, int]] = {}

    def tried(self, what: str, otherwise: Any, make: Callable[..., Any], *of: Any) -> Any:
        """What is made ``of`` something, or a note on it: archives may hold anything."""
        try:
            return make(*of)
        except Exception as error:
            text = error.args[0] if error.args else type(error).__name__
            self.notes.append(f"{what} cannot be shown: {plain(text, 300)}")
            return otherwise

    def written(self) -> str:
        """The text of the page."""
        layout = self.gather()
        return page_of(f"{self.name} - symhbm", self.sections(layout), self.data)

    def gather(self) -> Layout | None:
        """Collect all, and return what is drawn over what."""
        if self.dataset.nbytes < _IN_MEMORY:
            self.dataset = self.tried("The numbers", self.dataset, self.dataset.compute)
        dataset, data = self.dataset, self.data
        layout = self.tried("Curves", None, layout_of, dataset)
        data["places"] = self.tried("The names of places", [], place_names, dataset)
        data["contacts"] = self.tried("Contacts", [], contact_names, dataset)
        data["directions"] = self.tried("Loops of contacts", [], motions.directions_of, dataset)
        if layout is not None:
            self.tried("Curves", None, self.collect, layout)
            self.tried("The ensemble", None, self.collect_ensemble, layout)
        else:
            self.tried("The motion", None, self.collect_motion)
        return layout

    def collect(self, layout: Layout) -> None:
        """Curves, their marks and their motions."""
        dataset, sets = self.dataset, sets_of(self.dataset, self.share)
        self.data["layout"] = layout.to_json()
        self.data["dims"] = [
            {
                "name": spoken(dim),
                "units": plain(dataset[dim].attrs.get("units", ""), 40) if dim in dataset else "",
                "labels": [label_of(dataset, dim, k) for k in positions],
            }
            for dim, positions in zip(sets.dims, sets.shown, strict=True)
        ]
        limits = _limits(dataset, sets, layout, self.share)
        self.data["dofs"] = list(limits.dofs)
        if sets.n_shown < sets.total:
            self.notes.append(
                f"{sets.n_shown} of {sets.total} curves are shown one by one, the highest, the "
                "middle and the lowest peak among them; tables, bands and samples are of all."
            )
        n_dof = dataset.sizes.get("dof", 0)
        if layout.panels[0].places and len(limits.dofs) < n_dof and n_dof > 1:
            self.notes.append(
                f"{len(limits.dofs)} of {n_dof} places have curves of their own, those that peak "
                "first; the largest response is that of all."
            )
        budget, missing = motions.Budget(sets.n_shown, self.share), Counter[str]()
        n_contacts = dataset.sizes.get("contact", 0)
        if budget.contacts < n_contacts:
            self.notes.append(
                f"Loops are those of {budget.contacts} of {n_contacts} contacts of each curve, "
                "which dissipate the most."
            )
        blades = self.tried("The disk", None, blades_of, dataset)
        for number, position in enumerate(sets.positions()):
            label, nothing = values_of(dataset, position), {"n": [0, 0], "failed": 0, "marks": []}
            what = f"The curve of {label or 'this archive'}"
            one = self.tried(what, dataset, dataset.isel(position).compute)
            entry = self.tried(what, nothing, curve_of, one, layout, limits)
            entry |= {"label": label, "status": self.status(position)}
            for k, mark in enumerate(entry["marks"]):
                at = *position.values(), mark["number"]
                self.chosen[mark["what"], *at] = {"curve": self.before + number, "mark": k}
            self.data["curves"].append(entry)
            if entry["marks"]:
                of = one, layout.x, entry["marks"], blades, budget
                nothing = motions.Motions({}, Counter())
                found = self.tried("Motions at peaks and events", nothing, motions.motions_at, *of)
                for k, motion in found.of.items():
                    entry["marks"][k]["motion"] = motion
                missing += found.missing
        self.notes += [
            f"{count} motions at peaks and events are not on the page: {why}."
            for why, count in missing.items()
        ]
        self.tell_thinning()

    def status(self, position: dict[str, int]) -> str:
        """Why the computation of a curve ended."""
        status = curve_status(self.dataset)
        if status is None:
            return ""
        return plain(status.isel(position).values.item(), 600)

    def tell_thinning(self) -> None:
        """A note on the points that are not on the page."""
        shown = sum(entry["n"][0] for entry in self.data["curves"])
        total = sum(entry["n"][1] for entry in self.data["curves"])
        failed = sum(entry["failed"] for entry in self.data["curves"])
        text = f"All {total} points of these curves are on the page."
        if not total:
            text = "The archive holds no points of these curves."
        if shown < total:
            text = (
                f"{shown} of {total} points of these curves are on the page, those where they bend "
                "the most; all peaks and events are."
            )
        self.data["thinning"] = text
        if failed:
            self.notes.append(f"{failed} points have no value of what they are drawn over.")

    def collect_ensemble(self, layout: Layout) -> None:
        """Bands and largest responses, where there are samples."""
        dim = ensemble.samples_of(self.dataset)
        if dim is None or not layout.panels[0].places:
            if self.tuned is not None:
                self.notes.append(
                    "The response of the tuned structure is not shown: there are no samples beside."
                )
            return
        what, of = "Bands of the samples", (self.dataset, dim)
        bands, notes = [], []
        if layout.along:
            bands, notes = self.tried(what, ([], []), ensemble.bands_of, *of)
        self.notes += notes
        what = "The largest responses of the samples"
        spread = self.tried(what, [], ensemble.spread_of, *of, self.tuned)
        of_grid = layout.along != ("point",)
        how = "at the values of the grid" if of_grid else "read off the curves at 1201 values"
        how = f"Quantiles of the largest response, {how}."
        self.data["ensemble"] = {"bands": bands, "spread": spread, "how": how}
        if self.tuned is None:
            self.notes.append(
                "Amplification is not shown: it needs the response of the tuned structure, as in "
                "symhbm view ARCHIVE --tuned TUNED."
            )

    def collect_motion(self) -> None:
        """Statistics, or the motion of one point, where the dataset is none of curves."""
        dataset = self.dataset
        inner = {"dof", "harmonic", "component"}
        self.data["layout"] = None
        self.data["ensemble"] = ensemble.stored_statistics(dataset)
        if self.data["ensemble"] is not None:
            return
        if "coefficient" not in dataset.variables or "frequency" not in dataset.variables:
            raise ValueError("the archive holds no curve and no motion; symhbm info tells more")
        if {*map(str, dataset["coefficient"].dims)} != inner or dataset["frequency"].ndim:
            raise ValueError("the archive holds no curve; symhbm info tells what it holds")
        at = float(dataset["frequency"])
        names = [str(n) for n, v in dataset.variables.items() if {"angle", "event"} & {*v.dims}]
        one = dataset.drop_vars(names)
        mark = {"what": "point", "kind": "motion", "number": 0, "x": at, "row": 0, "point": -1}
        point = one.drop_vars("frequency").assign(
            coefficient=one["coefficient"].expand_dims("point")
        )
        point = point.assign_coords(frequency=("point", [at]))
        blades = self.tried("The disk", None, blades_of, dataset)
        found = motions.motions_at(point, "frequency", [mark], blades, motions.Budget(1))
        self.notes += [f"Not on the page: {why}." for why in found.missing]
        if 0 in found.of:
            mark["motion"] = found.of[0]
        entry = {"n": [0, 0], "failed": 0, "label": "", "status": self.status({})}
        self.data["curves"] = [entry | {"marks": [mark]}]

    def sections(self, layout: Layout | None) -> list[tuple[str, str]]:
        """The parts of the page in HTML, by their names."""
        dataset, marks = self.dataset, tables.marks_table
        parts = {"title": escape(self.name), "facts": self.account()}
        parts["mesh"] = self.tried("The mesh", "", mesh_html, dataset)
        for what in ("peak", "event"):
            of = dataset, layout, what, self.chosen, self.data["places"]
            table = layout and self.tried(f"The table of {what}s", None, marks, *of)
            parts[f"{what}s"] = table or f"<p>The archive holds no {what}s.</p>"
        failed = self.tried("Statuses", None, tables.failed_table, dataset)
        parts["failed"] = failed or "<p>All curves are complete.</p>" * bool(self.data["curves"])
        what, otherwise = "Provenance", "<p>Unknown.</p>"
        parts["provenance"] = self.tried(what, otherwise, tables.provenance_html, dataset)
        parts["subtitle"] = escape(plain(dataset.attrs.get("title", "")))
        notes = [*dict.fromkeys(self.notes)]
        listed = "".join(f"<li>{escape(note)}</li>" for note in notes)
        parts["notes"] = f"<ul>{listed}</ul>" if notes else "<p>Nothing is left out.</p>"
        parts["thinning"] = escape(self.data.pop("thinning", ""))
        return [*parts.items()]

    def account(self) -> str:
        """The account of the archive: what is written before an error stays."""
        rows: list[tuple[str, str]] = []
        for name, section in self.tried(
            "The account", {}, lambda: dict(account(self.dataset, DIGITS))
        ).items():
            self.tried(f"The {name} of the account", None, rows.extend, section)
        variables = self.dataset.variables.items()
        meanings = {str(name): each.attrs.get("long_name", "") for name, each in variables}
        return tables.account_html(rows, meanings)


def together(results: Sequence[Collected]) -> str:
    """The text of one page of several results; ValueError where they are over different axes."""
    first, layouts, parts = results[0], [], []
    for one in results:
        one.before = sum(len(other.data["curves"]) for other in results[: results.index(one)])
        layouts.append(one.gather())
        parts.append(one.sections(layouts[-1]))
    if None in layouts or any(layout[:3] != layouts[0][:3] for layout in layouts):
        raise ValueError("result: expected results with curves over the same parameter")
    data, labels = first.data, []
    for one in results:
        for entry in one.data["curves"]:
            entry["label"] = ": ".join(filter(None, [one.name, entry["label"]]))
            labels.append(entry["label"])
    alike = all(one.data[n] == data[n] for one in results for n in ("places", "contacts", "dofs"))
    data["curves"] = [entry for one in results for entry in one.data["curves"]]
    data["dims"] = [{"name": "result", "units": "", "labels": labels}]
    data["dofs"] = data["dofs"] if alike else []
    data.pop("ensemble", None)
    texts = {name: "" for name, _ in parts[0]}
    for one, sections in zip(results, parts, strict=True):
        for name, text in sections:
            heading = f"<h3>{escape(one.name)}</h3>" if text and name not in _ONE_LINE else ""
            texts[name] += heading + text if name not in _ONE_LINE or not texts[name] else ""
    told = "; ".join(differences(first.dataset, results[1].dataset))
    texts["thinning"] = " ".join(
        f"{escape(one.name)}: {dict(sections)['thinning']}"
        for one, sections in zip(results, parts, strict=True)
    )
    texts["title"] = escape(" and ".join(one.name for one in results))
    texts["subtitle"] = escape(plain(told, 600) or "alike in their problems")
    return page_of(f"{' and '.join(one.name for one in results)} - symhbm", [*texts.items()], data)


def _limits(dataset: xr.Dataset, sets: Sets, layout: Layout, share: float) -> Limits:
    """The points, lines and places of each curve, so that all of them fit into a page."""
    curves = max(1, sets.n_shown)
    n_dof = dataset.sizes.get("dof", 0) if layout.panels[0].places else 0
    room = max(0, int(share * _PLACES) // curves - 1)
    dofs = range(n_dof if n_dof > 1 else 0)
    if len(dofs) > room:
        dofs = _peaking(dataset, n_dof)[:room]
    lines = curves * (1 + len(dofs))
    of_point = 7 + len(dofs) + dataset.sizes.get("contact", 0) / 8
    return Limits(
        max(60, int(share * _VALUES / (curves * of_point))),
        max(100, int(share * _LINES / lines)),
        tuple(sorted(dofs)),
    )


def _peaking(dataset: xr.Dataset, n_dof: int) -> list[int]:
    """Degrees of freedom, those first that peak the most often."""
    order = np.arange(n_dof)
    if "peak_dof" in dataset.variables and dataset["peak_dof"].dtype.kind in "iu":
        found = dataset["peak_dof"].values.ravel()
        count = np.bincount(found[(found >= 0) & (found < n_dof)], minlength=n_dof)
        order = np.argsort(-count, kind="stable")
    return order.tolist()
