#!/usr/bin/env python3
"""A second implementation of docs/validate.md for sessions, compared with `tpm validate`.

A law is fitted to a made recording. A session of configs/hil_law.json then renders a law that is 5 % stiffer, and
`tpm validate` compares the first law with the recording of that session. Here, from that recording and the law file
alone: S is the closed form of the law along the motion of the hand, D the force that was sent, u_input the law file's
covariance through the slopes of S, u_D the scatter of the hold about a smooth curve (restricted likelihood), U
Student's interval. Quantities, uncertainties and verdicts of every press, and the means over presses, must agree.

    session_validated.py SOURCE TPM
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import h5py
import numpy as np
from scipy import optimize, stats

STIFFER = 1.05
PARAMETERS = ("k_inf_N_per_m", "k1_N_per_m", "tau1_s")
QUANTITIES = ("peak force", "force at end of hold", "relaxation ratio", "half time")


def relaxation(t, depth, k_inf, k1, tau):
    """Force of k_inf + k1 exp(-t / tau), N/m, under a depth that is linear between its samples and begins at 0."""
    fade = np.exp(-np.diff(t) / tau)
    gain = np.diff(depth) / np.diff(t) * tau * (1.0 - fade)
    memory = np.zeros(len(t))
    for i in range(len(fade)):
        memory[i + 1] = memory[i] * fade[i] + gain[i]
    return k_inf * depth + k1 * memory


class Press:
    """One indentation with its hold: which samples are ramp and hold, and what the quantities of a curve are."""

    def __init__(self, t, depth, hold_asked_s):
        asked = depth[t >= hold_asked_s]
        level = np.median(asked)
        near = np.clip(3.0 * stats.median_abs_deviation(asked, scale="normal"), 0.02 * level, 0.1 * level)
        arrived = np.argmax(depth >= level - near)
        first = np.flatnonzero(depth > depth[0] + 1e-3 * (depth[arrived] - depth[0]))[0] - 1
        last = np.flatnonzero(depth >= 0.9 * level - near)[-1]
        later = slice(first + (arrived - first) // 2, arrived)  # of the ramp: its line meets the hold's
        slope, offset = np.polyfit(t[later], depth[later], 1)
        corner = (depth[arrived + 1:last + 1].mean() - offset) / slope
        self.corner = np.clip(corner, t[arrived - 1], t[arrived + 1])
        self.hold = slice(max(arrived, np.searchsorted(t, self.corner)), last + 1)
        self.t, self.ramp_s = t[self.hold], t[arrived] - t[first]

    def line(self, begin, end, at):
        """Weights of the samples of the hold in a line through those within [begin, end], read at a time."""
        first, last = np.searchsorted(self.t, begin), np.searchsorted(self.t, end, side="right")
        inside = slice(min(first, len(self.t) - 5), max(last, first + 5))
        weights = np.zeros(len(self.t))
        x = self.t[inside] - at
        weights[inside] = np.polyfit(x, np.eye(len(x)), 1)[1]
        return weights

    def quantities(self, curve):
        """Peak, force at the end of the hold, relaxation ratio and half time, and their weights of the samples."""
        y, t, corner = curve[self.hold], self.t, self.corner
        peak_by = self.line(corner, corner + min(0.05 * (t[-1] - corner), self.ramp_s), corner)
        end_by = (t >= t[-1] - 0.1 * (t[-1] - corner)).astype(float)
        end_by /= end_by.sum()
        peak, end = peak_by @ y, end_by @ y

        def near(at, read_at):
            return self.line(at - 0.2 * (at - corner), at + 0.2 * (at - corner), read_at)

        early, late = corner, t[-1]  # the window moves from sample to sample, so there may be several crossings
        for _ in range(50):
            half = 0.5 * (early + late)
            early, late = (half, late) if near(half, half) @ y > 0.5 * (peak + end) else (early, half)
        slope = (near(half, half + 0.1) - near(half, half)) @ y / 0.1
        half_by = (0.5 * (peak_by + end_by) - near(half, half)) / slope
        ratio_by = (end_by - end / peak * peak_by) / peak
        return np.array([peak, end, end / peak, half - corner]), np.array([peak_by, end_by, ratio_by, half_by])


def scatter_of(t, depth, y):
    """Standard deviation and correlation of neighbours of readings about the curve that Schwarz's criterion prefers: a
    constant, decaying exponentials, and, as a hand trembles, the depth and its fading memories. With the degrees of
    freedom of the deviation."""
    x = (t - t[0]) / (t[-1] - t[0])
    memories = [relaxation(t, depth - depth[0], 0.0, 1.0, 0.5 * (t[-1] - t[0]) / 4.0**k) for k in range(6)]
    shapes = np.array([np.ones(len(x))] + [np.exp(-x * 2.0**k) for k in range(10)] + memories + [depth]).T
    shapes /= np.abs(shapes).max(axis=0)
    n = len(y)

    def white(rows, phi):
        return np.concatenate([rows[:1], (rows[1:] - phi * rows[:-1]) / np.sqrt(1.0 - phi**2)])

    def restricted(phi, columns):
        q, r = np.linalg.qr(white(columns, phi))
        left = white(y, phi)
        left = left - q @ (q.T @ left)
        squares, log_det = left @ left, (n - 1) * np.log(1.0 - phi**2)
        deviance = (n - columns.shape[1]) * np.log(squares) + log_det + 2.0 * np.log(np.abs(np.diag(r))).sum()
        return deviance, squares, log_det

    def fitted(places):
        columns = np.linalg.qr(shapes[:, places])[0]
        z = optimize.minimize_scalar(lambda z: restricted(-np.expm1(-z), columns)[0], bounds=(0.0, -np.log(1e-3)),
                                     method="bounded").x
        _, squares, log_det = restricted(-np.expm1(-z), columns)
        return n * np.log(squares / n) + log_det + len(places) * np.log(n), places, squares, -np.expm1(-z)

    best = fitted([0])
    while len(best[1]) < 11:
        more = min(fitted(best[1] + [k]) for k in range(1, shapes.shape[1]) if k not in best[1])
        if more[0] >= best[0]:
            break
        best = more
    _, places, squares, phi = best
    free = n - len(places)
    return np.sqrt(squares / free), phi, max(free * (1.0 - phi) / (1.0 + phi) - 1.0, 1.0)


def verdict(error, expanded, limit):
    if abs(error) + expanded <= limit:
        return "adequate"
    return "not_adequate" if abs(error) - expanded > limit else "undetermined"


def degrees(parts):
    """Welch and Satterthwaite, of pairs of u and its degrees of freedom."""
    return max(sum(u**2 for u, _ in parts)**2 / sum(u**4 / nu for u, nu in parts), 1.0)


def mean_of_presses(errors, own, shared, degrees_of_law):
    """Random effects: REML for the spread between presses, Hartung and Knapp's modified standard error, and what all
    presses share beside it, not reduced by their number."""
    def weighted(spread):
        w = 1.0 / (own**2 + spread)
        mean = w @ errors / w.sum()
        return w, mean, w @ (errors - mean)**2

    def deviance(spread):
        w, _, squares = weighted(spread)
        return -np.log(w).sum() + np.log(w.sum()) + squares

    widest = 10.0 * errors.var() + 1e-30
    spread = optimize.minimize_scalar(lambda share: deviance(share * widest), bounds=(0.0, 1.0), method="bounded").x * widest
    if deviance(0.0) <= deviance(spread):
        spread = 0.0
    w, mean, squares = weighted(spread)
    own_u = np.sqrt(max(1.0, squares / (len(errors) - 1)) / w.sum())
    shared_u = np.linalg.norm(w @ shared) / w.sum()
    nu = degrees([(own_u, len(errors) - 1), (shared_u, degrees_of_law)])
    return mean, stats.t.ppf(0.975, nu) * np.hypot(own_u, shared_u)


def measured(rows, phases, law):
    """Every press of a session: S, D, E, u_input, u_D and U of each quantity; and the means over presses."""
    t, depth, force = rows["time_s"], np.maximum(rows["tool_depth_m"], 0.0), rows["commanded_N"]
    values = np.array([law["parameters"][p] for p in PARAMETERS])
    fit = law["fit"]
    at = [fit["parameters"].index(p) for p in PARAMETERS]
    by_coordinate = [v if fit["coordinates"][i] == "log" else 1.0 for i, v in zip(at, values)]
    covariance = np.array(fit["covariance"])[np.ix_(at, at)]
    covariance *= np.outer(by_coordinate, by_coordinate)
    simulated = relaxation(t, depth, *values)
    beside = [[relaxation(t, depth, *(values * (1.0 + sign * 1e-4 * (np.arange(3) == i)))) for sign in (1, -1)]
              for i in range(3)]
    slope = np.array([(up - down) / (2e-4 * v) for (up, down), v in zip(beside, values)])
    presses = []
    for i in np.flatnonzero(phases["kind"] == "indent"):
        inside = np.flatnonzero((rows["phase"] == i) | (rows["phase"] == i + 1))
        inside = inside[::max(len(inside) // 2000, 1)]
        press = Press(t[inside], depth[inside], phases["end_s"][i])
        s, s_by = press.quantities(simulated[inside])
        d, d_by = press.quantities(force[inside])
        shared = s_by @ slope[:, inside][:, press.hold].T @ np.linalg.cholesky(covariance)
        sigma, phi, nu = scatter_of(press.t, depth[inside][press.hold], force[inside][press.hold])
        correlation = phi**(np.abs(press.t[:, None] - press.t) / np.median(np.diff(press.t)))
        u_d = sigma * np.sqrt(np.einsum("qi,ij,qj->q", d_by, correlation, d_by))
        u_input = np.linalg.norm(shared, axis=1)
        presses.append([])
        for q in range(len(QUANTITIES)):
            effective = degrees([(u_d[q], nu), (u_input[q], fit["degrees_of_freedom"])])
            expanded = stats.t.ppf(0.975, effective) * np.hypot(u_d[q], u_input[q])
            presses[-1].append({"S": s[q], "D": d[q], "E": s[q] - d[q], "u_D": u_d[q], "u_input": u_input[q],
                                "U": expanded, "shared": shared[q]})
    means = []
    for q in range(len(QUANTITIES)):
        of = lambda key: np.array([press[q][key] for press in presses])
        size = np.abs(of("S"))
        error, expanded = mean_of_presses(of("E") / size, of("u_D") / size, of("shared") / size[:, None],
                                          fit["degrees_of_freedom"])
        means.append({"E": error, "U": expanded})
    return presses, means


def close(name, found, expected, relative, absolute=0.0):
    assert abs(found - expected) <= relative * abs(expected) + absolute, f"{name}: {found}, here {expected}"


def compare(answer, presses, means, share):
    assert len(presses) == len(answer["recordings"])
    for press, told in zip(presses, answer["recordings"]):
        assert [q["quantity"] for q in told["quantities"]] == list(QUANTITIES), told
        for here, q in zip(press, told["quantities"]):
            name = f"{told['recording']}, {q['quantity']}, "
            close(name + "S", q["S"], here["S"], 1e-5)
            close(name + "D", q["D"], here["D"], 1e-5)
            close(name + "E", q["E"], here["E"], 0.0, 1e-6 * abs(here["D"]))
            close(name + "u_input", q["u_input"], here["u_input"], 2e-3)
            close(name + "u_D", q["u_D"], here["u_D"], 0.1)
            close(name + "U", q["U"], here["U"], 5e-3)
            expected = verdict(here["E"], here["U"], share * abs(here["D"]))
            assert q["verdict"] == expected, (name, q["verdict"], expected)
    for here, mean in zip(means, answer["pooled"]):
        close(mean["quantity"] + ", mean E", mean["E"], here["E"], 0.0, 1e-5)
        close(mean["quantity"] + ", U of the mean", mean["U"], here["U"], 5e-3)
        assert mean["verdict"] == verdict(here["E"], here["U"], share), (mean, here)


def main():
    source, tpm = Path(sys.argv[1]), sys.argv[2]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)

        def run(*words, code=0):
            done = subprocess.run([tpm, *words], cwd=folder, stdout=subprocess.PIPE, text=True)
            assert done.returncode == code, (words, done)
            return done.stdout

        t = np.arange(0.0, 30.0, 0.05)
        depth = np.clip(t - 1.0, 0.0, 4.0) * 1e-3
        force = relaxation(t, depth, 60.0, 45.0, 2.0) + 2e-3 * np.random.default_rng(1).normal(size=len(t))
        lines = [f"{a:.2f},{1e3 * b:.4f},{c:.6f}" for a, b, c in zip(t, depth, force)]
        (folder / "recording.csv").write_text("\n".join(["time [s],depth [mm],force [N]", *lines, ""]))
        run("fit", "recording.csv", "--folder", "fitted", "--laws", "linear-1")
        law = json.loads((folder / "fitted/law.json").read_text())
        # Without the recording of the fit, u_input is that of the covariance in the law file.
        (folder / "recording.csv").unlink()
        stiffer = {key: value for key, value in law.items() if key not in ("fit", "adequacy")}
        stiffer["parameters"] = {**law["parameters"], "k_inf_N_per_m": STIFFER * law["parameters"]["k_inf_N_per_m"]}
        (folder / "stiffer.json").write_text(json.dumps(stiffer))
        run("hil", "run", str(source / "configs/hil_law.json"), "--law", "stiffer.json", "-o", "session.tpmrec")
        run("hil", "export", "session.tpmrec", "-o", "session.h5")
        with h5py.File(folder / "session.h5") as file:
            rows = {key: file["rows"][key][:-1] for key in ("time_s", "phase", "tool_depth_m", "commanded_N")}
            phases = {"kind": file["phases/kind"].asstr()[:], "end_s": file["phases/end_s"][:]}
        presses, means = measured(rows, phases, law)
        for share, code, expected in ((0.1, 0, "adequate"), (0.04, 1, "not_adequate")):
            answer = json.loads(run("validate", "fitted/law.json", "session.tpmrec", "--require", f"{share:g}",
                                    "--format", "json", code=code))
            compare(answer, presses, means, share)
            assert answer["verdict"] == expected, answer["verdict"]
            # Forces that a model answered validate no law.
            assert "forces_rendered" in [remark["code"] for remark in answer["remarks"]]
            assert answer["summary"].startswith("of the rendering: "), answer["summary"]
            print(f"{len(answer['recordings'])} presses, requirement {share:g}: {answer['verdict']}")


if __name__ == "__main__":
    main()
