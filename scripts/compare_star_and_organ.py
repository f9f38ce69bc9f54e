#!/usr/bin/env python3
"""What the paper's "we ignore the displacement of the spheres A and C" costs, in per cent of force.

Pushes the star, the liver with its inner layer held and the liver held at its far side by `tpm
simulate`, with one material (E1 = E2 = E' = 12 kPa, eta1 = 2.4e5 Pa s: a relaxation time of 10 s)
and one spacing (20 mm): ramps of 4 mm/s to 2, 4, 6 and 8 mm, held for 30 s.

usage: compare_star_and_organ.py PATH/TO/tpm [--format json]
Prints the contact force at the end of the ramp and of the hold, N, and its difference from the
star's, %.
"""
import argparse
import json
import pathlib
import subprocess
import tempfile

DEPTHS_MM = (2, 4, 6, 8)
LIVER = {"kind": "liver", "count": 424, "layers": 2, "spacing": "20 mm", "seed": 1}
TISSUES = {
    "star": {"organ": {"kind": "star", "spacing": "20 mm"}},
    "inner layer held": {"organ": LIVER, "anchors": [{"kind": "inner_layer"}]},
    "far side held": {"organ": LIVER, "anchors": [{"kind": "far_side", "fraction": 0.3}]},
}
MATERIAL = {"E1": "12 kPa", "E2": "12 kPa", "Eprime": "12 kPa", "eta1": "2.4e5 Pa s",
            "A0": "12.56 mm^2", "l0": "1 mm"}


def forces(tpm, folder, tissue, depth_mm):
    """At the end of the ramp and of the hold, N."""
    scene = dict(tissue, material=MATERIAL, outputs={"count": 2}, protocol={
        "kind": "ramp_hold", "depth": f"{depth_mm} mm", "rate": "4 mm/s", "hold": "30 s"})
    path = folder / "scene.json"
    path.write_text(json.dumps(scene), encoding="utf-8")
    command = [tpm, "simulate", path, "-o", folder / "result.h5", "--format", "json"]
    answer = json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)
    return answer["largest"]["response"], answer["last"]["response"]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("tpm")
    parser.add_argument("--format", choices=("human", "json"), default="human")
    options = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for depth in DEPTHS_MM:
            star = None
            for name, tissue in TISSUES.items():
                peak, end = forces(options.tpm, pathlib.Path(folder), tissue, depth)
                star = star or (peak, end)
                rows.append({"tissue": name, "depth_m": 1e-3 * depth,
                             "force_at_peak_N": peak, "force_at_end_N": end,
                             "peak_over_star": peak / star[0], "end_over_star": end / star[1]})
    if options.format == "json":
        print(json.dumps(rows, indent=1))
        return
    print("| depth | tissue | peak, N | end, N | peak against the star | end against the star |")
    print("| --- | --- | --- | --- | --- | --- |")
    for r in rows:
        print(f"| {1e3 * r['depth_m']:.0f} mm | {r['tissue']} | {r['force_at_peak_N']:.4f} "
              f"| {r['force_at_end_N']:.4f} | {100 * (r['peak_over_star'] - 1):+.1f} % "
              f"| {100 * (r['end_over_star'] - 1):+.1f} % |")


if __name__ == "__main__":
    main()
