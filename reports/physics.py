"""What a fitted model says as physics: how much light it returns, its F0, its width in terms that people know."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..quadrature import gauss_legendre
from .evaluate import evaluate

Reals = NDArray[np.float64]

ANGLES = (0.0, 15.0, 30.0, 45.0, 60.0, 70.0, 75.0, 80.0, 85.0, 88.0)
"""Angles of incidence, degrees, at which the directional albedo is given."""

FINE = (64, 20)
COARSE = (40, 12)
"""Nodes in theta_h and phi_h of the quadrature, and of the one that states its error."""

STRETCH = 12.0
"""Half of the theta_h nodes lie below exp(-STRETCH/2) of the range, 0.2 degrees: where narrow lobes are."""


def hemisphere(theta_i: float, nodes: tuple[int, int] = FINE) -> tuple[Reals, Reals, Reals]:
    """Light ``[3]``, viewers ``[n, 3]`` and weights ``[n]`` such that the albedo at ``theta_i`` radians is sum(weight f).

    rho = int f cos_o do, taken over half vectors h with do = 4 (v.h) dh, because lobes are narrow in h. For each
    azimuth of h the viewer is above the horizon up to theta_h = (pi/2 + delta)/2, tan(delta) = tan(theta_i) cos(phi_h):
    the range is known, and nodes crowd at its start. phi_h takes half a turn (mirror symmetry), by midpoints.
    """
    s, c = np.sin(theta_i), np.cos(theta_i)
    u, w = gauss_legendre(nodes[0])
    phi = (np.arange(nodes[1]) + 0.5) * np.pi / nodes[1]
    end = (np.pi / 2 + np.arctan2(s * np.cos(phi), c)) / 2
    theta = end[:, None] * np.sinh(STRETCH * u) / np.sinh(STRETCH)
    dtheta = end[:, None] * STRETCH * np.cosh(STRETCH * u) / np.sinh(STRETCH) * w
    sin_h, cos_h = np.sin(theta), np.cos(theta)
    h = np.stack([sin_h * np.cos(phi)[:, None], sin_h * np.sin(phi)[:, None], cos_h], -1)
    light = np.array([s, 0.0, c])
    cos_d = np.maximum(h @ light, 0.0)
    viewer = 2 * cos_d[..., None] * h - light
    cos_o = np.maximum(viewer[..., 2], 0.0)
    weight = cos_o * 4 * cos_d * sin_h * dtheta * (2 * np.pi / nodes[1])
    return light, viewer.reshape(-1, 3), weight.ravel()


def albedo_directions(angles: tuple[float, ...] = ANGLES) -> tuple[Reals, Reals, list[list[Reals]]]:
    """Pairs of directions for the directional albedo at all ``angles`` (degrees), and the weights that turn values into it.

    Returns light and viewer ``[n, 3]`` and for each angle the weights of the fine and of the coarse rule, in order.
    """
    lights, viewers, weights = [], [], []
    for angle in angles:
        pair = []
        for nodes in (FINE, COARSE):
            light, viewer, weight = hemisphere(np.radians(angle), nodes)
            lights.append(np.broadcast_to(light, viewer.shape))
            viewers.append(viewer)
            pair.append(weight)
        weights.append(pair)
    return np.concatenate(lights), np.concatenate(viewers), weights


def albedo_of_values(values: Reals, weights: list[list[Reals]]) -> tuple[Reals, Reals]:
    """Directional albedo and its error, each ``[A, C]``, of BRDF values ``[n, C]`` at :func:`albedo_directions`.

    The error is the difference between the two rules, which overstates that of the finer one. Directions without a value
    (NaN) are left out of the integral.
    """
    rho, error, start = [], [], 0
    for pair in weights:
        result = []
        for weight in pair:
            part = values[start : start + len(weight)]
            result.append(np.nansum(weight[:, None] * part, 0))
            start += len(weight)
        rho.append(result[0])
        error.append(np.abs(result[0] - result[1]))
    return np.array(rho), np.array(error)


def directional_albedo(brdf: Callable[[Reals, Reals], ArrayLike], angles: tuple[float, ...] = ANGLES) -> tuple[Reals, Reals]:
    """Fraction of light from each of ``angles`` (degrees) that ``brdf`` returns, and its error, each ``[A, C]``.

    ``brdf`` is a model, which is evaluated in float64, or any function of unit vectors ``[n, 3]``.
    """
    from ..models import BRDF, channels

    wi, wo, weights = albedo_directions(angles)
    values = evaluate(brdf, wi, wo, channels(brdf)) if isinstance(brdf, BRDF) else np.asarray(brdf(wi, wo), float)
    return albedo_of_values(values, weights)


def energy_verdict(rho: Reals, error: Reals, angles: tuple[float, ...] = ANGLES) -> str:
    """Whether a directional albedo ``[A, C]`` conserves energy, and up to which angle, in words."""
    top = rho.max(1)
    over = np.flatnonzero(~(top <= 1 + np.maximum(error.max(1), 1e-6)))
    if len(over) == 0:
        k = int(np.argmax(top))
        return f"conserves energy at every angle computed: at most {top[k]:.2f}, at {angles[k]:g}°"
    if not np.isfinite(top[over[0]]):
        return "albedo is not a number"
    worst = int(np.nanargmax(top))
    until = f"only up to {angles[over[0] - 1]:g}°" if over[0] else "nowhere"
    return f"returns more light than falls on it: albedo ≤ 1 {until}, {top[worst]:.2f} at {angles[worst]:g}°"


@dataclass(frozen=True)
class NormalReflectance:
    """What corresponds to F0 in a model: ``value`` ``[C]``, the expression it came from, and how far to trust it."""

    value: Reals
    expression: str
    remark: str


def normal_reflectance(model: str, parameters: Mapping[str, Reals]) -> NormalReflectance | None:
    """F0 of a fitted model by its name and parameters; None where the model has nothing that corresponds to it."""
    p = parameters
    composed = "lobe" in model.split("+")
    if (composed or model in ("gtr", "ggx", "pbr", "cook_torrance", "ashikhmin_shirley")) and "specular" in p:
        return NormalReflectance(np.atleast_1d(p["specular"]), "specular", "a parameter of the model")
    if model == "abc" and {"specular", "ior"} <= set(p):
        n = p["ior"]
        value = np.atleast_1d(p["specular"] * ((n - 1) / (n + 1)) ** 2)
        return NormalReflectance(value, "specular · F(ior, 0°)", "scale of the lobe: F0 so far as its normalised D is right")
    if model == "sgd" and {"specular", "f0", "f1"} <= set(p):
        value = np.atleast_1d(p["specular"] * (p["f0"] - p["f1"]))
        return NormalReflectance(
            value, "specular · (f0 \u2212 f1)", "scale of the lobe: F0 so far as its normalised D is right"
        )
    return None


@dataclass(frozen=True)
class Width:
    """Width of a lobe by several names. Where channels differ, the first channel's."""

    half_width: float
    """Angle of the half vector at which D has fallen to half its peak, radians."""
    alpha: float
    """alpha of the GGX lobe of the same half-width (its own alpha for gtr with gamma = 2)."""

    @property
    def roughness(self) -> float:
        """Perceptual roughness, sqrt(alpha) (Burley 2012)."""
        return float(np.sqrt(self.alpha))

    @property
    def exponent(self) -> float:
        """Blinn-Phong exponent, 2/alpha^2 - 2."""
        return 2 / self.alpha**2 - 2


def lobe_width(model: str, parameters: Mapping[str, Reals]) -> Width | None:
    """Width of the lobe of a fitted model; None for models without one, or where D never falls to half its peak."""
    sin2 = _half_sin2(model, {k: np.atleast_1d(v)[0] for k, v in parameters.items()})
    if sin2 is None or not 0 < sin2 < 1:
        return None
    # GGX: (s^2 + a^2 (1 - s^2))^2 = 2 a^4 at half the peak
    alpha = np.sqrt(sin2 / (np.sqrt(2) - 1 + sin2))
    return Width(float(np.arcsin(np.sqrt(sin2))), float(alpha))


def _half_sin2(model: str, p: Mapping[str, float]) -> float | None:
    """sin^2 of the angle at which D is half its peak."""
    if (model in ("gtr", "ggx", "pbr") or "lobe" in model.split("+")) and "alpha" in p:
        a2 = p["alpha"] ** 2
        grow = np.expm1(np.log(2) / p.get("gamma", 2.0))
        return float(a2 * grow / (1 - a2)) if a2 < 1 else None
    if model == "abc" and {"b", "c"} <= set(p):
        v = np.expm1(np.log(2) / p["c"]) / p["b"] if p["c"] > 1e-2 else np.inf
        return float(v * (2 - v)) if v < 1 else None
    if model == "sgd" and {"alpha", "p"} <= set(p):
        t = _sgd_half_tan2(p["alpha"], p["p"])
        return None if t is None else t / (1 + t)
    if model.startswith("ward") and "alpha" in p:
        t = p["alpha"] ** 2 * np.log(2)
        return float(t / (1 + t))
    if model in ("ashikhmin_shirley", "blinn_phong") and "exponent" in p:
        return float(-np.expm1(-2 * np.log(2) / p["exponent"])) if p["exponent"] > 0 else None
    return None


def _sgd_half_tan2(alpha: float, p: float) -> float | None:
    """tan^2 at half the peak of D_sgd, first crossing on a logarithmic scan, then bisected."""

    def log_ratio(t: NDArray[np.float64] | float) -> NDArray[np.float64]:
        r: NDArray[np.float64] = -t / alpha - p * np.log1p(t / alpha**2) + 2 * np.log1p(t) + np.log(2)
        return r

    grid = np.logspace(-16, 4, 2001)
    below = np.flatnonzero(log_ratio(grid) < 0)
    if len(below) == 0 or below[0] == 0:
        return None
    lo, hi = grid[below[0] - 1], grid[below[0]]
    for _ in range(60):
        middle = (lo + hi) / 2
        lo, hi = (middle, hi) if log_ratio(middle) > 0 else (lo, middle)
    return float((lo + hi) / 2)
