"""Gauss-Legendre nodes as constants of a program."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray


@lru_cache(maxsize=32)
def gauss_legendre(n: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Nodes and weights of the n-point Gauss-Legendre rule on [0, 1]."""
    x, w = np.polynomial.legendre.leggauss(n)
    return (x + 1) / 2, w / 2


@lru_cache(maxsize=32)
def smith_kernel(n: int, reach: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """cos^2 t and the weights (sin t - t cos t) sin t dt of Smith's integral over t in [0, pi/2].

    By the trapezoidal rule in u, cos t = 1/cosh u, with ``n`` nodes up to u = ``reach``. The integrand is even and analytic
    in u within pi/2 of the real axis (pi/4 for Gaussian densities), so that the error is exp(-2 pi (pi/2)/step); and u is
    ln tan(theta_m) but for a constant, so that densities of any width are resolved. Where the rule ends the density is a
    constant: the last weight is that of all nodes beyond.

    sin t - t cos t is t^3/3 for small t: it is summed as sum_k (-1)^(k+1) 2k/(2k+1)! t^(2k+1), which does not cancel.
    """
    step = reach / n
    u = step * np.arange(1, n + int(50 / step))  # the weights fall as e^-u
    t = 2 * np.arctan(np.tanh(u / 2))
    term = t.copy()
    series = np.zeros_like(t)
    for k in range(1, 16):
        term = -term * t * t / ((2 * k) * (2 * k + 1))
        series -= 2 * k * term
    weight = step * series * np.tanh(u) / np.cosh(u)
    weight[n - 1] = weight[n - 1 :].sum()
    return 1 / np.cosh(u[:n]) ** 2, weight[:n]
