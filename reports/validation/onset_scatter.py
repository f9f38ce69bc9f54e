#!/usr/bin/env python3
"""How an onset of contact scatters that lies at the depth of the rest, beside its first-order u (needs numpy).

The calibration of the page: 60 + 45 exp(-t / 2 s) N/m, a ramp of 1 mm/s from depth 0, a reading every 0.1 s with 2 mN of
white noise, 40 readings of rest at depth 0, where contact begins. The onset is that of least squares of A x + B x^2,
x = depth - contact >= 0, over the first 2 mm and 20 readings of the rest, the zero being the mean of the rest.
"""
import numpy as np

SIGMA, REST, NEAR, DRAWS = 2e-3, 40, 20, 200
depth = np.arange(0.0, 2.001e-3, 1e-4)
t = depth / 1e-3
force = 60.0 * depth + 45.0 * 1e-3 * 2.0 * (1.0 - np.exp(-t / 2.0))
LENGTH = depth[-1]


def loading(contact):
    x = np.clip((np.concatenate([np.zeros(NEAR), depth]) - contact) / LENGTH, 0.0, None)
    return np.column_stack([x, x * x])


contacts = np.linspace(-0.06e-3, 0.06e-3, 241)
bases = [np.linalg.qr(loading(c))[0] for c in contacts]
draw = np.random.default_rng(1)
found = []
for _ in range(DRAWS):
    rest = draw.normal(0.0, SIGMA, REST)
    y = np.concatenate([rest[-NEAR:], force + draw.normal(0.0, SIGMA, len(depth))]) - rest.mean()
    found.append(contacts[np.argmax([np.sum((q.T @ y) ** 2) for q in bases])])

inside = depth > 0.0
x = depth[inside] / LENGTH
a, b = np.linalg.lstsq(np.column_stack([x, x * x]), force[inside], rcond=None)[0]
slopes = np.column_stack([-(a + 2.0 * b * x) / LENGTH, x, x * x])
scale = 1.0 / np.linalg.norm(slopes, axis=0)
weights = scale[0] * np.linalg.pinv(slopes * scale)[0]
first_order = SIGMA * np.sqrt(weights @ weights + weights.sum() ** 2 / REST)
print(f"standard deviation of {DRAWS} onsets: {1e3 * np.std(found):.4f} mm; to first order {1e3 * first_order:.4f} mm")
