#!/usr/bin/env python3
"""Types the four paths of docs/site/start_*.md as a new user would, in an empty folder, and writes what was answered.

    first_steps.py TPM PAGE.md
"""
import datetime
import subprocess
import sys
import tempfile
import time
from pathlib import Path

PATHS = {
    "A recording": ["tpm example", "tpm example recording", "tpm fit recording.csv", "tpm view recording_fit",
                    'tpm predict recording_fit/law.json --depth "4 mm" --rate "1 mm/s" --hold "30 s"', "tpm fit evren_relaxation"],
    "An organ": ["tpm simulate configs/liver_poke.json -o poke.h5", "tpm view poke.h5", "tpm plan configs/plan/servo.json"],
    "A device": ['tpm hil check --device virtual --loop-rate "1 kHz" --duration "5 s"', "tpm hil run configs/hil_liver.json -o session.tpmrec",
                 "tpm hil verify session.tpmrec", "tpm view session.tpmrec -o session.html"],
    "A paper": ["tpm paper tables --depths \"2,4,6,8 mm\" --spacings \"20,25,30,35 mm\"", "tpm paper audit", "tpm paper report --folder paper"],
}
LAST = 10
KEPT = "## Figures before and after"


def main():
    program, page = Path(sys.argv[1]).resolve(), Path(sys.argv[2])
    out = [f"# The four paths typed, {datetime.date.today().isoformat()}", "",
           "Each command as a new user types it, in an empty folder, with its exit code, wall time and last ten lines. The",
           "machine was shared with other work, so times are upper bounds, and `tpm hil check`, which measures the machine, may",
           "say `not kept`. Written by", "",
           f"    python3 scripts/first_steps.py build/release/tpm reports/first_steps/{page.name}"]
    with tempfile.TemporaryDirectory() as folder:
        for name, commands in PATHS.items():
            out += ["", f"## {name}"]
            for command in commands:
                begin = time.monotonic()
                done = subprocess.run(["bash", "-c", command.replace("tpm", f"'{program}'", 1)], cwd=folder, text=True,
                                      stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
                took = time.monotonic() - begin
                text = done.stdout.replace(str(program.parents[2]), "SHARE").replace(folder, "FOLDER")
                lines = [line.rstrip() for line in text.rstrip().splitlines()]
                out += ["", f"`{command}`: exit code {done.returncode}, {took:.1f} s, {len(lines)} lines", ""]
                out += [f"    {line}".rstrip() for line in lines[-LAST:]]
    old = page.read_text(encoding="utf-8") if page.exists() else ""
    kept = old.find(KEPT)  # written by hand
    page.write_text("\n".join(out) + "\n" + ("\n" + old[kept:] if kept >= 0 else ""), encoding="utf-8")


if __name__ == "__main__":
    main()
