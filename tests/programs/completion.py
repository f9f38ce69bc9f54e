#!/usr/bin/env python3
"""Completion of shells, as a user meets it: `tpm --json-usage` lists all commands, and the files that
scripts/command_help.py makes from it complete commands, options, values and files.

    completion.py ROOT TPM

Bash is asked; zsh and fish too where they are installed, else they are named and left out.
"""

import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

BASH = """
source "$1"; shift
COMP_WORDS=("$@"); COMP_CWORD=$(( $# - 1 ))
_tpm 2>/dev/null
printf '%s\\n' "${COMPREPLY[@]}"
"""
ZSH = """
compadd() { shift; for word in "$@"; do [[ $word == ${words[CURRENT]}* ]] && print -r -- $word; done }
_files() { print -r -- FILES }
file=$1; shift
words=("$@"); CURRENT=$#
source $file
"""

# What is typed, and words that must be offered, or must not.
CASES = (
    (["tpm", "va"], {"validate"}, {"fit"}),
    (["tpm", "paper", ""], {"report", "tables", "audit", "experiments"}, {"fit"}),
    (["tpm", "fit", "--form"], {"--format"}, {"--overwrite"}),
    (["tpm", "fit", "--format", ""], {"text", "json"}, {"--format"}),
    (["tpm", "fit", "--laws", "power"], {"power-1"}, {"linear-1"}),
    (["tpm", "hil", "run", "--device", "v"], {"virtual"}, {"replay"}),
    (["tpm", "schema", "sc"], {"scene"}, {"fit"}),
    (["tpm", "laws", "hertz"], {"hertz-1"}, {"power-1"}),
)


def answers(shell, folder, words):
    if shell == "bash":
        run = ["bash", "-c", BASH, "bash", str(folder / "tpm"), *words]
    elif shell == "zsh":
        run = ["zsh", "-f", "-c", ZSH, "zsh", str(folder / "_tpm"), *words]
    else:
        line = " ".join(words[:-1]) + " " + words[-1]
        run = ["fish", "--no-config", "-c", f"source {folder / 'tpm.fish'}; complete -C {json.dumps(line)}"]
    out = subprocess.run(run, capture_output=True, text=True, check=False)
    return {line.split("\t")[0] for line in out.stdout.splitlines() if line}


def main():
    root, program = Path(sys.argv[1]), sys.argv[2]
    faults = 0
    usage = json.loads(subprocess.run([program, "--json-usage"], capture_output=True, text=True, check=True).stdout)
    shown = subprocess.run([program, "--help"], capture_output=True, text=True, check=True).stdout
    for command in usage["commands"]:
        if f"  {command['name']} " not in shown:
            faults += 1
            print(f"--json-usage lists {command['name']}, --help does not")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        make = [sys.executable, str(root / "scripts/command_help.py"), program, "completion", str(folder)]
        print(subprocess.run(make, capture_output=True, text=True, check=True).stdout.strip())
        for shell in ("bash", "zsh", "fish"):
            if shutil.which(shell) is None:
                print(f"{shell}: not installed, not asked")
                continue
            for words, offered, kept_back in CASES:
                got = answers(shell, folder, words)
                if not offered <= got or got & kept_back:
                    faults += 1
                    print(f"{shell}: {' '.join(words)}: offers {sorted(got)[:12]}; expected {sorted(offered)}, not {sorted(kept_back)}")
            print(f"{shell}: {len(CASES)} lines completed")
    print(f"{faults} faults")
    sys.exit(faults > 0)


if __name__ == "__main__":
    main()
