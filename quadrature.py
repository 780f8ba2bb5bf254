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
def smith_kernel(n: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """cos^2 t and the weights (sin t - t cos t) sin t dt of Smith's integral over t in [0, pi/2].

    sin t - t cos t is t^3/3 for small t: it is summed as sum_k (-1)^(k+1) 2k/(2k+1)! t^(2k+1), which does not cancel.
    """
    x, w = gauss_legendre(n)
    t, w = x * np.pi / 2, w * np.pi / 2
    term = t.copy()
    series = np.zeros_like(t)
    for k in range(1, 16):
        term = -term * t * t / ((2 * k) * (2 * k + 1))
        series -= 2 * k * term
    return np.cos(t) ** 2, w * series * np.sin(t)
