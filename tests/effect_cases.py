"""Effects as their papers have them, in 30 digits, and random parameters to ask them for."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import mpmath
import numpy as np
from brdfit.models import parameters_of, variants
from mpmath import mpf

from .cases import WI, WO

Reals = np.ndarray
mp = mpmath.mp


class View:
    """Angles of a pair of directions in 30 digits, from their definitions."""

    def __init__(self, wi: Reals, wo: Reals) -> None:
        self.l, self.v = ([mpf(float(x)) for x in w] for w in (wi, wo))
        self.l, self.v = ([x / mp.sqrt(dot(w, w)) for x in w] for w in (self.l, self.v))
        self.h = unit([a + b for a, b in zip(self.l, self.v, strict=True)])
        self.cos_d = dot(self.l, self.h)


def dot(a: Any, b: Any) -> Any:
    return sum((x * y for x, y in zip(a, b, strict=True)), mpf(0))


def unit(a: Any) -> Any:
    size = mp.sqrt(dot(a, a))
    return [x / size for x in a]


def ggx(m: Any, ax: Any, ay: Any) -> Any:
    """Burley 2012, eq. 13."""
    return 1 / (mp.pi * ax * ay * ((m[0] / ax) ** 2 + (m[1] / ay) ** 2 + m[2] ** 2) ** 2)


def ggx_lambda(w: Any, ax: Any, ay: Any) -> Any:
    """Heitz 2014, eq. 72 and 80."""
    return (mp.sqrt(1 + ((ax * w[0]) ** 2 + (ay * w[1]) ** 2) / w[2] ** 2) - 1) / 2


def gtr(m: Any, alpha: Any, gamma: Any) -> Any:
    """Burley 2012, appendix B.2, with the normalisation of its eq. 8 integrated."""
    k = (gamma - 1) * (alpha**2 - 1) / (mp.pi * (1 - alpha ** (2 - 2 * gamma)))
    return k / (1 + (alpha**2 - 1) * m[2] ** 2) ** gamma


def schlick(f0: Any, cosine: Any) -> Any:
    return f0 + (1 - f0) * (1 - cosine) ** 5


def rough(q: View, p: dict[str, Any]) -> Any:
    """Oren & Nayar 1994, eq. 30, from angles."""
    angles = [mp.acos(w[2]) for w in (q.l, q.v)]
    azimuth = mp.atan2(q.l[1], q.l[0]) - mp.atan2(q.v[1], q.v[0])
    s = p["sigma"] ** 2
    a, b = 1 - s / (2 * (s + mpf("0.33"))), mpf("0.45") * s / (s + mpf("0.09"))
    return p["diffuse"] / mp.pi * (a + b * max(0, mp.cos(azimuth)) * mp.sin(max(angles)) * mp.tan(min(angles)))


def masked(q: View, p: dict[str, Any], ax: Any, ay: Any) -> Any:
    g2 = 1 / (1 + ggx_lambda(q.l, ax, ay) + ggx_lambda(q.v, ax, ay))
    return ggx(q.h, ax, ay) * g2 / (4 * q.l[2] * q.v[2])


def traded(q: View, p: dict[str, Any]) -> Any:
    """Ashikhmin & Shirley 2000, eq. 5."""
    rise = [1 - (1 - w[2] / 2) ** 5 for w in (q.l, q.v)]
    return 28 * p["diffuse"] / (23 * mp.pi) * (1 - p["specular"]) * rise[0] * rise[1]


def back(q: View, p: dict[str, Any]) -> Any:
    mirrored = [-q.l[0], -q.l[1], q.l[2]]
    b = unit([x + y for x, y in zip(mirrored, q.v, strict=True)])
    return p["retro"] * ggx(b, p["alpha_retro"], p["alpha_retro"]) / 4


def smooth(q: View, p: dict[str, Any], f: Callable[[Any], Any]) -> Any:
    """Low et al. 2012, eq. 16, as the published fits have it."""
    d2 = (q.l[0] + q.v[0]) ** 2 + (q.l[1] + q.v[1]) ** 2
    across2 = (q.l[0] - q.v[0]) ** 2 + (q.l[1] - q.v[1]) ** 2
    return p["scatter"] * f(mp.sqrt(1 - across2 / 4)) / (1 + p["b"] * d2) ** p["c"]


TERMS: dict[str, Callable[[View, dict[str, Any]], Any]] = {
    "body": lambda q, p: p["diffuse"] / mp.pi,
    "body+rough_body": rough,
    "lobe": lambda q, p: p["specular"] * ggx(q.h, p["alpha"], p["alpha"]) / 4,
    "lobe+tail": lambda q, p: p["specular"] * gtr(q.h, p["alpha"], p["gamma"]) / 4,
    "lobe+fresnel": lambda q, p: schlick(p["specular"], q.cos_d) * ggx(q.h, p["alpha"], p["alpha"]) / 4,
    "lobe+masking": lambda q, p: p["specular"] * masked(q, p, p["alpha"], p["alpha"]),
    "lobe+second_lobe+fresnel": lambda q, p: (
        ((1 - p["share"]) * ggx(q.h, p["alpha"], p["alpha"]) + p["share"] * ggx(q.h, p["alpha_2"], p["alpha_2"]))
        * schlick(p["specular"], q.cos_d)
        / 4
    ),
    "lobe+anisotropy": lambda q, p: p["specular"] * ggx(q.h, p["alpha_x"], p["alpha_y"]) / 4,
    "lobe+anisotropy+masking": lambda q, p: p["specular"] * masked(q, p, p["alpha_x"], p["alpha_y"]),
    "body+lobe+fresnel+trade_off": lambda q, p: (
        traded(q, p) + schlick(p["specular"], q.cos_d) * ggx(q.h, p["alpha"], p["alpha"]) / 4
    ),
    "body+lobe+trade_off": lambda q, p: (
        p["diffuse"] * (1 - p["specular"]) / mp.pi + p["specular"] * ggx(q.h, p["alpha"], p["alpha"]) / 4
    ),
    "retro": back,
    "diffraction": lambda q, p: smooth(q, p, lambda c: 1),
    "diffraction+fresnel": lambda q, p: smooth(q, p, lambda c: schlick(p["specular"], c)),
}
"""Values by the papers, for one channel."""

RANGES = {
    "diffuse": (0, 1),
    "sigma": (0, 1.5),
    "specular": (0, 1),
    "share": (0, 1),
    "retro": (0, 1),
    "scatter": (0, 5),
    "gamma": (0.5, 6),
    "c": (0.1, 4),
    "b": (0.1, 1e6),
}
"""Of random parameters; widths lie in [1e-3, 2], in the logarithm."""

DRAWS = 12


@cache
def drawn(name: str) -> tuple[dict[str, float], ...]:
    """Parameters of one channel, rounded so that float32 holds them."""
    rng = np.random.default_rng(len(name))
    sets = []
    for _ in range(DRAWS):
        case = {}
        for p in parameters_of(variants(name)[0]):
            low, high = RANGES.get(p.name, (1e-3, 2.0))
            logarithmic = p.name not in RANGES or p.name == "b"
            value = np.exp(rng.uniform(np.log(low), np.log(high))) if logarithmic else rng.uniform(low, high)
            case[p.name] = float(np.float32(value))
        sets.append(case)
    return tuple(sets)


@cache
def wanted(name: str) -> Reals:
    with mp.workdps(30):
        views = [View(a, b) for a, b in zip(WI, WO, strict=True)]
        cases = [{k: mpf(v) for k, v in case.items()} for case in drawn(name)]
        return np.array([[float(TERMS[name](q, p)) for q in views] for p in cases])
