#!/usr/bin/env python3
"""An independent reference for quasi-static runs of a network: force and time.

Reads what `tpm network build SCENE -o NETWORK` wrote, pushes the contact sphere along its inward
normal at a rate to a depth and holds it there. Forces balance on every free sphere at each step
(Newton's method with scipy's sparse LU); between steps the elongation of a bond is taken to be
linear in time, for which what it remembers is exact. That is of second order: two meshes, one with
every step of the other halved, give the fourth by Richardson's extrapolation and the error of the
finer. Shares no code with tpm.

usage: reference_quasistatic.py NETWORK.h5 --tau 10 [--depth 8 --rate 4 --end 31 --steps 12]
Prints JSON: time_s, the ends of the coarser mesh's steps; force_N there, extrapolated; error_N, the change by
the extrapolation; force_at_peak_N, force_at_end_N and *_finer_N, *_error_N of the two corners; steps, cpu_s and
finer_cpu_s.
"""
import argparse
import json
import time

import h5py
import numpy as np
import scipy.sparse as sparse
import scipy.sparse.linalg as linalg

STIFFNESS_M = 12.56e-6 / 1e-3  # A0 / l0


class Bonds:
    """Of a network with positions at `rest`, `ends` of bonds and their `length` at rest."""

    def elongation(self, x):
        span = x[self.ends[:, 1]] - x[self.ends[:, 0]]
        length = np.linalg.norm(span, axis=1)
        return length - self.length, span / length[:, None], length

    def forces(self, pull, unit):
        force = np.zeros_like(self.rest)
        np.add.at(force, self.ends[:, 0], pull[:, None] * unit)
        np.add.at(force, self.ends[:, 1], -pull[:, None] * unit)
        return force

    def stiffness(self, slope, pull, unit, length, basis):
        """The matrix of the coordinates that may move: the columns of a basis."""
        across = (pull / length)[:, None, None]
        block = (slope[:, None, None] - across) * unit[:, :, None] * unit[:, None, :]
        block += across * np.eye(3)
        a, b = 3 * self.ends[:, 0], 3 * self.ends[:, 1]
        three = np.arange(3)
        entries, rows, columns = [], [], []
        for i, j, sign in ((a, a, 1), (b, b, 1), (a, b, -1), (b, a, -1)):
            rows.append(np.broadcast_to(i[:, None, None] + three[:, None], block.shape).ravel())
            columns.append(np.broadcast_to(j[:, None, None] + three, block.shape).ravel())
            entries.append(sign * block.ravel())
        size = 3 * len(self.rest)
        where = (np.concatenate(rows), np.concatenate(columns))
        matrix = sparse.csc_matrix((np.concatenate(entries), where), (size, size))
        return (basis.T @ matrix @ basis).tocsc()


class Tissue(Bonds):
    """Bonds N = k l - g y along themselves, and the coordinates that may move."""

    def __init__(self, path, modulus_Pa):
        with h5py.File(path, "r") as f:
            self.rest = f["spheres/position_m"][:]
            normal = f["spheres/normal"][:]
            constraint = f["spheres/constraint"][:]
            contact = int(np.flatnonzero(f["spheres/contact"][:])[0])
            self.ends = f["bonds/ends"][:].astype(int)
            radial = f["bonds/kind"][:] == 0
            factor = f["bonds/factor"][:]
            self.length = f["bonds/rest_length_m"][:]
        if (constraint == 1).any():
            raise SystemExit("reference: guided spheres are not known here")
        self.k = factor * STIFFNESS_M * modulus_Pa
        self.g = np.where(radial, 0.5 * self.k, 0.0)  # E1 = E2
        self.push = np.zeros((len(self.rest), 3))
        self.push[contact] = -normal[contact]
        columns = np.eye(3 * len(self.rest))[:, np.repeat(constraint == 0, 3)]
        rows = slice(3 * contact, 3 * contact + 3)
        across = np.linalg.svd(normal[contact][None])[2][1:]  # two directions beside the push
        keep = ~columns[rows].any(axis=0)
        sideways = np.zeros((columns.shape[0], 2))
        sideways[rows] = across.T
        self.basis = sparse.csc_matrix(np.hstack([columns[:, keep], sideways]))

    def balance(self, x, offset, following):
        """x with the forces balanced where y = offset + following l, and the contact force."""
        slope = self.k - self.g * following
        for _ in range(30):
            l, unit, length = self.elongation(x)
            pull = slope * l - self.g * offset
            force = self.forces(pull, unit)
            left = self.basis.T @ force.ravel()
            if np.linalg.norm(left) < 1e-13:
                return x, -np.sum(force * self.push)
            change = linalg.splu(self.stiffness(slope, pull, unit, length, self.basis)).solve(left)
            x = x + (self.basis @ change).reshape(-1, 3)
            if np.linalg.norm(change) < 1e-15:
                return x, -np.sum(force * self.push)
        raise SystemExit("reference: Newton's method does not converge")


def mesh(length, tau, steps):
    """Steps that begin at a share of tau and grow."""
    h = [min(tau, length) / steps]
    while sum(h) < length:
        h.append(h[-1] * (1.0 + 2.0 / steps))
    h = np.array(h[:-1] if len(h) > 1 else h)
    return h * (length / h.sum())


def run(tissue, tau, depth, rate, end, steps, halved):
    x, y = tissue.rest.copy(), np.zeros_like(tissue.length)
    l, at, now_s, answers, corners = np.zeros_like(y), 0.0, 0.0, [], []
    for length, speed in ((depth / rate, rate), (end - depth / rate, 0.0)):
        for h in np.repeat(mesh(length, tau, steps) / (2 if halved else 1), 2 if halved else 1):
            z = h / tau
            decay = np.exp(-z)
            now = 1.0 + np.expm1(-z) / z  # weight of l at the end of the step
            offset = decay * y + (1.0 - decay - now) * l
            at += speed * h
            now_s += h
            guess = x + (at - np.sum((x - tissue.rest) * tissue.push)) * tissue.push
            x, force = tissue.balance(guess, offset, now)
            l = tissue.elongation(x)[0]
            y = offset + now * l
            answers.append((now_s, force))
        corners.append(len(answers) - 1)
    return np.array(answers), np.array(corners)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("network")
    parser.add_argument("--tau", type=float, required=True, help="s")
    parser.add_argument("--modulus", type=float, default=12.0, help="E1 = E2 = E', kPa")
    parser.add_argument("--depth", type=float, default=8.0, help="mm")
    parser.add_argument("--rate", type=float, default=4.0, help="mm/s")
    parser.add_argument("--end", type=float, default=31.0, help="s")
    parser.add_argument("--steps", type=int, default=12, help="of the coarser mesh in one tau")
    options = parser.parse_args()
    tissue = Tissue(options.network, 1e3 * options.modulus)
    answers, corners, seconds = [], [], []
    for halved in (False, True):
        begin = time.process_time()
        answer, ends = run(tissue, options.tau, 1e-3 * options.depth, 1e-3 * options.rate,
                           options.end, options.steps, halved)
        seconds.append(time.process_time() - begin)
        answers.append(answer)
        corners.append(ends)
    coarser, finer = answers[0], answers[1][1::2]  # at the same times
    best = (4.0 * finer[:, 1] - coarser[:, 1]) / 3.0
    error = np.abs(best - finer[:, 1])
    result = {"time_s": coarser[:, 0].tolist(), "force_N": best.tolist(), "error_N": error.tolist()}
    for name, i in zip(("peak", "end"), corners[0]):
        result[f"force_at_{name}_N"] = best[i]
        result[f"force_at_{name}_finer_N"] = finer[i, 1]
        result[f"force_at_{name}_error_N"] = error[i]
    result.update(steps=len(answers[1]), cpu_s=sum(seconds), finer_cpu_s=seconds[1])
    print(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
