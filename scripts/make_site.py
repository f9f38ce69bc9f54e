#!/usr/bin/env python3
"""Puts together what Sphinx reads: the pages of docs and reports with what they link, and pages that are made
from the program, the schemas and the Python package. Called by scripts/docs.sh.

    make_site.py ROOT TPM SOURCE_FOLDER

Equal trees and programs give equal bytes.
"""

import ast
import json
import re
import subprocess
import sys
from pathlib import Path

from command_help import commands

PAGES = ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "SECURITY.md")
TABLES = "reports/paper/tables.md"  # an output of `tpm paper report`, as tables.csv and tables.tex; report.md shows it
C_HEADERS = ("haptics.h", "haptic_device.h")
CPP = (  # what is explained, its header, the kind and name of what doxygen describes
    ("Models", "model.hpp", ("class tpm::Model", "class tpm::ModelMaker")),
    ("Formulations", "formulation.hpp", ("class tpm::Formulation", "struct tpm::Capabilities")),
    ("Protocols", "protocol.hpp", ("class tpm::Protocol",)),
    ("Scenes", "scene.hpp", ("class tpm::organ::Scene",)),
    ("Fits", "fit.hpp", ("struct tpm::fit::FitSummary",)),
    ("Sessions", "session.hpp", ("class tpm::haptics::Session",)),
    ("Contact models of a servo loop", "contact_model.hpp", ("class tpm::ContactModel", "struct tpm::ContactAnswer")),
    ("Errors", "error.hpp", ("class tpm::Error",)),
)
LINK = re.compile(r"(!?)\[([^\]]*)\]\(([^)\s]+)\)")
PICTURE = re.compile(r'<img src="([^"]+)"')  # one whose width and side are stated


def code_free(text):
    """Pieces of a page: (is it code, text). Links in code are none."""
    pieces, code, held = [], False, []
    for line in text.splitlines(keepends=True):
        if line.startswith("```"):
            held.append(line)
            if code:
                pieces.append((True, "".join(held)))
                held = []
            else:
                pieces.append((False, "".join(held[:-1])))
                held = [line]
            code = not code
        else:
            held.append(line)
    pieces.append((code, "".join(held)))
    return pieces


class Site:
    def __init__(self, root, source):
        self.root, self.source, self.linked, self.kept = root, source, set(), set()

    def page(self, path):
        """Copies a page, with the files that it links; links to folders become their names."""

        def link(match):
            picture, text, target = match.groups()
            if re.match(r"[a-z]+:", target) or target.startswith("#"):
                return match[0]
            file = (path.parent / target.partition("#")[0]).resolve()
            if file.is_dir():
                return text if text.startswith("`") else f"`{file.relative_to(self.root)}`" if text in ("", target) else text
            if file.suffix != ".md":
                self.linked.add(file)
            elif not file.is_relative_to(self.root / "docs") and not file.is_relative_to(self.root / "reports") and file.name not in PAGES:
                return text
            return match[0]

        text = "".join(t if code else LINK.sub(link, t) for code, t in code_free(path.read_text(encoding="utf-8")))
        self.linked.update((path.parent / name).resolve() for name in PICTURE.findall(text))
        if not re.search(r"^# ", text, re.M):  # a report whose writer gave it no title
            text = f"# {path.parent.name.capitalize()}: {path.stem}\n\n{text}"
        self.write(path.relative_to(self.root), text)

    def write(self, path, text):
        file = self.source / path
        self.put(file, text.encode())

    def put(self, file, content):
        """What has not changed is left alone, so that Sphinx reads only what has."""
        self.kept.add(file)
        if file.is_file() and file.read_bytes() == content:
            return
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(content)

    def finish(self):
        for file in sorted(self.linked):
            self.put(self.source / file.relative_to(self.root), file.read_bytes())
        for file in [f for f in self.source.rglob("*") if f.is_file() and f not in self.kept]:
            file.unlink()


def command_pages(site, program):
    names = []
    for command in commands(program):
        name = "-".join(["tpm", *command.words])
        names.append(name)
        text = subprocess.run([program, *command.words, "--help"], capture_output=True, text=True, check=True).stdout
        text = re.sub(r"^Usage: \S*tpm(?=\s|$)", "Usage: tpm", text, flags=re.M).rstrip()
        below = [f"- [tpm {' '.join([*command.words, s])}]({'-'.join([name, s])}.md)" for s in command.subcommands]
        site.write(f"docs/site/reference/commands/{name}.md", "\n".join(
            [f"# {' '.join(['tpm', *command.words])}", "", command.about or "Soft-tissue models checked, fitted and rendered.", "",
             "```text", text, "```", "", *below, ""]))
    site.write("docs/site/reference/commands/index.md", "\n".join(
        ["# Commands", "", "What each command says with `--help`.", "", "```{toctree}", ":maxdepth: 1", "", *sorted(names), "```", ""]))


def cell(text):
    return " ".join(str(text).split()).replace("|", "\\|")


def kind_of(schema, definitions):
    if "$ref" in schema:
        file, name = schema["$ref"].split("#/definitions/")
        return f"[{name}]({file.removesuffix('.schema.json')}.md)" if file else name
    if "enum" in schema:
        return "one of " + ", ".join(f"`{v}`" for v in schema["enum"])
    if "const" in schema:
        return f"`{schema['const']}`"
    kind = schema.get("type", "")
    if isinstance(kind, list):
        kind = " or ".join(kind)
    if kind == "array" and isinstance(schema.get("items"), dict):
        return "list of " + (kind_of(schema["items"], definitions) or "anything")
    if not kind:
        for word in ("anyOf", "oneOf"):
            if word in schema:
                return " or ".join(filter(None, (kind_of(s, definitions) for s in schema[word]))) or "see the text"
    return kind


def schema_rows(schema, definitions, path, rows):
    required = set(schema.get("required", []))
    for name, value in schema.get("properties", {}).items():
        if value is True:
            value = {}
        here = f"{path}{name}"
        rows.append((f"`{here}`", kind_of(value, definitions) + (", required" if name in required else ""), value.get("description", "")))
        schema_rows(value, definitions, here + ".", rows)
        items = value.get("items")
        if isinstance(items, dict):
            schema_rows(items, definitions, here + "[].", rows)
    for word in ("allOf", "anyOf", "oneOf"):
        for part in schema.get(word, []):
            if isinstance(part, dict):
                schema_rows(part, definitions, path, rows)


def table(rows):
    seen, lines = set(), ["| key | kind | meaning |", "| --- | --- | --- |"]
    for row in rows:
        if row not in seen:
            seen.add(row)
            lines.append("| " + " | ".join(cell(c) for c in row) + " |")
    return lines


def schema_pages(site):
    names = []
    for file in sorted((site.root / "schemas").glob("*.schema.json")):
        schema = json.loads(file.read_text(encoding="utf-8"))
        definitions = schema.get("definitions", {})
        name = file.name.removesuffix(".schema.json")
        names.append(name)
        rows = []
        schema_rows(schema, definitions, "", rows)
        lines = [f"# {schema.get('title', name)}", "", f"`schemas/{file.name}`. {schema.get('description', '')}", "", *table(rows)]
        for word, definition in definitions.items():
            lines += ["", f"## {word}", "", cell(definition.get("description", kind_of(definition, definitions))), ""]
            inner = []
            schema_rows(definition, definitions, "", inner)
            if inner:
                lines += table(inner)
        site.write(f"docs/site/reference/schemas/{name}.md", "\n".join(lines) + "\n")
    site.write("docs/site/reference/schemas/index.md", "\n".join(
        ["# Schemas", "", "The JSON files that tpm reads, key by key. `a.b` is the key `b` of the block `a`, `a[]` an entry of a list.", "",
         "```{toctree}", ":maxdepth: 1", "", *names, "```", ""]))


def signature(node, owner=""):
    returns = f" -> {ast.unparse(node.returns)}" if node.returns else ""
    return f"{owner}{node.name}({ast.unparse(node.args)}){returns}"


def described(node, owner=""):
    text = ast.get_docstring(node) or ""
    first = f"class {node.name}" if isinstance(node, ast.ClassDef) else signature(node, owner)
    return ["```python", first, "```", "", "```text", text, "```", ""] if text else []


def interface_pages(site):
    library = "../../library.md"
    lines = ["# C", "", "Two headers: a tissue in your own haptic loop, and your own device for `tpm hil`. [The C",
             f"interface]({library}#tissue-in-a-haptic-loop-of-your-own) has examples of both.", ""]
    for header in C_HEADERS:
        lines += [f"## tpmkit/{header}", "", f"```{{doxygenfile}} tpmkit/{header}", "```", ""]
    site.write("docs/site/reference/c.md", "\n".join(lines))
    lines = ["# C++", "", "The interfaces to implement or to call. [The library](../../library.md) lists all public headers and says how",
             "a project depends on it.", ""]
    for title, header, names in CPP:
        lines += [f"## {title}: `tpmkit/{header}`", ""]
        for kind, name in (entry.split() for entry in names):
            members = ":members: code, within" if name == "tpm::Error" else ":members:"
            lines += [f"```{{doxygen{kind}}} {name}", members, "```", ""]
    site.write("docs/site/reference/cpp.md", "\n".join(lines))


def python_page(site):
    package = site.root / "bindings/python/tpmkit"
    lines = ["# Python", "", "The package `tpmkit`: signatures and docstrings of its sources. [tpmkit in Python](../../python.md) shows it at work.", ""]
    for file in sorted(package.glob("*.py")):
        if file.name == "__main__.py":
            continue
        tree = ast.parse(file.read_text(encoding="utf-8"))
        for node in tree.body:
            if not isinstance(node, (ast.FunctionDef, ast.ClassDef)) or node.name.startswith("_"):
                continue
            block = described(node)
            if not block:
                continue
            lines += [f"## {node.name}", "", *block]
            for inner in node.body if isinstance(node, ast.ClassDef) else []:
                if isinstance(inner, ast.FunctionDef) and not inner.name.startswith("_"):
                    lines += described(inner, f"{node.name}.")
    site.write("docs/site/reference/python.md", "\n".join(lines))


def main():
    root, program, source = Path(sys.argv[1]).resolve(), sys.argv[2], Path(sys.argv[3]).resolve()
    site = Site(root, source)
    for name in PAGES:
        site.page(root / name)
    for folder in ("docs", "reports"):
        for page in sorted((root / folder).rglob("*.md")):
            if page != root / TABLES:
                site.page(page)
    site.put(source / "conf.py", (root / "docs/site/conf.py").read_bytes())
    for file in sorted((root / "docs/site/static").iterdir()):
        site.put(source / file.relative_to(root), file.read_bytes())
    command_pages(site, program)
    schema_pages(site)
    interface_pages(site)
    python_page(site)
    site.finish()
    print(f"{len(list(source.rglob('*.md')))} pages in {source}")


if __name__ == "__main__":
    main()
