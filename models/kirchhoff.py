"""Kirchhoff scattering by a Gaussian random surface: the diffuse part of the light that a rough mirror diffracts.

Heights have standard deviation sigma and the correlation exp(-r^2/tau^2); both are in wavelengths.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..geometry import Geometry

FEW = 48
"""Up to this index of the largest term the terms are summed from the first."""
SPACING = 1.6
"""Terms a width of the peak that are taken of a sum beyond."""
BEFORE, BEHIND = 14, 18
"""How many of them before and behind the largest term."""
NOTHING = -700.0
"""Logarithm of the largest term below which a sum is no number worth its terms: 1e-304."""


class _Sums(NamedTuple):
    """The series and its derivatives, by g and by -t."""

    value: Float[Array, "..."]
    by_g: Float[Array, "..."]
    by_t: Float[Array, "..."]


@jax.custom_jvp
def scattering_series(g: Float[Array, "..."], t: Float[Array, "..."]) -> Float[Array, "..."]:
    """The sum over m >= 1 of g^m e^(-g)/(m! m) exp(-t/m), for g > 0 and t >= 0, but for less than 1e-15 of it.

    Its terms have one peak, near g, or further out for t >> g. Where the peak is below ``FEW`` the terms are summed from the
    first. Beyond, the sum over a smooth peak is its integral to exp(-2 pi^2 width^2), and so is ``width``/``SPACING`` times
    the sum of terms at that spacing, their index no longer an integer and m! by Stirling, to exp(-2 pi^2 ``SPACING``^2) =
    1e-22. Loops end with the terms that the largest peak needs. The derivatives are sums of the same terms.
    """
    return _sums(g, t).value


@scattering_series.defjvp
def _slope(point: tuple[Array, Array], tangent: tuple[Array, Array]) -> tuple[Array, Array]:
    sums = _sums(*point)
    return sums.value, sums.by_g * tangent[0] - sums.by_t * tangent[1]


def _sums(g: Float[Array, "..."], t: Float[Array, "..."]) -> _Sums:
    peak, width = (jax.lax.stop_gradient(x) for x in _peak(g, t))
    few, far = _first(g, t, peak, width), _around(g, t, peak, width)
    return _Sums(*(jnp.where(peak <= FEW, a, b) for a, b in zip(few, far, strict=True)))


def _first(g: Array, t: Array, peak: Array, width: Array) -> _Sums:
    """The terms from the first on, where there are few; 0 elsewhere."""
    here = peak <= FEW
    last = jnp.max(jnp.where(here, jnp.ceil(peak + 9 * width) + 9, 0), initial=0)

    def step(k: Array, carry: tuple[Array, _Sums]) -> tuple[Array, _Sums]:
        weight, sums = carry
        m = k.astype(g.dtype)
        weight = weight * (g / m)
        term = weight * jnp.exp(-t / m) / m
        return weight, _Sums(sums.value + term, sums.by_g + term * ((m - g) / g), sums.by_t + term / m)

    nothing = jnp.zeros_like(g)
    start = jnp.where(here, jnp.exp(-g), 0)
    sums: _Sums
    _, sums = jax.lax.fori_loop(1, last.astype(int) + 1, step, (start, _Sums(nothing, nothing, nothing)))
    return sums


def _around(g: Array, t: Array, peak: Array, width: Array) -> _Sums:
    """Terms to both sides of the largest one."""
    # Guard: a divisor, where the sum is taken from the first term (tests/test_models.py::test_finite).
    p = jnp.maximum(peak, FEW)
    q = (g - p) / p
    near = jnp.abs(q) < 0.5
    # Guard: the logarithm of 0, which the branch not taken would see (tests/test_models.py::test_finite).
    log = jnp.where(near, jnp.log1p(jnp.where(near, q, 0)), jnp.log(jnp.where(near, 1, g / p)))
    # m! by Stirling: m ln g - g - ln m! = m (1 + ln(g/m)) - g - ln(2 pi m)/2 - rest
    highest = -p * (q - log) - t / p - 1.5 * jnp.log(p) - np.log(2 * np.pi) / 2
    here = (peak > FEW) & (highest > NOTHING)
    count = jnp.where(jnp.any(here), BEFORE + BEHIND + 1, 0)
    spacing, lowest, rise, past, nearer = width / (SPACING * p), 3 / p - 1, 1 + log, t / p, 1 / p
    # Guard: p/g overflows where g is tiny and the sum is 0 (tests/test_waves.py::test_series).
    relative = jnp.where(here, p / jnp.where(here, g, 1), 0)

    def step(k: Array, sums: _Sums) -> _Sums:
        z = (k - BEFORE).astype(g.dtype) * spacing  # m = p (1 + z)
        one = z > lowest
        z = jnp.where(one, z, 0)
        share = 1 / (1 + z)
        i = share * nearer
        i2 = i * i
        rest = (1 / 12 - i2 * (1 / 360 - i2 * (1 / 1260 - i2 * (1 / 1680 - i2 / 1188)))) * i
        along = jnp.log1p(z)
        fall = p * (z * rise - (1 + z) * along) + past * (z * share) - 1.5 * along - rest
        term = jnp.where(one, jnp.exp(fall), 0)
        return _Sums(sums.value + term, sums.by_g + term * ((z - q) * relative), sums.by_t + term * i)

    nothing = jnp.zeros_like(g)
    sums = jax.lax.fori_loop(0, count, step, _Sums(nothing, nothing, nothing))
    scale = jnp.where(here, jnp.exp(highest) * width / SPACING, 0)
    return _Sums(*(scale * s for s in sums))


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
