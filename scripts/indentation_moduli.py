#!/usr/bin/env python3
"""How much the stiffness of an indented half space of cubic elasticity depends on the direction of its surface.

    indentation_moduli.py POISSON ANISOTROPY

Poisson's ratio along an axis and Zener's ratio 2 C44/(C11 - C12), as `tpm network check` prints them. Prints the
largest over the smallest indentation modulus of the five pushes of measure_fillings, and along [001], [011] and [111].
Barnett and Lothe's integral for the displacement under a point force (Vlassak and Nix, Phil. Mag. A 67, 1045, 1993).
"""

import sys

import numpy as np

PUSHES = [(0.1, 0.2, 1.0), (1.0, 0.1, -0.2), (-0.3, 1.0, 0.4), (-0.6, -0.5, 0.8), (0.7, -0.6, -0.5)]
ANGLES = 60


def elasticity(poisson, anisotropy):
    """Of a Young's modulus of 1 along the axes."""
    c11 = (1 - poisson) / ((1 + poisson) * (1 - 2 * poisson))
    c12 = poisson / ((1 + poisson) * (1 - 2 * poisson))
    c44 = anisotropy * (c11 - c12) / 2
    d = np.eye(3)
    c = c12 * np.einsum("ij,kl->ijkl", d, d)
    c += c44 * (np.einsum("ik,jl->ijkl", d, d) + np.einsum("il,jk->ijkl", d, d))
    for i in range(3):
        c[i, i, i, i] += c11 - c12 - 2 * c44
    return c


def modulus(c, normal):
    """Up to a factor that is the same for all directions."""
    normal = np.array(normal) / np.linalg.norm(normal)
    first = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    first /= np.linalg.norm(first)
    second = np.cross(normal, first)

    def between(a, b):
        return np.einsum("i,ijkl,l->jk", a, c, b)

    compliance = 0.0
    for at in np.pi * np.arange(ANGLES) / ANGLES:
        along = np.cos(at) * first + np.sin(at) * second
        across = np.cross(normal, along)
        b = np.zeros((3, 3))
        for turn in np.pi * np.arange(ANGLES) / ANGLES:
            m = np.cos(turn) * across + np.sin(turn) * normal
            n = -np.sin(turn) * across + np.cos(turn) * normal
            b += between(m, m) - between(m, n) @ np.linalg.inv(between(n, n)) @ between(n, m)
        compliance += normal @ np.linalg.inv(b) @ normal
    return 1.0 / compliance


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    c = elasticity(float(sys.argv[1]), float(sys.argv[2]))
    of_pushes = [modulus(c, push) for push in PUSHES]
    axes = [modulus(c, axis) for axis in ((0, 0, 1), (0, 1, 1), (1, 1, 1))]
    print(f"five pushes: {max(of_pushes) / min(of_pushes):.3f}")
    print("[001], [011], [111] over the least: " + ", ".join(f"{a / min(axes):.3f}" for a in axes))


main()
