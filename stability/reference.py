"""What every model and part is measured against: functions of one flat list of numbers, in 40-digit arithmetic."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from mpmath import mp, mpf
from numpy.typing import NDArray

from .. import models
from ..models import parameters_of
from . import empirical, microfacets, oracle

Reals = NDArray[np.float64]
Function = Callable[..., Any]


def _model(cls: type[models.BRDF]) -> Function:
    """The oracle of a model, of the parameters in the order of the class and the six components of the directions."""
    formula, names = empirical.MODELS[cls.__name__], [p.name for p in parameters_of(cls)]
    return lambda *x: formula(x[-6:-3], x[-3:], **dict(zip(names, x[:-6], strict=True)))


def _scaled_gamma(alpha: Any, p: Any) -> Any:
    """Gamma(1 - p, alpha) / (m^(1-p) e^-m), m = max(alpha, 1 - p), of which 1 - p is a number that stays while p moves."""
    m = max(alpha, mpf(float(1 - p)))
    return oracle.upper_gamma(1 - p, alpha) / (m ** (1 - p) * mp.exp(-m))


DENSITIES: dict[str, Function] = {
    "gtr": oracle.gtr,
    "sgd": oracle.sgd,
    "abc": oracle.abc,
    "ggx": microfacets.ggx,
    "beckmann": microfacets.beckmann,
    "blinn": microfacets.blinn,
    "gaussian": microfacets.gaussian,
    "epd": microfacets.epd,
    "student_t": microfacets.student_t,
    "power_cosine": lambda e, c: (e + 1) / (2 * mp.pi) * c**e,
    "gaussian of slopes": lambda alpha, c: mp.exp(-(1 / c**2 - 1) / alpha**2) / (mp.pi * alpha**2),
}
"""Of the parameters and n.m."""

LAMBDAS: dict[str, Function] = {
    "ggx": microfacets.ggx_lambda,
    "beckmann": microfacets.beckmann_lambda,
    "student_t": microfacets.student_t_lambda,
}
"""Smith's Lambda of the parameters and n.v, where there is a closed form."""


def _of_angle(f: Function) -> Function:
    return lambda *x: f(*x[:-1], mp.cos(x[-1]))


def _area(name: str) -> Function:
    """n.v/G1."""
    if name in LAMBDAS:
        return lambda *x: x[-1] * (1 + LAMBDAS[name](*x))
    return lambda *x: x[-1] / oracle.smith(DENSITIES[name], *x)


def _visible(g: Function) -> Function:
    """V of a G of parameters and directions."""
    return lambda *x: g(*x[:-6], x[-6:-3], x[-3:]) / (4 * x[-4] * x[-1])


def _cosine_d(l: Sequence[Any], v: Sequence[Any]) -> Any:  # noqa: E741
    return mp.cos(oracle._half(l, v)[3])


MASKINGS: dict[str, Function] = {
    "smith, ggx": lambda a, l, v: 1 / (1 + sum(microfacets.ggx_lambda(a, w[2]) for w in (l, v))),  # noqa: E741
    "smith_separable, ggx": lambda a, l, v: mp.fprod(1 / (1 + microfacets.ggx_lambda(a, w[2])) for w in (l, v)),  # noqa: E741
    "vcavity": oracle.vcavity,
    "implicit": lambda l, v: l[2] * v[2],  # noqa: E741
    "kelemen": lambda l, v: l[2] * v[2] / _cosine_d(l, v) ** 2,  # noqa: E741
    "half_vector": lambda l, v: l[2] * v[2] / (_cosine_d(l, v) * max(l[2], v[2])),  # noqa: E741
    "hammon, ggx": microfacets.hammon,
    "schlick_smith, ggx": microfacets.schlick_smith,
    "walter, ggx": lambda a, l, v: 1 / (sum(1 / microfacets.walter_g1(a, w[2]) for w in (l, v)) - 1),  # noqa: E741
    "walter_separable, ggx": lambda a, l, v: mp.fprod(microfacets.walter_g1(a, w[2]) for w in (l, v)),  # noqa: E741
}
"""G."""

FRESNELS: dict[str, Function] = {
    "schlick": oracle.schlick,
    "schlick_scaled": lambda s, f0, c: s * oracle.schlick(f0, c),
    "schlick_ior": lambda s, n, c: s * microfacets.lazanyi(n, mpf(0), c),
    "lazanyi": lambda s, n, k, c: s * microfacets.lazanyi(n, k, c),
    "dielectric": lambda s, n, c: s * oracle.dielectric(n, c),
    "conductor": lambda s, n, k, c: s * microfacets.conductor(n, k, c),
    "none": lambda s, c: s,
    "sgd_fresnel": oracle.sgd_fresnel,
}

REFERENCES: dict[str, dict[str, Function]] = {
    "models": {c.__name__: _model(c) for variants in models.MODELS.values() for c in variants},
    "ndf": {
        **{name: _of_angle(f) for name, f in DENSITIES.items()},
        "power_cosine_anisotropic": lambda ex, ey, *x: oracle.phong_lobe(ex, ey, x[:3], x[3:]),
        "anisotropic_gaussian": lambda ax, ay, *x: oracle.ward_lobe(ax, ay, x[:3], x[3:]),
        "stretched ggx": lambda ax, ay, *x: microfacets.stretched_ggx(ax, ay, x[:3], x[3:]),
    },
    "masking": {
        **{f"Smith, {name}": _area(name) for name in models.blocks.NDFS},
        **{name: _visible(g) for name, g in MASKINGS.items()},
    },
    "fresnel": {name: _of_angle(f) for name, f in FRESNELS.items()},
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


def values(group: str, name: str, points: Reals) -> Reals:
    """Values ``[n]`` at ``points [n, arguments]`` in 40 digits."""
    f = REFERENCES[group][name]
    with mp.workdps(oracle.DIGITS):
        return np.array([float(f(*(mpf(float(x)) for x in p))) for p in points])


def tabulate(group: str, name: str, points: Reals, cosines: Sequence[int]) -> tuple[Reals, Reals]:
    """Values ``[n]`` and slopes ``[n, arguments]`` at ``points [n, arguments]``."""
    found = [value_and_slopes(group, name, p, cosines) for p in points]
    return np.array([v for v, _ in found]), np.array([s for _, s in found])


__all__ = ["REFERENCES", "tabulate", "value_and_slopes", "values"]
