"""What every model and part is measured against: functions of one flat list of numbers, in 40-digit arithmetic."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from mpmath import mp, mpf
from numpy.typing import NDArray

from . import oracle

Reals = NDArray[np.float64]


def _model(name: str) -> Callable[..., Any]:
    return lambda *x: oracle.MODELS[name](x[-6:-3], x[-3:], *x[:-6])


def _scaled_gamma(alpha: Any, p: Any) -> Any:
    """Gamma(1 - p, alpha) / (m^(1-p) e^-m), m = max(alpha, 1 - p), of which 1 - p is a number that stays while p moves."""
    m = max(alpha, mpf(float(1 - p)))
    return oracle.upper_gamma(1 - p, alpha) / (m ** (1 - p) * mp.exp(-m))


REFERENCES: dict[str, dict[str, Callable[..., Any]]] = {
    "models": {name: _model(name) for name in oracle.MODELS},
    "ndf": {
        "GTR": lambda alpha, gamma, theta: oracle.gtr(alpha, gamma, mp.cos(theta)),
        "SGD": lambda alpha, p, theta: oracle.sgd(alpha, p, mp.cos(theta)),
        "ABC": lambda b, c, theta: oracle.abc(b, c, mp.cos(theta)),
        "power_cosine": lambda e, theta: (e + 1) / (2 * mp.pi) * mp.cos(theta) ** e,
        "gaussian": lambda alpha, theta: mp.exp(-(mp.tan(theta) ** 2) / alpha**2) / (mp.pi * alpha**2),
        "power_cosine_anisotropic": lambda ex, ey, *x: oracle.phong_lobe(ex, ey, x[:3], x[3:]),
        "anisotropic_gaussian": lambda ax, ay, *x: oracle.ward_lobe(ax, ay, x[:3], x[3:]),
    },
    "masking": {
        "Smith, GTR": lambda alpha, gamma, cosine: cosine / oracle.gtr_masking(alpha, gamma, cosine),
        "Smith, SGD": lambda alpha, p, cosine: cosine / oracle.sgd_masking(alpha, p, cosine),
        "vcavity": lambda *x: oracle.vcavity(x[:3], x[3:]) / (4 * x[2] * x[5]),
    },
    "fresnel": {
        "dielectric": lambda ior, theta: oracle.dielectric(ior, mp.cos(theta)),
        "schlick": lambda f0, theta: oracle.schlick(f0, mp.cos(theta)),
        "sgd_fresnel": lambda f0, f1, theta: oracle.sgd_fresnel(f0, f1, mp.cos(theta)),
    },
    "special": {
        "expm1_ratio": lambda x: mp.expm1(x) / x if x else mpf(1),
        "log1p_ratio": lambda x: mp.log1p(x) / x if x else mpf(1),
        "upper incomplete gamma": _scaled_gamma,
    },
}
"""By group and name, with the arguments of ``parts.PARTS``."""


def value_and_slopes(group: str, name: str, point: Sequence[float], cosines: Sequence[int]) -> tuple[float, list[float]]:
    """The value at a point taken as exact, and its derivative by every argument as a difference quotient.

    ``cosines`` are the positions of cosines and components of directions, whose steps are relative to 1. A derivative in a
    cosine of 1 is taken next to it, where the sine of masking is real.
    """
    f = REFERENCES[group][name]
    with mp.workdps(oracle.DIFFERENCE_DIGITS):
        exact = [mpf(float(x)) for x in point]
        value = f(*exact)
        slopes = []
        for k, x in enumerate(exact):
            start = min(x, oracle.NEXT_TO_NORMAL) if k in cosines else x
            step = oracle.STEP * (1 if k in cosines else abs(x) or 1)
            before, after = (f(*exact[:k], y, *exact[k + 1 :]) if y != x else value for y in (start, start + step))
            slopes.append(float((after - before) / step))
        return float(value), slopes


def tabulate(group: str, name: str, points: Reals, cosines: Sequence[int]) -> tuple[Reals, Reals]:
    """Values ``[n]`` and slopes ``[n, arguments]`` at ``points [n, arguments]``."""
    found = [value_and_slopes(group, name, p, cosines) for p in points]
    return np.array([v for v, _ in found]), np.array([s for _, s in found])


__all__ = ["REFERENCES", "tabulate", "value_and_slopes"]
