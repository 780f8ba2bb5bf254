"""What a fitted model says as physics: how much light it returns, its F0, its width in terms that people know."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .angles import directions
from .quadrature import gauss_legendre
from .values import values_of

if TYPE_CHECKING:
    from .models import BRDF

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
    from .models import BRDF, channels

    wi, wo, weights = albedo_directions(angles)
    values = values_of(brdf, wi, wo, channels(brdf)) if isinstance(brdf, BRDF) else np.asarray(brdf(wi, wo), float)
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


def normal_reflectance(model: BRDF | None) -> Reals | None:
    """F0 of a fitted model, ``[C]``; None where the model has nothing that corresponds to it."""
    if model is None:
        return None
    import jax

    from .models import channels

    with jax.enable_x64(True):
        values = [channel(model, c).normal_reflectance() for c in range(channels(model))]
    return None if values[0] is None else np.array(values, float)


def channel(model: BRDF, c: int) -> BRDF:
    """The model of one channel: every parameter a scalar."""
    import jax

    found: BRDF = jax.tree.map(lambda x: np.atleast_1d(x)[min(c, np.size(x) - 1)], model)
    return found


@dataclass(frozen=True)
class Width:
    """Width of a lobe by several names. Where channels differ, the first channel's."""

    half_width: float
    """Angle of the half vector at which the lobe has fallen to half its peak, radians."""

    @property
    def alpha(self) -> float:
        """alpha of the GGX lobe of the same half-width."""
        # GGX: (s^2 + a^2 (1 - s^2))^2 = 2 a^4 at half the peak
        sin2 = np.sin(self.half_width) ** 2
        return float(np.sqrt(sin2 / (np.sqrt(2) - 1 + sin2)))

    @property
    def roughness(self) -> float:
        """Perceptual roughness, sqrt(alpha) (Burley 2012)."""
        return float(np.sqrt(self.alpha))

    @property
    def exponent(self) -> float:
        """Blinn-Phong exponent, 2/alpha^2 - 2."""
        return 2 / self.alpha**2 - 2


THETA_H = np.concatenate([[0.0], np.geomspace(1e-9, np.radians(60), 1600)])
"""Where a lobe is asked for its width, radians."""
THETA_D = np.radians(20)
"""At what theta_d it is asked for, and phi_d = 90 degrees, where it is not known apart from the body."""
PROMINENT = 2.0
"""What such a lobe is at least, as a multiple of the value at 60 degrees: bodies are up to 1.7 of it
(tests/test_report_physics.py::test_no_half_width_no_number)."""


def lobe_width(model: BRDF | None) -> Width | None:
    """Width of the lobe of a fitted model; None without one, on anisotropic models, and where it is wider than 60 degrees.

    A model of microfacets is asked for its distribution D; any other for its values, of which that at theta_h = 60 degrees
    is taken for the body's, if the lobe stands out from it.
    """
    if model is None or model.anisotropic:
        return None
    from .models import channels
    from .models.parts import Composition

    base = 0.0
    if isinstance(model, Composition) and model.parts.lobes:
        import jax

        with jax.enable_x64(True):
            facets = model.parts.lobes[0].facets(channel(model, 0))
            values = np.asarray(_program()(facets, np.sin(THETA_H) ** 2, np.cos(THETA_H) ** 2))
    else:
        values = values_of(model, *directions(THETA_H, THETA_D, np.pi / 2), channels(model))[:, 0]
        base = values[-1]
        if values[0] < PROMINENT * base:
            return None
    half = half_way(values, base)
    return None if half is None else Width(half)


@cache
def _program() -> Any:
    """The distribution D of facets, compiled; made on first use so that a module that needs no JAX does not import it."""
    from .programs import program

    return program(lambda facets, sin2, cos2: facets(sin2, cos2))


def half_way(values: Reals, base: float) -> float | None:
    """The first theta_h at which ``values`` at :data:`THETA_H` have fallen half way from their first one to ``base``."""
    below = np.flatnonzero(values <= (values[0] + base) / 2)
    if len(below) == 0 or below[0] == 0:
        return None
    k = below[0]
    ends = slice(k - 1, k + 1)
    return float(np.interp((values[0] + base) / 2, values[ends][::-1], THETA_H[ends][::-1]))
