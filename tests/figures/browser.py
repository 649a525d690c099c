"""A page as a headless Chromium lays it out, in frames of given widths, without a driver or a network."""

import html
import json
import os
import re
import shutil
import subprocess
from pathlib import Path

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
AXE = os.environ.get("AXE_CORE", "")
"""The path of axe-core's `axe.min.js`, where somebody has one."""
FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-dev-shm-usage",
    "--allow-file-access-from-files",
    "--virtual-time-budget=20000",
    "--window-size=1600,1200",
)
HARNESS = """<!doctype html><meta charset="utf-8">
%(frames)s
<pre id="found"></pre>
<script>
const rules = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"];
function audit(frame) {
  return new Promise(done => {
    if (!"%(axe)s") return done(null);
    const script = frame.contentDocument.createElement("script");
    script.onload = () => frame.contentWindow.axe.run({runOnly: rules}).then(found => done(
      found.violations.map(each => each.id + ": " + each.nodes.slice(0, 3).map(node => node.html).join(" "))));
    script.onerror = () => done(["axe-core could not be loaded"]);
    script.src = "%(axe)s";
    frame.contentDocument.head.appendChild(script);
  });
}
async function look(frame) {
  const page = frame.contentDocument, pictures = [...page.images];
  return {
    excess: page.documentElement.scrollWidth - page.documentElement.clientWidth,
    first: pictures.length ? pictures[0].getBoundingClientRect().top + frame.contentWindow.scrollY : null,
    alts: pictures.map(picture => picture.alt.length),
    requests: frame.contentWindow.performance.getEntriesByType("resource").map(each => each.name),
    axe: await audit(frame),
  };
}
window.addEventListener("load", async () => {
  const found = {};
  for (const frame of document.querySelectorAll("iframe")) found[frame.id] = await look(frame);
  document.getElementById("found").textContent = JSON.stringify(found);
});
</script>
"""


def browser():
    """The command of a Chromium: the one that CHROMIUM names, or one that is installed; empty if there is none."""
    return os.environ.get("CHROMIUM") or next(filter(None, map(shutil.which, NAMES)), "")


def looks(page, widths, height, axe="", place=None):
    """Width -> what was found in a frame of that width: excess width, first picture, alts, requests, violations.

    What the browser needs is written to `place`, the page's folder unless told otherwise.
    """
    place = place or page.parent
    style = "width:{}px;height:{}px"
    frames = (f'<iframe id="{w}" src="{page.as_uri()}" style="{style.format(w, height)}"></iframe>' for w in widths)
    harness = place / "harness.html"
    harness.write_text(HARNESS % {"frames": "\n".join(frames), "axe": Path(axe).resolve().as_uri() if axe else ""})
    found = re.search(r'<pre id="found">(.+?)</pre>', _run(place, "--dump-dom", harness.as_uri()), re.DOTALL)
    assert found, "the browser measured nothing"
    return {int(width): each for width, each in json.loads(html.unescape(found[1])).items()}


def pages(page, place):
    """On how many sheets of paper the page is printed."""
    _run(place, f"--print-to-pdf={place / 'printed.pdf'}", page.as_uri())
    return len(re.findall(rb"/Type\s*/Page\b", (place / "printed.pdf").read_bytes()))


def _run(place, *words):
    command = [browser(), *FLAGS, f"--user-data-dir={place / 'browser'}", *words]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=True).stdout
