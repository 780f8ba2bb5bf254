"""Kirchhoff scattering by a Gaussian random surface: the diffuse part of the light that a rough mirror diffracts.

Heights have standard deviation sigma and the correlation exp(-r^2/tau^2); both are in wavelengths.
"""

from __future__ import annotations

import math

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..geometry import Geometry

TERMS = 128
FEW = 56
"""Up to this index of the largest term the first ``TERMS`` terms are summed: what is left out is below 1e-15 of the sum."""
_ORDER = np.arange(1.0, TERMS + 1)
_STIRLING = np.array([math.lgamma(m + 1) - (m * math.log(m) - m + math.log(2 * math.pi * m) / 2) for m in _ORDER])


def scattering_series(g: Float[Array, "..."], t: Float[Array, "..."]) -> Float[Array, "..."]:
    """The sum over m >= 1 of g^m e^(-g)/(m! m) exp(-t/m), for g > 0 and t >= 0.

    Its terms have one peak, near g, or further out for t >> g. Where the peak is below ``FEW`` the terms are summed from the
    first. Beyond, its width is sqrt(m) or less: every h-th term is taken to either side of it, h a sixth of the width or 1,
    because the sum over a smooth peak of h times every h-th term is that over all to exp(-2 pi^2 width^2/h^2) < 1e-300.
    Which terms are taken does not depend on g and t as far as derivatives go.
    """
    peak, width = (jax.lax.stop_gradient(x) for x in _peak(g, t))
    direct = peak <= FEW
    step = jnp.where(direct, 1, jnp.ceil(width * (20 / TERMS)))
    first = jnp.where(direct, 1, jnp.maximum(jnp.round(peak) - TERMS // 2 * step, 9))
    m = first[..., None] + step[..., None] * (_ORDER - 1).astype(g.dtype)
    ratio = g[..., None] / m
    # m! by Stirling: m ln g - g - ln m! = -m (y - ln(1 + y)) - ln(2 pi m)/2 - rest, y = g/m - 1, small around the peak
    y = (g[..., None] - m) / m
    near = jnp.abs(y) < 0.5
    # Guard: the logarithm of 0, which the branch not taken would see (tests/test_empirical.py::test_finite).
    fall = jnp.where(near, y - jnp.log1p(jnp.where(near, y, 0)), y - jnp.log(jnp.where(near, 1, ratio)))
    i2 = 1 / m**2
    rest = (1 / 12 - i2 * (1 / 360 - i2 * (1 / 1260 - i2 * (1 / 1680 - i2 / 1188)))) / m
    rest = jnp.where(direct[..., None], jnp.asarray(_STIRLING, g.dtype), rest)
    terms = jnp.exp(-m * fall - rest - t[..., None] / m) / (m * jnp.sqrt(2 * jnp.pi * m))
    return step * terms.sum(-1)


def _peak(g: Float[Array, "..."], t: Float[Array, "..."]) -> tuple[Float[Array, "..."], Float[Array, "..."]]:
    """Index and width of the largest term: m = g e^(y/2), y + ln y = ln(2 t/g^2); three digits are enough."""
    tiny = float(np.finfo(g.dtype).tiny)
    right = jnp.log(2 * t + tiny) - 2 * jnp.log(g)
    y = jnp.where(right > 1, right, jnp.exp(jnp.minimum(right, 1)))
    for _ in range(4):
        y = jnp.maximum(y * (1 + right - jnp.log(y + tiny)) / (1 + y), 0)
    m = g * jnp.exp(y / 2)
    return m, jnp.sqrt(m / (1 + y))


def kirchhoff(sigma2: Float[Array, "..."], tau: Float[Array, ""], g: Geometry) -> Float[Array, "..."]:
    """pi tau^2 (c_d/(n.h))^2 times the series of He et al. (1991, eq. 76 to 78), in 1/sr: BRDF times (n.l)(n.v)/(F S).

    Their G D/pi with the geometrical factor G = (v.v/v_z)^2 = 4 c_d^2/(n.h)^2 of unpolarised light, g = (2 pi sigma
    (n.l + n.v))^2 and t = (v_xy tau)^2/4 = (2 pi c_d tau)^2 sin^2(theta_h), for a variance ``sigma2`` of the heights.
    """
    phase = 4 * jnp.pi**2 * sigma2 * (g.cos_i + g.cos_o) ** 2
    across = (2 * jnp.pi * g.cos_d * tau) ** 2 * g.sin2_h
    phase, across = jnp.broadcast_arrays(phase, across)
    return jnp.pi * (tau * g.cos_d / g.cos_h) ** 2 * scattering_series(phase, across)
