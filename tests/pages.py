"""A page of an archive: its data and texts, and in a browser what it shows and complains of."""

import base64
import json
import re
from html import unescape

import numpy as np

PACKED = re.compile(r"[fiu]\d:")


def data_of(path):
    """What the scripts of a page draw."""
    text = path.read_text(encoding="utf-8")
    held = re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.DOTALL)
    return json.loads(held[1])


def unpacked(text):
    return np.frombuffer(base64.b64decode(text[3:]), f"<{text[:2]}")


def texts_of(path):
    """What a page says without scripts, line by line, up to what the archive says of itself."""
    text = re.sub(r"(?s)<(script|style).*?</\1>", "", path.read_text(encoding="utf-8"))
    text = text.partition("Provenance:")[0]
    lines = (" ".join(unescape(line).split()) for line in re.split("<[^>]*>", text))
    return [line for line in lines if line]


class Look:
    """A page in the browser: what it asked for, and what went wrong."""

    def __init__(self, page, path):
        self.page, self.asked, self.wrong = page, [], []
        page.on("request", lambda request: self.asked.append(request.url))
        page.on("pageerror", lambda error: self.wrong.append(str(error)))
        page.on("dialog", lambda dialog: (self.wrong.append(dialog.message), dialog.dismiss()))
        page.on("console", self._heard)
        page.goto(path.as_uri())
        # Functions that wait would have to evaluate texts, which the policy of the page forbids.
        # The time-out guards against a page that never gets ready.
        page.wait_for_selector("html[data-ready=yes]", state="attached", timeout=1_800_000)
        self.as_opened()

    def _heard(self, message):
        if message.type in ("error", "warning"):
            self.wrong.append(message.text)

    def text(self, selector):
        return self.page.inner_text(selector)

    def run(self, script, argument=None):
        return self.page.evaluate(script, argument)

    def pixel(self, x, y, axis="y"):
        """Where a point of the chart is in the window; ``y`` as it is drawn."""
        self.page.locator("#chart").scroll_into_view_if_needed()
        script = """([x, y, axis]) => {
          const chart = document.getElementById("chart"), all = chart._fullLayout;
          const name = axis.replace("y", "yaxis"), box = chart.getBoundingClientRect();
          return [box.left + all.xaxis._offset + all.xaxis.d2p(x),
                  box.top + all[name]._offset + all[name].d2p(y)];
        }"""
        return self.run(script, [x, y, axis])

    def hover(self, x, y, axis="y"):
        """The lines under the pointer at a point of the chart."""
        self.page.mouse.move(5, 5)
        left, top = self.pixel(x, y, axis)
        label = None
        for turn in range(18_000):  # a guard against what never comes
            # Plotly does not look at every move of a pointer.
            self.page.mouse.move(left + 0.2 * (turn % 2), top)
            self.page.wait_for_timeout(100)
            label = self.page.query_selector("#chart .hoverlayer .hovertext")
            if label is not None:
                break
        assert label is not None, "nothing is told under the pointer"
        lines = label.evaluate("e => [...e.querySelectorAll('tspan')].map(t => t.textContent)")
        return [line for line in lines if line] or [label.text_content()]

    def choose(self, name, value):
        script = """([name, value]) => {
          const list = document.getElementById(name);
          list.value = value;
          list.dispatchEvent(new Event("change"));
        }"""
        self.run(script, [name, str(value)])

    def as_opened(self):
        """The page as it was when it was opened."""
        self.page.set_viewport_size({"width": 1400, "height": 900})
        self.page.emulate_media(color_scheme="light")
        self.run(
            """() => {
              for (const list of document.querySelectorAll("#menus select")) {
                list.value = list.opened ??= list.value;
                list.dispatchEvent(new Event("change"));
              }
              if (data.curves.length) choose(0, -1);
            }"""
        )
        self.settle()
        return self

    def settle(self):
        """Wait until figures have the width of the window, which they follow a little later."""
        script = """() => [...document.querySelectorAll(".plot")]
          .every((p) => !p._fullLayout || !p.clientWidth || p._fullLayout.width === p.clientWidth)
          && document.documentElement.scrollWidth <= window.innerWidth"""
        for _ in range(36_000):  # a guard, as above
            if self.run(script):
                return
            self.page.wait_for_timeout(50)
        raise AssertionError("figures do not follow the width of the window")

    def trace(self, meta):
        """Coordinates of a trace of the chart by its meaning."""
        script = """(meta) => document.getElementById("chart").data
          .filter((t) => t.meta === meta).map((t) => ({ x: t.x, y: t.y, name: t.name }))"""
        return self.run(script, meta)


def check(look):
    """Nothing went wrong, and nothing was asked of a network."""
    assert look.wrong == []
    assert [url for url in look.asked if not url.startswith(("file:", "data:", "blob:"))] == []
