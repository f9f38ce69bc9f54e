#!/usr/bin/env python3
"""Every command that writes, the drawing scripts and the Python module are asked to write over what they read.

    outputs.py ROOT TPM [PAGE.md]

The output is in turn the input itself, a symbolic and a hard link to it, a folder, and a file on a full disk. Each run
has to end in one line and an exit code that is not 0, leave the input as it was, and leave nothing else behind. Full
disks need the right to mount one; without it they are left out, and the last line says so.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

MADE = """
example recording --folder .
fit recording.csv --laws linear-1 --starts 2 --folder fitted
simulate star.json -o star.h5
sweep sweep.json -o sweep.h5
hil run session.json -o session.tpmrec
data pack evren_static -o packed.h5
network build organ.json -o built.h5
"""
STAR = ('{"organ": {"kind": "star", "spacing": "30 mm"}, "material": {"E1": "12 kPa", "E2": "12 kPa", "Eprime": "12 kPa", '
        '"eta1": "2.4e4 Pa s"}%s}')
INPUTS = {
    "star.json": STAR % (', "protocol": {"kind": "ramp_hold", "depth": "2 mm", "rate": "4 mm/s", "hold": "1 s"}'),
    "organ.json": STAR % "",
    "session.json": '{"title": "t", "model": {"kind": "element", "scene": ' + STAR % "" + '}, "indentations": {"depths": ["2 mm"], '
                    '"rates": ["4 mm/s"], "hold": "1 s", "rest": "1 s"}}',
    "sweep.json": '{"model": "single_contact", "indentation": {"kind": "step_hold"}, "outputs": ["peak_force"], "axes": '
                  '[{"parameter": "depth", "from": "1 mm", "to": "2 mm", "count": 4}, {"parameter": "spacing", "values": ["20 mm"]}]}',
}
# Name, the input, what is typed: OUT is the output.
COMMANDS = [
    ("fit CONFIG", "liver.json", "fit liver.json --starts 2 -o OUT"),
    ("fit RECORDING", "recording.csv", "fit recording.csv --laws linear-1 --starts 2 --no-draw -o OUT"),
    ("fit with its folder", "", "fit recording.csv --laws linear-1 --starts 2 -o OUT"),
    ("predict", "law.json", "predict law.json --depth 2mm --rate 1mm/s --hold 5s -o OUT"),
    ("validate", "law.json", "validate law.json recording.csv -o OUT"),
    ("identify", "recording.csv", "identify recording.csv -o OUT"),
    ("export", "law.json", "export law.json --to json -o OUT"),
    ("design", "design.json", "design design.json --repetitions 0 -o OUT"),
    ("view", "law.json", "view law.json -o OUT"),
    ("network build", "organ.json", "network build organ.json -o OUT"),
    ("material", "law.json", "material law.json --scene organ.json -o OUT"),
    ("simulate", "star.json", "simulate star.json -o OUT"),
    ("simulate --planned", "star.json", "simulate star.json --planned --costs nominal -o OUT"),
    ("plan", "star.json", "plan star.json --costs nominal --brief -o OUT"),
    ("sweep", "sweep.json", "sweep sweep.json -o OUT"),
    ("sweep sensitivity", "sobol.h5", "sweep sensitivity sobol.h5 --folder OUT"),
    ("hil run", "session.json", "hil run session.json -o OUT"),
    ("hil export", "session.tpmrec", "hil export session.tpmrec -o OUT"),
    ("budget", "law.json", "budget law.json --depth 2mm --rate 1mm/s --hold 5s -o OUT"),
    ("paper tables", "", "paper tables -o OUT"),
    ("paper audit", "claims.json", "paper audit claims.json -o OUT"),
    ("data pack", "packed.h5", "data pack packed.h5 -o OUT"),
    ("schema", "", "schema scene -o OUT"),
    ("draw_figures.py", "figures.json", "SCRIPTS/draw_figures.py figures.json OUT"),
    ("draw_network.py", "network.svg", "SCRIPTS/draw_network.py network.svg OUT"),
    ("tpmkit.simulate", "star.json", "PYTHON import tpmkit; tpmkit.simulate('star.json', output='OUT')"),
    ("tpmkit.sweep", "sweep.json", "PYTHON import tpmkit; tpmkit.sweep('sweep.json', 'OUT', workers=1)"),
    ("tpmkit.run_session", "session.json", "PYTHON import tpmkit; tpmkit.run_session('session.json', 'OUT')"),
    ("tpmkit.Fit.save", "recording.csv", "PYTHON import tpmkit; tpmkit.fit('recording.csv', law='linear-1', starts=2).save('OUT')"),
    ("tpmkit.Law.write", "law.json", "PYTHON import tpmkit; tpmkit.Law.read('law.json').write('OUT')"),
    ("tpmkit.view", "law.json", "PYTHON import tpmkit; tpmkit.view('law.json', 'OUT')"),
]
IS_FOLDER = {"draw_figures.py", "tpmkit.Fit.save", "sweep sensitivity"}  # their output is a folder
IS_STEM = {"draw_network.py"}  # to which endings are added
ENDINGS = {"view": ".html", "tpmkit.view": ".html"}  # of the output, where that of the input is refused
GOES_ON = (".blocks",)  # what the same command takes up again
WAYS = ("itself", "symbolic link", "hard link", "folder", "full disk")


def call(tpm, root, typed, out, folder, prefix=()):
    words = typed.split()
    if words[0] == "PYTHON":
        done = [sys.executable, "-c", typed.removeprefix("PYTHON ").replace("OUT", out)]
    elif words[0].startswith("SCRIPTS/"):
        done = [sys.executable, str(root / words[0].lower()), *[w.replace("OUT", out) for w in words[1:]]]
    else:
        done = [str(tpm), *[w.replace("OUT", out) for w in words]]
    return subprocess.run([*prefix, *done], cwd=folder, capture_output=True, text=True, check=False, timeout=1200,
                          env={**os.environ, "MPLBACKEND": "Agg", "PYTHONDONTWRITEBYTECODE": "1"})


def content(folder):
    return {str(p.relative_to(folder)): (p.read_bytes() if p.is_file() else None) for p in sorted(folder.rglob("*"))}


def tried(tpm, root, made, name, source, typed, way):
    """What went wrong, or None; '' where there is nothing to try."""
    if way in ("itself", "symbolic link", "hard link") and not source:
        return ""
    if way == "full disk" and name == "fit with its folder":
        return ""  # its folder is elsewhere, and whole
    with tempfile.TemporaryDirectory(prefix="tpm-outputs-") as place:
        folder = Path(place) / "work"
        shutil.copytree(made, folder, symlinks=True)
        out, prefix = "there" + ENDINGS.get(name, Path(source).suffix or ".json"), ()
        if way == "itself":
            out = source
        elif way == "symbolic link":
            (folder / out).symlink_to(source)
        elif way == "hard link":
            os.link(folder / source, folder / out)
        elif way == "folder":
            if name in IS_FOLDER:
                return ""
            (folder / out).mkdir()
        else:
            out = "disk/" + out
            prefix = ("unshare", "-m", "bash", "-c", 'mount -t tmpfs -o size=8k none disk && head -c 8192 /dev/zero > disk/full; '
                      '"$@"; code=$?; rm disk/full; find disk -type f > left; exit $code', "bash")
            (folder / "disk").mkdir()
        before = content(folder)
        if name in IS_STEM:
            out = out.removesuffix(Path(out).suffix)
        done = call(tpm, root, typed, out, folder, prefix)
        after = content(folder)
        left = [f for f in (after.pop("left", b"") or b"").decode().split() if not f.endswith(GOES_ON)]
        said = [line for line in done.stderr.splitlines() if line.strip()]
        if done.returncode == 0:
            return "ended with 0"
        if not typed.startswith("PYTHON") and (len(said) != 1 or "Traceback" in done.stderr):
            return f"{len(said)} lines on standard error: {done.stderr[-300:]}"
        if typed.startswith("PYTHON") and "tpmkit" not in said[-1]:
            return f"ended in {said[-1] if said else 'nothing'}"
        if left:
            return f"left {left} on the full disk"
        changed = [k for k in before if after.get(k, 0) != before[k]]
        if changed:
            return f"changed {changed}"
        if set(after) - set(before):
            return f"left {sorted(set(after) - set(before))}"
    return None


def make(tpm, root, folder):
    for name, text in INPUTS.items():
        (folder / name).write_text(text, encoding="utf-8")
    shutil.copy(root / "configs/liver_relaxation.json", folder / "liver.json")
    shutil.copy(root / "configs/design_meat.json", folder / "design.json")
    shutil.copy(root / "data/paper_claims.json", folder / "claims.json")
    sobol = ('{"model": "single_contact", "indentation": {"kind": "step_hold", "depth": "2 mm"}, "outputs": ["peak_force"], "axes": '
             '[{"samples": "sensitivity", "count": 64, "replicates": 2, "parameters": {"E1": {"from": "10 kPa", "to": "20 kPa"}, '
             '"spacing": {"from": "20 mm", "to": "40 mm"}}}]}')
    (folder / "sobol.json").write_text(sobol, encoding="utf-8")
    for line in [*MADE.strip().splitlines(), "sweep sobol.json -o sobol.h5", "network show organ.json -o network"]:
        done = call(tpm, root, line, "", folder)
        if done.returncode != 0:
            sys.exit(f"outputs.py: tpm {line}: {done.stderr}")
    for name in ("law.json", "selection.json"):
        shutil.copy(folder / "fitted" / name, folder / name)
    draw = call(tpm, root, "predict law.json --depth 2mm --rate 1mm/s --hold 5s --folder predicted", "", folder)
    if draw.returncode != 0:
        sys.exit(f"outputs.py: {draw.stderr}")
    shutil.copy(folder / "predicted/figures.json", folder / "figures.json")
    (folder / "network.json").rename(folder / "network.svg")
    for ending in ("png", "pdf"):
        (folder / f"network.{ending}").unlink(missing_ok=True)
    for name in ("fitted", "predicted"):
        shutil.rmtree(folder / name)


def can_mount():
    return subprocess.run(["unshare", "-m", "bash", "-c", "mount -t tmpfs none /mnt"], capture_output=True, check=False).returncode == 0


def main():
    root, tpm = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()
    only = os.environ.get("TPM_OUTPUTS_ONLY", "")
    module = subprocess.run([sys.executable, "-c", "import tpmkit"], capture_output=True, check=False).returncode == 0
    ways = [w for w in WAYS if w != "full disk" or can_mount()]
    faults, rows = [], []
    with tempfile.TemporaryDirectory(prefix="tpm-made-") as name:
        made = Path(name)
        make(tpm, root, made)
        for command, source, typed in COMMANDS:
            if only not in command or (typed.startswith("PYTHON") and not module):
                continue
            row = [command]
            for way in ways:
                fault = tried(tpm, root, made, command, source, typed, way)
                row.append("-" if fault == "" else "refused" if fault is None else "wrong")
                if fault:
                    faults.append(f"{command}: {way}: {fault}")
                    print(faults[-1], flush=True)
            rows.append(row)
    if len(sys.argv) > 3:
        lines = ["| command | " + " | ".join(ways) + " |", "| --- |" + " --- |" * len(ways)]
        Path(sys.argv[3]).write_text("\n".join(lines + ["| " + " | ".join(r) + " |" for r in rows]) + "\n", encoding="utf-8")
    print(f"{len(rows)} commands, {len(ways)} outputs each{'' if 'full disk' in ways else ', no right to mount a full disk'}"
          f"{'' if module else ', no module tpmkit'}: {len(faults)} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
