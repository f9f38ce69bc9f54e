#!/usr/bin/env python3
"""Manual pages and shell completion of tpm, from what its commands say of themselves.

    command_help.py TPM man FOLDER          tpm.1.gz, tpm-fit.1.gz, tpm-hil-run.1.gz, ...
    command_help.py TPM completion FOLDER   tpm for bash, _tpm for zsh, tpm.fish

Equal programs give equal bytes.
"""

import gzip
import json
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


ENVIRONMENT = (
    ("TPMKIT_SHARE", "Folder of the shipped curves, configurations and schemas, in place of the installed one."),
    ("TPMKIT_PYTHON", "Python with matplotlib, for figures; without it figures are left out."),
    ("NO_COLOR", "Not empty: no colour on a terminal."),
    ("FDSDK", "Folder of the SDK of Force Dimension, where its library is looked for."),
)
FILES = (
    ("PREFIX/share/tpmkit", "Curves, configurations and schemas that come with tpm (tpm example lists them)."),
    ("NAME_fit/, simulation.h5, session.tpmrec, ...", "Results under names that were not given; --overwrite replaces changed ones."),
)


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
    for title, rows in (("ENVIRONMENT", ENVIRONMENT), ("FILES", FILES)):
        lines += [f".SH {title}"]
        for name_of_row, meaning in rows:
            lines += [".TP", f".B {troff(name_of_row)}", troff(meaning)]
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


BASH = """# bash completion of tpm {version}; made by scripts/command_help.py
_tpm() {{
  local word=${{COMP_WORDS[COMP_CWORD]}} path= at=1 next before=${{COMP_WORDS[COMP_CWORD-1]}} list
  local -A commands=( {commands} )
  local -A options=( {options} )
  local -A values=( {values} )
  while (( at < COMP_CWORD )); do
    next="${{path:+$path }}${{COMP_WORDS[at]}}"
    [[ -v options["$next"] ]] || break
    path=$next
    (( ++at ))
  done
  COMPREPLY=()
  list="${{values["${{path:-.}} $before"]}}"
  if [[ -n $list ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$list" -- "$word")
  elif [[ $word == -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "${{options[${{path:-.}}]}}" -- "$word")
  elif (( at == COMP_CWORD )); then
    mapfile -t COMPREPLY < <(compgen -W "${{commands[${{path:-.}}]}} ${{values["${{path:-.}} ."]}}" -- "$word")
  fi
  if (( ${{#COMPREPLY[@]}} == 0 )); then
    compopt -o filenames 2>/dev/null
    mapfile -t COMPREPLY < <(compgen -f -- "$word")
  fi
}}
complete -F _tpm tpm
"""

ZSH = """#compdef tpm
# zsh completion of tpm {version}; made by scripts/command_help.py
_tpm() {{
  local where= at=2 next before=$words[CURRENT-1]
  local -A commands options values
  commands=( {commands} )
  options=( {options} )
  values=( {values} )
  while (( at < CURRENT )); do
    next="${{where:+$where }}$words[at]"
    (( $+options[$next] )) || break
    where=$next
    (( ++at ))
  done
  local here=${{where:-.}}
  local of_option="$here $before" of_argument="$here ."
  if [[ -n $values[$of_option] ]]; then
    compadd -- ${{=values[$of_option]}}
  elif [[ $words[CURRENT] == -* ]]; then
    compadd -- ${{=options[$here]}}
  elif (( at == CURRENT )) && [[ -n $commands[$here]$values[$of_argument] ]]; then
    compadd -- ${{=commands[$here]}} ${{=values[$of_argument]}}
  else
    _files
  fi
}}
_tpm "$@"
"""


def fish_word(text):
    return "'" + text.replace("\\", "\\\\").replace("'", "\\'") + "'"


def first_sentence(text):
    """Of a help text, short enough for a list of completions."""
    text = re.split(r"[;:(]|\. ", text)[0].strip()
    return text if len(text) <= 70 else text[:67].rsplit(" ", 1)[0] + "..."


class Usage:
    """All commands as `tpm --json-usage` prints them, by their words."""

    def __init__(self, program):
        ask = lambda *words: subprocess.run([program, *words], capture_output=True, text=True, check=True).stdout
        self.version = ask("version").split()[1]
        self.laws = [entry["law"] for entry in json.loads(ask("laws", "--format", "json"))["laws"]]
        self.kinds = [line.split()[0] for line in ask("schema").splitlines() if re.match(r"[a-z_]+  ", line)]
        self.examples = [line.split()[0] for line in ask("example").splitlines() if re.match(r"[a-z_-]+  ", line)]
        self.commands = {}
        self._read(json.loads(ask("--json-usage")), "")

    def _read(self, command, path):
        self.commands[path] = command
        for below in command.get("commands", []):
            self._read(below, f"{path} {below['name']}".strip())

    def values(self, path, option):
        """What an option or argument may be, where that is a list."""
        if "values" in option:
            return option["values"]
        name = option["names"][-1]
        if name == "--laws":
            return self.laws
        if name == "--device":
            return ["virtual", "replay", "plugin", "inverse3", "omega7"]
        return {("schema", "NAME"): self.kinds, ("example", "NAME"): self.examples, ("laws", "name"): self.laws}.get(
            (path, name), []
        )


def shell_tables(usage):
    """Of bash and zsh: words by command, and values by command and option."""
    entry = lambda key, words: f'["{key}"]="{" ".join(words)}"'
    commands, options, values = [], [], []
    for path, command in usage.commands.items():
        key = path or "."
        commands.append(entry(key, [c["name"] for c in command.get("commands", [])]))
        options.append(entry(key, sorted(n for o in command["options"] for n in o["names"])))
        for option in command["options"] + command.get("arguments", []):
            listed = usage.values(path, option)
            for name in option["names"] if listed else []:
                values.append(entry(f"{key} {name if name.startswith('-') else '.'}", listed))
    return {"commands": " ".join(commands), "options": " ".join(options), "values": " ".join(values)}


def fish(usage):
    lines = [f"# fish completion of tpm {usage.version}; made by scripts/command_help.py"]
    for path, command in usage.commands.items():
        words = path.split()
        here = " and ".join(f"__fish_seen_subcommand_from {word}" for word in words) or "__fish_use_subcommand"
        below = [c["name"] for c in command.get("commands", [])]
        if words and below:
            here_for_commands = f"{here}; and not __fish_seen_subcommand_from {' '.join(below)}"
        else:
            here_for_commands = here
        condition = lambda text: "-n " + fish_word(text.replace(" and ", "; and "))
        for c in command.get("commands", []):
            lines.append(f"complete -c tpm -f {condition(here_for_commands)} -a {c['name']} -d {fish_word(first_sentence(c['text']))}")
        for option in command["options"] + command.get("arguments", []):
            listed = usage.values(path, option)
            names = [f"-s {n[1:]}" if len(n) == 2 else f"-l {n[2:]}" for n in option["names"] if n.startswith("-")]
            if not names and not listed:
                continue
            line = f"complete -c tpm {condition(here)} {' '.join(names)}".rstrip()
            line += "" if option.get("flag") or not names else " -r"
            line += f" -f -a {fish_word(' '.join(listed))}" if listed else ""
            lines.append(f"{line} -d {fish_word(first_sentence(option['text']))}")
    return "\n".join(lines) + "\n"


def write_completion(program, folder):
    usage = Usage(program)
    folder.mkdir(parents=True, exist_ok=True)
    tables = shell_tables(usage)
    (folder / "tpm").write_text(BASH.format(version=usage.version, **tables))
    (folder / "_tpm").write_text(ZSH.format(version=usage.version, **{k: v.replace('["', '"').replace('"]=', '" ') for k, v in tables.items()}))
    (folder / "tpm.fish").write_text(fish(usage))
    print(f"completion of {len(usage.commands)} commands for bash, zsh and fish in {folder}")


def main():
    if len(sys.argv) != 4 or sys.argv[2] not in ("man", "completion"):
        sys.exit(__doc__)
    program, what, place = sys.argv[1], sys.argv[2], Path(sys.argv[3])
    write_man(program, place) if what == "man" else write_completion(program, place)


if __name__ == "__main__":
    main()
