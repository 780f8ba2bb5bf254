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
def smith_kernel(n: int, reach: float) -> tuple[NDArray[np.float64], ...]:
    """cos^2 t over t in [0, pi/2], and the weights sin t dt of Smith's integral for a function of t times each of

        sin t - t cos t,   t cos t,   cos^2 t / (2 sin t).

    By the trapezoidal rule in u, cos t = 1/cosh u, with ``n`` intervals up to u = ``reach``. The integrand is even and
    analytic in u within pi/2 of the real axis (pi/4 for Gaussian densities), so that the error is exp(-2 pi (pi/2)/step);
    and u is ln tan(theta_m) but for a constant, so that densities of any width are resolved. Where the rule ends the density
    is a constant: the last weight is that of all nodes beyond.

    sin t - t cos t is t^3/3 for small t: it is summed as sum_k (-1)^(k+1) 2k/(2k+1)! t^(2k+1), which does not cancel.
    """
    step = reach / n
    u = step * np.arange(n + int(50 / step))  # the weights fall as e^-u
    t, cosine, sine = 2 * np.arctan(np.tanh(u / 2)), 1 / np.cosh(u), np.tanh(u)
    term = t.copy()
    series = np.zeros_like(t)
    for k in range(1, 16):
        term = -term * t * t / ((2 * k) * (2 * k + 1))
        series -= 2 * k * term
    width = step * cosine  # dt
    width[0] /= 2
    weights = [width * series * sine, width * t * cosine * sine, width * cosine**2 / 2]
    for weight in weights:
        weight[n] = weight[n:].sum()
    return cosine[: n + 1] ** 2, *(weight[: n + 1] for weight in weights)
