#!/usr/bin/env python3
"""Prints depth and roughness of two results of `tpm simulate` of one scene under a load, side by side.

    compare_roughness.py TISSUE.h5 MASS_SPRING.h5

The second column of each pair is the mass-spring model's; the last of each three, how much rougher the first is.
"""

import argparse

import h5py
import numpy as np


def at_outputs(path):
    with h5py.File(path) as file:
        time, load = file["curve/time_s"][:], file["curve/load_N"][:]
        rows = np.searchsorted(time, file["roughness/time_s"][:])
        return (load[rows], 1e3 * file["curve/depth_m"][:][rows], file["roughness/near_contact"][:],
                file["roughness/at_rim"][:])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("tissue")
    parser.add_argument("mass_spring")
    arguments = parser.parse_args()
    load, depth, near, rim = at_outputs(arguments.tissue)
    _, msm_depth, msm_near, msm_rim = at_outputs(arguments.mass_spring)
    print("| load, N | depth, mm | MSM | near the contact | MSM | | at the rim | MSM | |")
    print("| --- " * 9 + "|")
    for row in zip(load, depth, msm_depth, near, msm_near, near / msm_near - 1, rim, msm_rim, rim / msm_rim - 1):
        print("| {:.3g} | {:.2f} | {:.2f} | {:.4f} | {:.4f} | {:+.1%} | {:.5f} | {:.5f} | {:+.1%} |".format(*row))


if __name__ == "__main__":
    main()
