"""What one would write without this package: Low's ABC model fitted to a whole MERL table by NumPy and SciPy.

    python benchmarks/plain_scipy.py FILE

Loss ``log``, solid-angle measure, 80 degrees, one start, derivatives by differences. Prints the error, which is the one of
``brdfit fit --model abc`` where both find the same optimum, and the seconds from the first line to the last.
"""

import sys
import time

begin = time.perf_counter()

import numpy as np  # noqa: E402
from scipy.optimize import least_squares  # noqa: E402

H, D, P = 90, 90, 180
units = np.array([1.0, 1.15, 1.66])[:, None, None, None] / 1500
planes = np.fromfile(sys.argv[1], "<f8", offset=12).reshape(3, H, D, P) * units
edges_h, edges_d = (np.arange(H + 1) / H) ** 2 * np.pi / 2, np.arange(D + 1) / D * np.pi / 2
theta_h, theta_d, phi_d = np.meshgrid(edges_h[:-1], edges_d[:-1], np.arange(P) / P * np.pi, indexing="ij")
along, across = np.cos(theta_h) * np.cos(theta_d), np.sin(theta_h) * np.sin(theta_d) * np.cos(phi_d)
cos_i, cos_o = along - across, along + across
used = (planes >= 0).all(0) & (cos_i > np.cos(np.radians(80))) & (cos_o > np.cos(np.radians(80)))
measure = -np.diff(np.cos(edges_h))[:, None, None] * np.diff(np.sin(edges_d) ** 2)[:, None] * np.ones(P)
root = np.sqrt(measure[used] / measure[used].sum() / 3)
m, l_n, v_n, h_n, c_d = planes[:, used], cos_i[used], cos_o[used], np.cos(theta_h[used]), np.cos(theta_d[used])
masking = np.minimum(1, np.minimum(2 * h_n * l_n / c_d, 2 * h_n * v_n / c_d)) / (np.pi * l_n * v_n)
seen = np.log(1 + m * l_n)


def residual(x):
    """Of the colours of body and lobe, ln B, ln C and ln(ior - 1)."""
    b, c, ior = np.exp(x[6]), np.exp(x[7]), 1 + np.exp(x[8])
    g = np.sqrt(ior**2 - 1 + c_d**2)
    fresnel = 0.5 * ((g - c_d) / (g + c_d)) ** 2 * (1 + ((c_d * (g + c_d) - 1) / (c_d * (g - c_d) + 1)) ** 2)
    lobe = fresnel * masking / (1 + b * (1 - h_n)) ** c
    f = x[:3, None] / np.pi + x[3:6, None] * lobe
    return (root * (np.log(np.maximum(1 + f * l_n, 1e-300)) - seen)).ravel()


near = used[:, 1:30]
profile = (planes.mean(0)[:, 1:30] * near).sum((1, 2)) / np.maximum(near.sum((1, 2)), 1)
profile = profile[near.any((1, 2))]
half = theta_h[np.argmax(profile < (profile[0] + profile.min()) / 2), 0, 0]
start = [*np.quantile(m, 0.25, 1) * np.pi, *(10 * m.max(1)), np.log(1 / (1 - np.cos(half))), 0.0, np.log(0.5)]
fit = least_squares(residual, start, x_scale="jac", ftol=1e-9, xtol=1e-12, gtol=1e-12)
print(f"error {np.sqrt(2 * fit.cost):.6f}, {fit.nfev} steps, {time.perf_counter() - begin:.1f} s: {fit.message}")
