#!/usr/bin/env python3
"""Manual pages and shell completion of tpm, from what its commands say of themselves.

    command_help.py TPM man FOLDER          tpm.1.gz, tpm-fit.1.gz, tpm-hil-run.1.gz, ...
    command_help.py TPM completion FILE     for bash

Equal programs give equal bytes.
"""

import gzip
import re
import subprocess
import sys
from pathlib import Path


class Command:
    """A command as its --help shows it."""

    def __init__(self, program, words):
        self.words = words
        text = subprocess.run([program, *words, "--help"], capture_output=True, text=True, check=True).stdout
        lines = text.rstrip().splitlines()
        usage = next(i for i, line in enumerate(lines) if line.startswith("Usage:"))
        self.about = " ".join(line.strip() for line in lines[:usage] if line.strip())
        self.usage = lines[usage].removeprefix("Usage:").strip()
        self.usage = re.sub(r"^\S*tpm(?=\s|$)", "tpm", self.usage)
        self.sections = []  # (title, [(item, meaning)]) and, at the end, lines of examples
        self.footer = []
        self._read(lines[usage + 1 :])

    def _read(self, lines):
        title, items = None, []
        for at, line in enumerate(lines):
            # A heading over lines that call tpm begins the examples.
            example = at + 1 < len(lines) and lines[at + 1].startswith("  tpm ")
            if re.match(r"\S.*:$", line) and not example:
                title, items = line[:-1], []
                self.sections.append((title, items))
            elif line.startswith("  ") and title is not None:
                entry = re.match(r"  (\S.*?)(?:  +(\S.*))?$", line)
                more = re.match(r" {20,}(\S.*)$", line)
                if more and items:
                    items[-1][1] = (items[-1][1] + " " + more[1]).strip()
                elif entry:
                    items.append([entry[1], entry[2] or ""])
            elif line.strip():
                self.footer = [text.rstrip() for text in lines[at:]]
                return

    @property
    def subcommands(self):
        if "SUBCOMMAND" not in self.usage:
            return []
        names = []
        for title, items in self.sections:
            if title.lower() in ("options", "positionals") or title.startswith("What the files"):
                continue
            names += [item.split()[0] for item, _ in items if re.match(r"[a-z]", item)]
        return names

    @property
    def options(self):
        found = []
        for _, items in self.sections:
            for item, _ in items:
                found += re.findall(r"(?<![\w-])--?[A-Za-z][\w-]*", item)
        return sorted(set(found))


def commands(program):
    """All commands, the program itself first."""
    waiting, found = [[]], []
    while waiting:
        command = Command(program, waiting.pop(0))
        found.append(command)
        waiting += [[*command.words, name] for name in command.subcommands]
    return found


def troff(text):
    text = text.replace("\\", "\\e").replace("-", "\\-")
    return "\\&" + text if text.startswith((".", "'")) else text


def man_page(command, version, others):
    name = "-".join(["tpm", *command.words])
    lines = [
        f'.TH "{name.upper()}" "1" "" "tpmkit {version}" "User Commands"',
        ".SH NAME",
        troff(f"{name} - {command.about or 'validation and fitting of viscoelastic soft-tissue models'}"),
        ".SH SYNOPSIS",
        f".B {troff(command.usage)}",
    ]
    for title, items in command.sections:
        lines.append(f".SH {troff(title.upper())}")
        for item, meaning in items:
            lines += [".TP", f".B {troff(item)}", troff(meaning) if meaning else "\\&"]
    if command.footer:
        lines += [".SH EXAMPLES", ".nf", *[troff(line) for line in command.footer], ".fi"]
    lines += [".SH EXIT STATUS"]
    for code, meaning in (
        ("0", "Done."),
        ("1", "Ran to the end, and the answer is no."),
        ("2", "The command line."),
        ("3", "A file or a value in it."),
        ("4", "A solver gave up."),
        ("5", "Something outside: cannot write, no Python with matplotlib."),
    ):
        lines += [".TP", f".B {code}", meaning]
    if others:
        lines += [".SH SEE ALSO", ", ".join(f"{troff(o)}(1)" for o in others)]
    return "\n".join(lines) + "\n"


def write_man(program, folder):
    folder.mkdir(parents=True, exist_ok=True)
    version = subprocess.run([program, "version"], capture_output=True, text=True, check=True).stdout.split()[1]
    found = commands(program)
    names = ["-".join(["tpm", *c.words]) for c in found]
    for command, name in zip(found, names):
        depth = len(command.words)
        others = [n for c, n in zip(found, names) if len(c.words) == depth + 1 and c.words[:depth] == command.words]
        others += ["-".join(["tpm", *command.words[:-1]])] if command.words else []
        with open(folder / f"{name}.1.gz", "wb") as raw, gzip.GzipFile("", "wb", 9, raw, mtime=0) as page:
            page.write(man_page(command, version, others).encode())
    print(f"{len(found)} pages in {folder}")


COMPLETION = """# bash completion of tpm {version}; made by scripts/command_help.py
_tpm() {{
  local word=${{COMP_WORDS[COMP_CWORD]}} path= at=1 next
  local -A commands=( {commands} )
  local -A options=( {options} )
  while (( at < COMP_CWORD )); do
    next="${{path:+$path }}${{COMP_WORDS[at]}}"
    [[ -v options["$next"] ]] || break
    path=$next
    (( ++at ))
  done
  COMPREPLY=()
  if [[ $word == -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "${{options[${{path:-.}}]}}" -- "$word")
  elif (( at == COMP_CWORD )) && [[ -n ${{commands[${{path:-.}}]}} ]]; then
    mapfile -t COMPREPLY < <(compgen -W "${{commands[${{path:-.}}]}}" -- "$word")
  fi
  if (( ${{#COMPREPLY[@]}} == 0 )); then
    compopt -o filenames 2>/dev/null
    mapfile -t COMPREPLY < <(compgen -f -- "$word")
  fi
}}
complete -F _tpm tpm
"""


def write_completion(program, file):
    version = subprocess.run([program, "version"], capture_output=True, text=True, check=True).stdout.split()[1]
    found = commands(program)
    key = lambda c: " ".join(c.words) or "."
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(
        COMPLETION.format(
            version=version,
            commands=" ".join(f'["{key(c)}"]="{" ".join(c.subcommands)}"' for c in found),
            options=" ".join(f'["{key(c)}"]="{" ".join(c.options)}"' for c in found),
        )
    )
    print(f"completion of {len(found)} commands in {file}")


def main():
    if len(sys.argv) != 4 or sys.argv[2] not in ("man", "completion"):
        sys.exit(__doc__)
    program, what, place = sys.argv[1], sys.argv[2], Path(sys.argv[3])
    write_man(program, place) if what == "man" else write_completion(program, place)


if __name__ == "__main__":
    main()
