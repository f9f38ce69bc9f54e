#!/usr/bin/env python3
"""Checks what the Journal of Open Source Software asks of paper/paper.md, and where its numbers come from.

    paper.py ROOT

- the required sections in their order; 750 to 1,750 words, captions and headings included;
- persons are filled in, each with an ORCID, or all of them are marked TO BE FILLED IN, and the disclosure with them;
- every number with a decimal point, and every percentage, stands in a page that its paragraph names, or in PLACES;
- every entry of paper.bib has a title, a year, and a DOI, an address, a publisher, a book, or a note of what is missing.

Figures, citations, labels and named files: documentation.py.
"""

import re
import sys
from pathlib import Path

SECTIONS = ["Summary", "Statement of need", "State of the field", "Software design", "Research impact statement", "Limitations",
            "AI usage disclosure", "Acknowledgements", "References"]
FEWEST, MOST = 750, 1750
# Where numbers of paragraphs stand that name a command in place of a page: the page that shows what it prints.
PLACES = ["reports/paper/report.md", "docs/fitting.md"]
OPEN = "TO BE FILLED IN"
NUMBER = re.compile(r"(?<![\w.])\d+(?:,\d{3})*(?:\.\d+)?(?:e[+-]?\d+)?(?![\w]|\.\d)")


def parts(page):
    head, body = re.match(r"---\n(.*?)\n---\n(.*)", page, re.S).groups()
    return head, body


def words(body):
    """As a reader counts: captions count, names of files of figures and labels do not."""
    text = re.sub(r"\]\(figures/[^)]*\)", "]", re.sub(r"\\label\{[^}]*\}", "", body))
    return len(text.split())


def faults_of_persons(head, body):
    names = re.findall(r"^ +- name: (.+)$", head, re.M)
    orcids = re.findall(r"^ +orcid: (.+)$", head, re.M)
    disclosure = re.search(r"^# AI usage disclosure\n(.*?)(?=^# )", body, re.M | re.S)
    text = disclosure[1] if disclosure else ""
    for wanted in ("AI", "model", "written", "checked"):
        if wanted not in text:
            yield f"paper.md: the disclosure does not say '{wanted}'"
    if not names or len(orcids) != len(names):
        yield f"paper.md: {len(names)} persons, {len(orcids)} ORCIDs"
    open_ones = [n for n in [*names, *orcids] if n == OPEN]
    if open_ones and len(open_ones) != len(names) + len(orcids):
        yield "paper.md: some persons are filled in, some are not"
    if bool(open_ones) != (OPEN in text):
        yield "paper.md: persons and disclosure are not both open or both filled in"
    for orcid in orcids:
        if orcid != OPEN and not re.fullmatch(r"\d{4}-\d{4}-\d{4}-\d{3}[\dX]", orcid):
            yield f"paper.md: ORCID {orcid}"


def values(text):
    text = re.sub(r"·10([⁻⁰¹²³⁴-⁹]+)", lambda m: "e" + m[1].translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")), text)
    return {float(n.replace(",", "")) for n in NUMBER.findall(text)}


def faults_of_numbers(root, body):
    for paragraph in re.split(r"\n\s*\n|\n(?=- )", body):
        named = re.findall(r"`((?:reports|docs)/[\w./-]+\.md)`", paragraph) or PLACES
        known = values("\n".join((root / name).read_text(encoding="utf-8") for name in named if (root / name).exists()))
        plain = re.sub(r"`[^`]*`|\[?@\w+[^\]\s]*|(?:MuJoCo|Bullet|release,) [\d.]+\d", "", paragraph)
        for match in NUMBER.finditer(plain):
            share = plain[match.end():match.end() + 2] == " %"
            if ("." in match[0] or "e" in match[0] or share) and float(match[0].replace(",", "")) not in known:
                yield f"paper.md: {match[0]} does not stand in {', '.join(named)}"


def faults_of_entries(text):
    for kind, key, entry in re.findall(r"^@(\w+)\{(\w+),\n(.*?)^\}", text, re.M | re.S):
        fields = dict(re.findall(r"^ +(\w+) += +\{(.*?)\},?$", entry, re.M | re.S))
        for field in ("author", "title"):
            if not fields.get(field):
                yield f"paper.bib: {key} has no {field}"
        if not fields.keys() & {"doi", "url", "publisher", "booktitle", "note"}:
            yield f"paper.bib: {key} can be found by nothing"
        if kind == "article" and not fields.get("journal"):
            yield f"paper.bib: {key} has no journal"
        if "doi" in fields and not re.fullmatch(r"10\.\d{4,5}/\S+", fields["doi"]):
            yield f"paper.bib: {key}: DOI {fields['doi']}"


def main():
    root = Path(sys.argv[1]).resolve()
    head, body = parts((root / "paper/paper.md").read_text(encoding="utf-8"))
    count, faults = words(body), []
    if not FEWEST <= count <= MOST:
        faults.append(f"paper.md: {count} words; expected {FEWEST} to {MOST}")
    sections = re.findall(r"^# (.+)$", body, re.M)
    if sections != SECTIONS:
        faults.append(f"paper.md: sections {sections}; expected {SECTIONS}")
    faults += [*faults_of_persons(head, body), *faults_of_numbers(root, body),
               *faults_of_entries((root / "paper/paper.bib").read_text(encoding="utf-8"))]
    for fault in faults:
        print(fault)
    print(f"{count} words, {len(faults)} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
