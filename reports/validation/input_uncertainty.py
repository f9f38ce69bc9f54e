#!/usr/bin/env python3
"""u_input with and without what was measured of the zero, linearised, beside tpm (needs numpy).

The calibration of the page: 60 + 45 exp(-t / 2 s) N/m, a ramp of 1 mm/s to 4 mm, 20 s of hold, a reading
every 0.1 s with 2 mN of white noise, 40 readings of rest. Prints u_input of peak and end of the hold of the
validation (4 mm/s to 3 mm), and how far U is too wide where the zero is taken for free, with a rest of 10.
"""
from math import erf, sqrt

import numpy as np

SIGMA, REST, REST_OF_VALIDATION, RECORDINGS = 2e-3, 40, 10, 5


def force(t, rate, depth, k_inf, k1, tau, contact=0.0):
    t = np.clip(t - contact / rate, 0.0, None)
    up = np.minimum(t, (depth - contact) / rate)
    return k_inf * rate * up + k1 * rate * tau * (np.exp(-(t - up) / tau) - np.exp(-t / tau))


def slopes(t, rate, depth):
    """d force / d (k_inf, k1, tau, contact), by central differences."""
    columns = []
    for i, step in enumerate([1e-3, 1e-3, 1e-5, 1e-7]):
        at = [np.array([60.0, 45.0, 2.0, 0.0]) for _ in range(2)]
        at[0][i] += step
        at[1][i] -= step
        columns.append((force(t, rate, depth, *at[0]) - force(t, rate, depth, *at[1])) / (2 * step))
    return np.array(columns).T


def line_at(t, inside, at):
    """Weights of a straight line through the samples inside, read at a time."""
    x = t[inside] - t[inside].mean()
    weight = np.zeros(len(t))
    weight[inside] = 1.0 / len(x) + x * (at - t[inside].mean()) / (x @ x)
    return weight


t = np.arange(0.0, 24.01, 0.1)
by = slopes(t, 1e-3, 4e-3)
fitted = np.column_stack([by[:, :3], np.ones(len(t)), by[:, 3]])  # law, zero, contact
tv = np.arange(0.0, 20.76, 0.1)
asked = slopes(tv, 4e-3, 3e-3)[:, :3]
corner = 0.75
end = np.where(tv >= 20.75 - 2.0, 1.0, 0.0)
weights = {"peak": line_at(tv, (tv >= corner) & (tv <= 2 * corner), corner), "end of hold": end / end.sum()}


def u_input(zero_sd, contact_is_fitted, name):
    a = fitted if contact_is_fitted else fitted[:, :4]
    information = a.T @ a / SIGMA**2
    if zero_sd:
        information[3, 3] += 1.0 / zero_sd**2
    covariance = np.linalg.inv(information)[:3, :3]
    g = weights[name] @ asked
    return sqrt(g @ covariance @ g)


zero_sd = SIGMA / sqrt(REST)
for contact in (False, True):
    print("contact", "fitted" if contact else "known")
    for name, w in weights.items():
        free, measured = (u_input(sd, contact, name) for sd in (None, zero_sd))
        own = SIGMA * sqrt(w @ w + w.sum() ** 2 / REST_OF_VALIDATION)
        for what, u_own in (("one recording", own), (f"mean of {RECORDINGS}", own / sqrt(RECORDINGS))):
            wide = sqrt(u_own**2 + free**2) / sqrt(u_own**2 + measured**2)
            print(f"  {name}, {what}: u_input {1e3 * measured:.2f} mN, with a free zero {1e3 * free:.2f} mN; "
                  f"U {wide:.2f} times as wide, |E| <= U in {100 * erf(1.96 * wide / sqrt(2)):.1f} %")
