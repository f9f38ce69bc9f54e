#!/usr/bin/env python3
"""An independent reference for quasi-static runs with several contacts and loads that stay.

Reads what `tpm network build SCENE -o NETWORK` wrote and nothing else of the scene: positions, constraints, bonds
and their laws (linear ones). What is done to the network stands in a second file, JSON in SI units:

    {"gravity_N": [0, 0, -1e-3],                                   force on every sphere; or "dead_N", one a sphere
     "contacts": [{"spheres": [71], "direction": [0, 0, 1], "drive": "depth", "knots": [[0, 0], [1, 0.002]]},
                  {"spheres": [80, 81], "direction": [0, 0, 1], "drive": "load", "knots": [[0, 0], [1, 0.05]]}],
     "steps": 12}                                                  of the coarser mesh in each piece

Spheres are numbered from 1. A depth moves every sphere of its contact by it; a load is shared by them alike. The
network starts in equilibrium with the loads that stay, every bond relaxed; depths count from there. Forces balance
on every free sphere at each step (Newton's method with scipy's sparse LU); between steps the elongation of a bond is
taken to be linear in time, for which what it remembers is exact. That is of second order: two meshes, one with every
step of the other halved, give the fourth by Richardson's extrapolation. Shares no code with tpm.

usage: reference_contacts.py NETWORK.h5 WHAT.json
Prints JSON: time_s; response of each contact, N or m, extrapolated; error, the change by the extrapolation.
"""
import argparse
import json

import h5py
import numpy as np
import scipy.sparse as sparse
import scipy.sparse.linalg as linalg
from reference_quasistatic import Bonds


class Network(Bonds):
    """Bonds N = (k - g) l + g (l - sum of gamma_j m_j), dm_j/dt = (l - m_j) / tau_j."""

    def __init__(self, path):
        with h5py.File(path, "r") as f:
            self.rest = f["spheres/position_m"][:]
            self.normal = f["spheres/normal"][:]
            self.constraint = f["spheres/constraint"][:]
            held = f["spheres/held_direction"][:] if "spheres/held_direction" in f else None
            self.ends = f["bonds/ends"][:].astype(int)
            self.length = f["bonds/rest_length_m"][:]
            self.k = f["bonds/stiffness_N_per_m"][:]
            self.g = f["bonds/relaxing_N_per_m"][:]
            law = f["bonds/law"][:]
            if f["bonds/rope"][:].any():
                raise SystemExit("reference: ropes are not known here")
            names = [n.decode() if isinstance(n, bytes) else n for n in f["laws/shapes"][:]]
            if names != ["linear"]:
                raise SystemExit(f"reference: shapes {names}, and only linear ones are known here")
            of = f["laws/branch_law"][:]
            shares, times = f["laws/branch_share"][:], f["laws/branch_time_s"][:]
        most = max(int((of == i).sum()) for i in np.unique(law))
        self.share = np.zeros((len(law), most))
        self.tau = np.ones((len(law), most))
        for i in np.unique(law):
            count = int((of == i).sum())
            self.share[np.ix_(law == i, range(count))] = shares[of == i]
            self.tau[np.ix_(law == i, range(count))] = times[of == i]
        # Projectors onto what constraints leave free.
        self.free = np.broadcast_to(np.eye(3), (len(self.rest), 3, 3)).copy()
        self.free[self.constraint == 2] = 0.0
        for i in np.flatnonzero(self.constraint == 1):
            self.free[i] = np.outer(self.normal[i], self.normal[i])
        for i in np.flatnonzero(self.constraint == 3):
            self.free[i] = np.eye(3) - np.outer(held[i], held[i])

    def basis(self, driven):
        """Columns: an orthonormal basis of what may move beside the directions that are driven."""
        free = self.free.copy()
        for sphere, direction in driven:
            along = free[sphere] @ direction
            free[sphere] -= np.outer(along, along) / (along @ along)
        columns, rows, entries = [], [], []
        count = 0
        for i, projector in enumerate(free):
            values, vectors = np.linalg.eigh(projector)
            for value, vector in zip(values, vectors.T):
                if value < 0.5:
                    continue
                rows += [3 * i, 3 * i + 1, 3 * i + 2]
                columns += [count] * 3
                entries += vector.tolist()
                count += 1
        return sparse.csc_matrix((entries, (rows, columns)), (3 * len(self.rest), count))

    def balance(self, x, offset, following, load, basis):
        """x with the forces balanced where the mean memory is offset + following l."""
        slope = self.k - self.g * following
        scale = max(np.abs(load).max(), 1e-3)
        for _ in range(60):
            l, unit, length = self.elongation(x)
            pull = slope * l - self.g * offset
            force = self.forces(pull, unit) + load
            left = basis.T @ force.ravel()
            if np.linalg.norm(left) < 1e-13 * scale:
                break
            matrix = self.stiffness(slope, pull, unit, length, basis)
            change = linalg.splu(matrix).solve(left)
            x = x + (basis @ change).reshape(-1, 3)
            if np.linalg.norm(change) < 1e-15 * np.linalg.norm(x):  # rounding of the positions
                break
        else:
            raise SystemExit("reference: Newton's method does not converge")
        l, unit, _ = self.elongation(x)
        return x, self.forces(slope * l - self.g * offset, unit) + load


class Contact:
    def __init__(self, block):
        self.spheres = np.array(block["spheres"]) - 1
        self.direction = np.array(block["direction"], float)
        self.direction /= np.linalg.norm(self.direction)
        self.by_depth = block["drive"] == "depth"
        self.knots = np.array(block["knots"], float)

    def value(self, time_s):
        return np.interp(time_s, self.knots[:, 0], self.knots[:, 1])


def meshes(contacts, steps):
    """The times of the coarser mesh: steps in each piece that begin short and grow."""
    corners = np.unique(np.concatenate([c.knots[:, 0] for c in contacts]))
    times = [corners[0]]
    for begin, end in zip(corners[:-1], corners[1:]):
        growth = 1.0 + 3.0 / steps
        h = growth ** np.arange(steps)
        times += (begin + (end - begin) * np.cumsum(h) / h.sum()).tolist()
        times[-1] = end  # rounding must not leave the protocol
    return np.array(times)


def run(network, contacts, dead, times):
    free = network.basis([])
    ones = np.ones_like(network.k)
    x, _ = network.balance(network.rest, np.zeros_like(network.k), ones, dead, free)
    start = x.copy()
    driven = [(s, c.direction) for c in contacts if c.by_depth for s in c.spheres]
    basis = network.basis(driven)
    l = network.elongation(x)[0]
    m = np.repeat(l[:, None], network.share.shape[1], axis=1)
    answers = []
    for i, now_s in enumerate(times):
        load = dead.copy()
        guess = x.copy()
        for c in contacts:
            for s in c.spheres:
                if c.by_depth:
                    depth = (guess[s] - start[s]) @ c.direction
                    guess[s] += (c.value(now_s) - depth) * c.direction
                else:
                    load[s] += c.value(now_s) / len(c.spheres) * c.direction
        if i == 0:
            offset, following, keep, now = (network.share * m).sum(1), np.zeros_like(l), 1.0, 0.0
            known = m
        else:
            z = (now_s - times[i - 1]) / network.tau
            keep = np.exp(-z)
            now = 1.0 + np.expm1(-z) / z  # weight of l at the end of the step
            known = keep * m + (1.0 - keep - now) * l[:, None]
            offset = (network.share * known).sum(1)
            following = (network.share * now).sum(1)
        x, force = network.balance(guess, offset, following, load, basis)
        l = network.elongation(x)[0]
        m = known + now * l[:, None]
        answers.append([
            -sum(force[s] @ c.direction for s in c.spheres) if c.by_depth else
            np.mean([(x[s] - start[s]) @ c.direction for s in c.spheres]) for c in contacts])
    return np.array(answers), start


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("network")
    parser.add_argument("what")
    options = parser.parse_args()
    network = Network(options.network)
    with open(options.what) as f:
        what = json.load(f)
    contacts = [Contact(block) for block in what["contacts"]]
    dead = np.zeros_like(network.rest)
    dead += np.array(what.get("gravity_N", [0, 0, 0]), float)
    dead += np.array(what.get("dead_N", 0.0), float)
    coarse = meshes(contacts, what.get("steps", 12))
    fine = np.sort(np.concatenate([coarse, 0.5 * (coarse[1:] + coarse[:-1])]))
    first, start = run(network, contacts, dead, coarse)
    second, _ = run(network, contacts, dead, fine)
    second = second[::2]
    best = (4.0 * second - first) / 3.0
    print(json.dumps({"time_s": coarse.tolist(), "response": best.T.tolist(),
                      "error": np.abs(best - second).max(axis=0).tolist(),
                      "sag_m": float(np.linalg.norm(start - network.rest, axis=1).max())}))


if __name__ == "__main__":
    main()
