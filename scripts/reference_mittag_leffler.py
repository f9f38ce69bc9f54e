#!/usr/bin/env python3
"""Writes tests/fixtures/mittag_leffler.csv: E_{alpha,beta}(-z) to 25 digits.

    python3 scripts/reference_mittag_leffler.py > tests/fixtures/mittag_leffler.csv

Needs mpmath. Shares no formula with src/tpm/solve/mittag_leffler.cpp beyond the definition: up to
t = z^(1/alpha) = 95 the power series in enough digits to survive its cancellation (terms reach
exp(t)), above it the asymptotic series, whose smallest term is about exp(-t). Where both reach the
digits (95 <= t <= 130) they are compared, and a disagreement stops the script. alpha = 1 is in
closed form. z and alpha are the binary numbers that the table names, taken exactly.
"""
import sys

import mpmath as mp

DIGITS = 25
ALPHAS = [0.05, 0.1, 0.25, 0.5, 0.75, 0.9, 0.95, 0.99, 0.999, 0.99999, 1.0]
TIMES = sorted([10.0 ** (k / 2 - 6) for k in range(25)] + [0.3, 2.0, 5.0, 7.0, 15.0, 20.0, 40.0, 120.0])
BETAS = {"1": lambda a: mp.mpf(1), "2": lambda a: mp.mpf(2), "alpha": lambda a: a, "1+alpha": lambda a: 1 + a}


def power_series(alpha, beta, z):
    """Sum of (-z)^n / Gamma(alpha n + beta)."""
    time = z ** (1 / alpha)
    with mp.workdps(int(DIGITS + 25 + float(time))):
        total, power, n = mp.mpf(0), mp.mpf(1), 0
        small = mp.mpf(10) ** (-DIGITS - 20 - int(float(time) / 2.3))
        while True:
            term = power * mp.rgamma(alpha * n + beta)
            total += term
            if alpha * n > time and abs(term) < small:
                return +total
            power *= -z
            n += 1


def asymptotic_series(alpha, beta, z):
    """Sum of (-1)^(k-1) z^(-k) / Gamma(beta - alpha k), cut where the terms no longer count."""
    with mp.workdps(DIGITS + 40):
        total, power, k, quiet = mp.mpf(0), mp.mpf(1), 1, 0
        while quiet < 10:  # single terms may vanish at the poles of Gamma
            power /= -z
            term = -power * mp.rgamma(beta - alpha * k)
            if abs(term) <= abs(total) * mp.mpf(10) ** (-DIGITS - 5):
                quiet += 1
            else:
                quiet = 0
            total += term
            k += 1
            if alpha * k > z ** (1 / alpha):
                sys.exit(f"asymptotic series does not reach the digits: alpha={alpha} z={z}")
        return +total


def exponential(beta, z):
    return mp.exp(-z) if beta == 1 else -mp.expm1(-z) / z


def mittag_leffler(alpha, beta, z):
    if alpha == 1:
        with mp.workdps(DIGITS + 20):
            return exponential(beta, z)
    time = z ** (1 / alpha)
    if time < 95:
        return power_series(alpha, beta, z)
    far = asymptotic_series(alpha, beta, z)
    if time <= 130:
        near = power_series(alpha, beta, z)
        if abs(near - far) > abs(near) * mp.mpf(10) ** (-DIGITS + 2):
            sys.exit(f"series disagree: alpha={alpha} beta={beta} z={z}: {near} {far}")
    return far


def main():
    mp.mp.dps = DIGITS + 20
    print("# E_{alpha,beta}(-z), written by scripts/reference_mittag_leffler.py")
    print("alpha,beta,z,value")
    for alpha in ALPHAS:
        for time in TIMES:
            z = time ** alpha
            for name, beta in BETAS.items():
                exact = mp.mpf(alpha)
                value = mittag_leffler(exact, beta(exact), mp.mpf(z))
                print(f"{alpha!r},{name},{z!r},{mp.nstr(value, DIGITS, min_fixed=1, max_fixed=0)}")


if __name__ == "__main__":
    main()
