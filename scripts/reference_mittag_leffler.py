#!/usr/bin/env python3
"""Writes tests/fixtures/mittag_leffler.csv: E_{alpha,beta}(-z) to 25 digits, and with the option
--slopes tests/fixtures/mittag_leffler_slopes.csv: E_{a,b}(-z) of free orders and its derivatives.

    python3 scripts/reference_mittag_leffler.py > tests/fixtures/mittag_leffler.csv
    python3 scripts/reference_mittag_leffler.py --slopes > tests/fixtures/mittag_leffler_slopes.csv
    python3 scripts/reference_mittag_leffler.py --laws > tests/fixtures/springpot_laws.csv

The last holds G(t), J(t), G' and G'' of the three laws with two spring-pots (docs/laws.md), k_inf = 1, k1 = 2, k2 = 3,
tau1 = 1: G and J from E_{a,b}(-z) by the series, but the Zener form's J, which has no closed form, from its Laplace
transform by mpmath's Talbot contour in 60 digits.

Needs mpmath. Shares no formula with src/tpm/law/relaxation/mittag_leffler.cpp beyond the definition: up to
t = z^(1/alpha) = 95 the power series in enough digits to survive its cancellation (terms reach
exp(t)), above it the asymptotic series, whose smallest term is about exp(-t). Where both reach the
digits (95 <= t <= 130) they are compared, and a disagreement stops the script. alpha = 1 is in
closed form. z and alpha are the binary numbers that the table names, taken exactly.

The derivatives are those of the same series term by term, 1/Gamma being differentiated as -psi/Gamma.
At a = 1 the asymptotic series lacks an exponential, which is below 1e-40 there.
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


SLOPE_DIGITS = 20
SLOPE_ORDERS_A = [0.02, 0.1, 0.3, 0.5, 0.65, 0.8, 0.9, 0.97, 0.999, 1.0]
SLOPE_ORDERS_B = [0.03, 0.2, 0.5, 0.85, 1.0, 1.4, 2.0]
SLOPE_Z = [1e-4, 0.02, 0.2, 0.7, 1.0, 1.3, 3.0, 12.0, 60.0, 1e3, 1e6]


def inverse_gamma_slope(x):
    """The derivative of 1/Gamma at x."""
    if x <= 0 and x == mp.floor(x):
        return (-1) ** int(-x) * mp.factorial(-x)
    return -mp.psi(0, x) * mp.rgamma(x)


def slopes_by_power_series(a, b, z):
    """Value and derivatives by a, b and z from the power series."""
    time = z ** (1 / a)
    with mp.workdps(int(DIGITS + 30 + float(time))):
        sums, power, n = [mp.mpf(0)] * 4, mp.mpf(1), 0
        small = mp.mpf(10) ** (-DIGITS - 25 - int(float(time) / 2.3))
        while True:
            gamma, slope = mp.rgamma(a * n + b), inverse_gamma_slope(a * n + b)
            terms = [power * gamma, power * n * slope, power * slope, power * n / z * gamma]
            sums = [total + term for total, term in zip(sums, terms)]
            if a * n > time and all(abs(term) < small for term in terms):
                return sums
            power *= -z
            n += 1


def slopes_by_asymptotic_series(a, b, z):
    with mp.workdps(DIGITS + 50):
        sums, power, k, quiet = [mp.mpf(0)] * 4, mp.mpf(1), 1, 0
        while quiet < 10:
            power /= -z
            x = b - a * k
            gamma, slope = mp.rgamma(x), inverse_gamma_slope(x)
            terms = [-power * gamma, power * k * slope, -power * slope, power * k / z * gamma]
            counts = any(abs(term) > abs(total) * mp.mpf(10) ** (-DIGITS - 5) for total, term in zip(sums, terms))
            quiet = 0 if counts else quiet + 1
            sums = [total + term for total, term in zip(sums, terms)]
            k += 1
            if a * k > z ** (1 / a):
                sys.exit(f"asymptotic series does not reach the digits: a={a} b={b} z={z}")
        return sums


def print_slopes():
    print("# E_{a,b}(-z) and its derivatives, written by scripts/reference_mittag_leffler.py --slopes")
    print("a,b,z,value,d_a,d_b,d_z")
    for a in SLOPE_ORDERS_A:
        for b in SLOPE_ORDERS_B:
            for z in SLOPE_Z:
                exact = [mp.mpf(number) for number in (a, b, z)]
                time = exact[2] ** (1 / exact[0])
                near = slopes_by_power_series(*exact) if time <= 130 else None
                far = slopes_by_asymptotic_series(*exact) if time >= 95 else None
                for one, other in zip(near or [], far or []):
                    if abs(one - other) > max(abs(one), mp.mpf(10) ** -20) * mp.mpf(10) ** (-SLOPE_DIGITS):
                        sys.exit(f"series disagree: a={a} b={b} z={z}: {one} {other}")
                texts = [mp.nstr(v, SLOPE_DIGITS, min_fixed=1, max_fixed=0) for v in near or far]
                print(f"{a!r},{b!r},{z!r},{','.join(texts)}")


LAW_ORDERS = [(0.5, 0.1), (0.9, 0.3), (0.7, 0.15), (0.3, 0.02), (0.98, 0.5), (0.6, 0.55)]
LAW_TIMES = [1e-4, 1e-3, 0.01, 0.1, 0.4, 1.0, 2.5, 10.0, 100.0, 1e4]
K_INF, K1, K2 = mp.mpf(1), mp.mpf(2), mp.mpf(3)


def free_orders(a, b, z):
    """E_{a,b}(-z): the value of the slopes' series."""
    time = z ** (1 / a)
    return (slopes_by_power_series(a, b, z) if time <= 110 else slopes_by_asymptotic_series(a, b, z))[0]


def law_stiffness(law, alpha, beta, s):
    """s times the Laplace transform of G(t), and with s = i omega storage and loss."""
    if law == "fkelvin_voigt2":
        return K1 * s ** alpha + K2 * s ** beta
    series = K1 * s ** alpha / (1 + s ** (alpha - beta))
    return series + (K_INF if law == "fzener2" else 0)


def law_functions(law, alpha, beta, t):
    d = alpha - beta
    if law == "fkelvin_voigt2":
        g = K1 * t ** -alpha * mp.rgamma(1 - alpha) + K2 * t ** -beta * mp.rgamma(1 - beta)
        return g, t ** alpha / K1 * free_orders(d, 1 + alpha, K2 / K1 * t ** d)
    g = K1 * t ** -beta * free_orders(d, 1 - beta, t ** d)
    if law == "fmaxwell2":
        return g, (t ** alpha * mp.rgamma(1 + alpha) + t ** beta * mp.rgamma(1 + beta)) / K1
    with mp.workdps(60):
        creep = mp.invertlaplace(lambda s: 1 / (s * law_stiffness(law, alpha, beta, s)), t, method="talbot")
    return g + K_INF, creep


def print_laws():
    print("# laws with two spring-pots, written by scripts/reference_mittag_leffler.py --laws")
    print("law,alpha,beta,t,G,J,storage_at_1_over_t,loss_at_1_over_t")
    for law in ("fmaxwell2", "fkelvin_voigt2", "fzener2"):
        for orders in LAW_ORDERS:
            for time in LAW_TIMES:
                alpha, beta, t = mp.mpf(orders[0]), mp.mpf(orders[1]), mp.mpf(time)
                complex_modulus = law_stiffness(law, alpha, beta, mp.mpc(0, 1) / t)
                numbers = (*law_functions(law, alpha, beta, t), complex_modulus.real, complex_modulus.imag)
                texts = [mp.nstr(v, SLOPE_DIGITS, min_fixed=1, max_fixed=0) for v in numbers]
                print(f"{law},{orders[0]!r},{orders[1]!r},{time!r},{','.join(texts)}", flush=True)


def main():
    mp.mp.dps = DIGITS + 20
    if sys.argv[1:] == ["--laws"]:
        print_laws()
        return
    if sys.argv[1:] == ["--slopes"]:
        print_slopes()
        return
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
