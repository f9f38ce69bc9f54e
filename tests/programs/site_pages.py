#!/usr/bin/env python3
"""Checks the site that scripts/docs.sh has built.

    site_pages.py links HTML_FOLDER             every link and picture leads to a file, every anchor to an element
    site_pages.py TPM                           builds the site, then checks links, and in Chromium that no page is
                                                wider than a window of 400 or 1400 pixels, no heading lies under another
                                                part or is broken within a word, no first column hides the second, every
                                                picture is there, every formula is set, and the search finds the page for
                                                questions as a new user types them
    site_pages.py look HTML_FOLDER              the checks in Chromium alone, on a site that is built
    site_pages.py sheet HTML_FOLDER SHEET.png   all pages, small, on one picture
"""

import importlib.util
import re
import shutil
import subprocess
import sys
import tempfile
import time
import urllib.parse
from html.parser import HTMLParser
from pathlib import Path

# What is typed into the search of the site; the page that has to be among the first results.
SEARCHES = {"my fit says flat": "troubleshooting", "which command": "commands", "why is my session refused": "troubleshooting"}
FIRST = 5
ROOT = Path(__file__).resolve().parents[2]


class Reader(HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.links, self.names = [], set()
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        a = dict(attributes)
        self.names.update(a[k] for k in ("id", "name") if a.get(k))
        for key in ("href", "src"):
            if a.get(key):
                self.links.append(a[key])


def pages_of(folder):
    return sorted(p for p in folder.rglob("*.html") if "_static" not in p.relative_to(folder).parts
                  and "_downloads" not in p.relative_to(folder).parts)


def broken_links(folder):
    read = {page: Reader(page.read_text(encoding="utf-8")) for page in pages_of(folder)}
    outside = set()
    for page, reader in read.items():
        for link in reader.links:
            if re.match(r"(https?|mailto):", link):
                outside.add(link)
                continue
            if link.startswith(("data:", "javascript:")):
                continue
            name, _, anchor = link.partition("#")
            name = urllib.parse.unquote(name.partition("?")[0])
            file = (page.parent / name).resolve() if name else page
            if not file.is_file():
                yield f"{page.relative_to(folder)}: {link}: no such file"
            elif anchor and file in read and urllib.parse.unquote(anchor) not in read[file].names | {"top"}:
                yield f"{page.relative_to(folder)}: {link}: no such place"
    print(f"{len(read)} pages; {len(outside)} links to other hosts, which are not followed")


def check_links(folder):
    faults = list(broken_links(folder))
    for fault in faults:
        print(fault)
    if faults:
        sys.exit(f"{len(faults)} broken links")


def chromium_or_skip(folder):
    from page_in_chromium import CannotStart, Chromium
    program = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if not program:
        print("SKIPPED: there is no Chromium (Debian: chromium)")
        sys.exit(77)
    try:
        return Chromium(program, folder)
    except CannotStart as e:
        print(f"SKIPPED: Chromium does not run on this machine: {e}")
        sys.exit(77)


def loaded(chromium, page):
    chromium.call("Page.navigate", url=page.as_uri())
    want = f"document.readyState === 'complete' && location.pathname === {urllib.parse.quote(str(page))!r}"
    chromium.awaited(want, 240, f"{page} does not load")


def unset_formulas(chromium, page):
    """What MathJax could not set, or did not within four minutes; formulas are set after a page has loaded."""
    start = time.monotonic()
    count = """[document.querySelectorAll('.math').length, document.querySelectorAll('script[type^="math/tex"]').length,
                document.querySelectorAll('.MathJax_SVG').length, window.MathJax && MathJax.Hub ? MathJax.Hub.getAllJax().filter(f => f.texError).length : 0]"""
    while True:
        marked, read, drawn, wrong = chromium.call("Runtime.evaluate", returnByValue=True, expression=count)["result"]["value"]
        if marked <= read == drawn:
            return f"{wrong} of {read} formulas are wrong" if wrong else ""
        if time.monotonic() - start > 240:
            return f"{drawn} of {marked} formulas are set"
        time.sleep(0.05)


# Headings that something else covers in their middle, or whose words are broken; first columns that push out of sight what
# stands beside them; pictures that are not drawn.
FAULTS = """(() => {
  const found = [];
  for (const h of document.querySelectorAll('article h1, article h2, article h3, article h4')) {
    h.scrollIntoView({block: 'center', behavior: 'instant'});
    const range = document.createRange(); range.selectNodeContents(h);
    const box = range.getClientRects()[0];
    if (!box) continue;
    const top = document.elementFromPoint(box.left + Math.min(box.width, innerWidth - box.left) / 2, box.top + box.height / 2);
    if (top && !h.contains(top) && !top.contains(h)) found.push('covered: ' + h.textContent.trim());
    if (!/H[12]/.test(h.tagName)) continue;
    for (const walk = document.createTreeWalker(h, NodeFilter.SHOW_TEXT); walk.nextNode();) {
      for (const word of walk.currentNode.data.matchAll(/[A-Za-z]+/g)) {
        range.setStart(walk.currentNode, word.index); range.setEnd(walk.currentNode, word.index + word[0].length);
        if (range.getClientRects().length > 1) found.push('broken: ' + word[0]);
      }
    }
  }
  for (const row of document.querySelectorAll('article table.docutils > tbody > tr:first-child')) {
    const [first, beside] = row.children, frame = row.closest('table').parentElement;
    if (row.children.length > 3 || !beside || beside.offsetTop > first.offsetTop) continue;
    if (first.offsetWidth > 0.9 * frame.clientWidth) found.push('hides what stands beside it: ' + first.textContent.trim());
  }
  for (const i of document.images) { i.loading = 'eager'; if (i.complete && i.naturalWidth === 0) found.push('not drawn: ' + i.getAttribute('src')); }
  return found;
})()"""


def check_search(folder, chromium):
    """Typed into the search as a new user would: the page with the answer is among the first results."""
    listed = f"""(found => found.some(link => link.includes('/WANTED.html')) && found)(
        [...document.querySelectorAll('#search-results li > a')].slice(0, {FIRST}).map(a => a.getAttribute('href')))"""
    for words, wanted in SEARCHES.items():
        chromium.call("Page.navigate", url=f"{(folder / 'search.html').as_uri()}?q={urllib.parse.quote_plus(words)}")
        chromium.awaited(listed.replace("WANTED", wanted), 240, f"the search for '{words}' does not find {wanted}.html")
    print(f"{len(SEARCHES)} questions find their page among the first {FIRST} results")


def check_widths(folder, chromium):
    chromium.open("about:blank")
    pages = pages_of(folder)
    wide = []  # and what else a page shows wrong
    for width in (400, 1400):
        chromium.call("Emulation.setDeviceMetricsOverride", width=width, height=900, deviceScaleFactor=1, mobile=False)
        for page in pages:
            if page == folder / "index.html":  # leads on to the first page
                continue
            loaded(chromium, page)
            if 'class="math' in page.read_text(encoding="utf-8") and (fault := unset_formulas(chromium, page)):
                wide.append(f"{page.relative_to(folder)}: {fault}")
            found = chromium.call("Runtime.evaluate", returnByValue=True,
                                  expression="document.documentElement.scrollWidth")["result"]["value"]
            if found > width:
                wide.append(f"{page.relative_to(folder)}: {found} px wide in a window of {width} px")
            faults = chromium.call("Runtime.evaluate", returnByValue=True, expression=FAULTS)["result"]["value"]
            wide += [f"{page.relative_to(folder)}: {fault} (in a window of {width} px)" for fault in faults]
    strangers = {u for u in chromium.asked() if not u.startswith(("file:", "data:", "about:"))}
    assert not strangers, strangers
    assert not wide, "\n".join(wide)
    print(f"{len(pages)} pages fit into windows of 400 and 1400 pixels")


def make_sheet(folder, picture, chromium):
    """Needs matplotlib's reader and writer of PNG only."""
    import matplotlib.image
    import numpy
    chromium.open("about:blank")
    chromium.call("Emulation.setDeviceMetricsOverride", width=1000, height=1250, deviceScaleFactor=0.12, mobile=False)
    tiles = []
    for page in pages_of(folder):
        if page == folder / "index.html":
            continue
        loaded(chromium, page)
        chromium.picture(picture)
        tiles.append(matplotlib.image.imread(picture)[:150, :120, :3])
    columns = 14
    rows = (len(tiles) + columns - 1) // columns
    sheet = numpy.full((rows * 154, columns * 124, 3), 0.75)
    for i, tile in enumerate(tiles):
        y, x = 154 * (i // columns) + 2, 124 * (i % columns) + 2
        sheet[y : y + tile.shape[0], x : x + tile.shape[1]] = tile
    matplotlib.image.imsave(picture, numpy.round(sheet * 7) / 7)
    print(f"{len(tiles)} pages on {picture}")


def main():
    if sys.argv[1] == "links":
        check_links(Path(sys.argv[2]).resolve())
        return
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        if sys.argv[1] == "look":
            chromium = chromium_or_skip(name)
            check_widths(Path(sys.argv[2]).resolve(), chromium)
            check_search(Path(sys.argv[2]).resolve(), chromium)
            chromium.close()
            return
        if sys.argv[1] == "sheet":
            chromium = chromium_or_skip(name)
            make_sheet(Path(sys.argv[2]).resolve(), sys.argv[3], chromium)
            chromium.close()
            return
        missing = [m for m in ("sphinx", "furo", "breathe", "myst_parser") if not importlib.util.find_spec(m)]
        missing += [] if shutil.which("doxygen") else ["doxygen"]
        missing += [] if Path("/usr/share/javascript/mathjax").is_dir() else ["mathjax"]
        if missing:
            print(f"SKIPPED: the site cannot be built: missing {', '.join(missing)} (scripts/packages.sh, packages_docs)")
            sys.exit(77)
        chromium = chromium_or_skip(name)
        subprocess.run([ROOT / "scripts/docs.sh", sys.argv[1]], check=True)
        folder = ROOT / "build/site/html"
        check_widths(folder, chromium)
        check_search(folder, chromium)
        chromium.close()


if __name__ == "__main__":
    main()
