"""Oren and Nayar's rough body: V-shaped grooves with Lambertian walls."""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array, Float

from ...geometry import Geometry
from ...special import sine


def oren_nayar(albedo: Float[Array, ""], sigma: Float[Array, ""], g: Geometry) -> Float[Array, "..."]:
    """albedo/pi (A + B max(0, cos(phi_i - phi_o)) sin(alpha) tan(beta)), in 1/sr (Oren & Nayar 1994).

    A = 1 - sigma^2/(2 (sigma^2 + 0.33)), B = 0.45 sigma^2/(sigma^2 + 0.09); alpha is the larger and beta the smaller of the
    polar angles, so that cos sin tan = (l_x v_x + l_y v_y)/max(n.l, n.v), which needs no azimuth at normal incidence.
    """
    s2 = sigma**2
    back = jnp.maximum(g.tangential_product, 0) / jnp.maximum(g.cos_i, g.cos_o)
    return albedo / jnp.pi * (1 - s2 / (2 * (s2 + 0.33)) + 0.45 * s2 / (s2 + 0.09) * back)


def oren_nayar_full(albedo: Float[Array, ""], sigma: Float[Array, ""], g: Geometry) -> Float[Array, "..."]:
    """The functional approximation of the whole model with one interreflection, in 1/sr (Oren & Nayar 1994).

    With c = cos(phi_i - phi_o), alpha the larger and beta the smaller polar angle, and s = sigma^2:

        albedo/pi [C1 + c C2 tan(beta) + (1 - |c|) C3 tan((alpha + beta)/2)]
            + 0.17 albedo^2/pi s/(s + 0.13) [1 - c (2 beta/pi)^2],
        C1 = 1 - s/(2 (s + 0.33)),  C3 = 0.125 s/(s + 0.09) (4 alpha beta/pi^2)^2,
        C2 = 0.45 s/(s + 0.09) (sin(alpha) - [c < 0] (2 beta/pi)^3).
    """
    s2 = sigma**2
    high, low = jnp.maximum(g.cos_i, g.cos_o), jnp.minimum(g.cos_i, g.cos_o)  # cosines of beta and of alpha
    sin_a, sin_b = sine(low), sine(high)
    alpha, beta = jnp.arctan2(sin_a, low), jnp.arctan2(sin_b, high)
    t = g.tangential_product  # c sin(alpha) sin(beta): c alone has no limit at normal incidence
    q = 2 / jnp.pi
    # c (sin(alpha) - (2 beta/pi)^3) tan(beta), whose difference vanishes at grazing as the tangent grows: in 1 - 2 beta/pi
    y, rest = q * beta, q * jnp.arctan2(high, sin_b)
    away = jnp.minimum(t, 0) / (high * sin_a) * (rest * (1 + y + y**2) - low**2 / (1 + sin_a))
    # (1 - |c|) sin(alpha) sin(beta) as |l_xy -+ v_xy|^2/2 less what the polar angles differ by: no digit is lost next to the
    # plane of incidence, where 1 - |c| is small and tan((alpha + beta)/2) may be large
    apart = (g.cos_i - g.cos_o) ** 2 / 2
    tan_mean = (sin_a + sin_b) / (low + high)
    flank = jnp.where(t < 0, 2 * g.cos_d**2 * g.sin2_h, 2 * g.sin2_d - apart) - apart / tan_mean**2
    rough = s2 / (s2 + 0.09)
    one = 1 - s2 / (2 * (s2 + 0.33)) + 0.45 * rough * (jnp.maximum(t, 0) / high + away)
    one = one + 0.125 * rough * (q * alpha * q * beta) ** 2 / (sin_a * sin_b) * flank * tan_mean
    two = 0.17 * albedo * s2 / (s2 + 0.13) * (1 - t * y**2 / (sin_a * sin_b))
    return albedo / jnp.pi * (one + two)
