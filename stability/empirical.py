"""The empirical and wave-optical models in 40-digit arithmetic, transcribed from the papers, not from the code under test.

Where a formula is made of other quantities than l + v, l - v, n.l and n.v, directions are normalised first: a vector rounded
to length is off the unit sphere, where the formula says nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

from mpmath import mp, mpf

from . import cylinders, microfacets, oracle

Vector = Sequence[Any]


def unit(x: Vector) -> list[Any]:
    """A vector over its length."""
    length = mp.sqrt(mp.fsum(a * a for a in x))
    return [a / length for a in x]


def _dot(a: Vector, b: Vector) -> Any:
    return mp.fsum(x * y for x, y in zip(a, b, strict=True))


def _half(l: Vector, v: Vector) -> list[Any]:
    return unit([a + b for a, b in zip(l, v, strict=True)])


def _cosine_d(l: Vector, v: Vector) -> Any:
    """l.h."""
    return mp.cos(oracle._half(l, v)[3])


def _mirror(l: Vector) -> list[Any]:
    """R = 2 (N.L) N - L."""
    return [-l[0], -l[1], l[2]]


def _power(base: Any, exponent: Any) -> Any:
    return base**exponent if base > 0 else mpf(0)


def phong(l: Vector, v: Vector, diffuse: Any, specular: Any, exponent: Any) -> Any:
    """Schwenk (2011), eq. 24, times the factor of Lafortune & Willems (1994)."""
    return diffuse / mp.pi + specular * (exponent + 2) / (2 * mp.pi) * _power(_dot(_mirror(l), v), exponent) / l[2]


def modified_phong(l: Vector, v: Vector, diffuse: Any, specular: Any, exponent: Any) -> Any:
    """Lafortune & Willems (1994); Schwenk (2011), eq. 27."""
    return diffuse / mp.pi + specular * (exponent + 2) / (2 * mp.pi) * _power(_dot(_mirror(l), v), exponent)


def max_phong(l: Vector, v: Vector, diffuse: Any, specular: Any, exponent: Any) -> Any:
    """Schwenk (2011), eq. 29, times (e + 1)/(2 pi)."""
    lobe = _power(_dot(_mirror(l), v), exponent) / max(l[2], v[2])
    return diffuse / mp.pi + specular * (exponent + 1) / (2 * mp.pi) * lobe


def blinn_phong(l: Vector, v: Vector, diffuse: Any, specular: Any, exponent: Any) -> Any:
    return diffuse / mp.pi + specular * (exponent + 2) / (2 * mp.pi) * _half(l, v)[2] ** exponent


def modified_blinn_phong(l: Vector, v: Vector, diffuse: Any, specular: Any, exponent: Any) -> Any:
    """Schwenk (2011), eq. 28, over the albedo of the lobe at normal incidence."""
    return diffuse / mp.pi + specular * _half(l, v)[2] ** exponent / oracle.half_vector_albedo(exponent)


def _polar(l: Vector, v: Vector) -> tuple[Any, Any, Any]:
    """The larger polar angle, the smaller, and cos(phi_i - phi_o)."""
    i, o = (mp.atan2(mp.hypot(x[0], x[1]), x[2]) for x in (l, v))
    return max(i, o), min(i, o), mp.cos(mp.atan2(l[1], l[0]) - mp.atan2(v[1], v[0]))


def oren_nayar(l: Vector, v: Vector, diffuse: Any, sigma: Any) -> Any:
    """Schwenk (2011), eq. 34."""
    alpha, beta, c = _polar(l, v)
    a = 1 - sigma**2 / (sigma**2 + mpf("0.33")) / 2
    b = mpf("0.45") * sigma**2 / (sigma**2 + mpf("0.09"))
    return diffuse / mp.pi * (a + b * max(0, c) * mp.sin(alpha) * mp.tan(beta))


def oren_nayar_full(l: Vector, v: Vector, diffuse: Any, sigma: Any) -> Any:
    """Oren & Nayar (1994), C1, C2, C3 and the second bounce."""
    alpha, beta, c = _polar(l, v)
    s = sigma**2
    c1 = 1 - s / (s + mpf("0.33")) / 2
    c2 = mpf("0.45") * s / (s + mpf("0.09")) * (mp.sin(alpha) - (0 if c >= 0 else (2 * beta / mp.pi) ** 3))
    c3 = mpf("0.125") * s / (s + mpf("0.09")) * (4 * alpha * beta / mp.pi**2) ** 2
    once = diffuse / mp.pi * (c1 + c * c2 * mp.tan(beta) + (1 - abs(c)) * c3 * mp.tan((alpha + beta) / 2))
    return once + mpf("0.17") * diffuse**2 / mp.pi * s / (s + mpf("0.13")) * (1 - c * (2 * beta / mp.pi) ** 2)


def _lafortune_lobe(l: Vector, v: Vector, tilt: Any, exponent: Any) -> Any:
    """Ngan et al. (2005): C_xy (l_x v_x + l_y v_y) + C_z l_z v_z to a power, over the largest coefficient to that power."""
    xy, z = -mp.sin(tilt), mp.cos(tilt)
    base = xy * (l[0] * v[0] + l[1] * v[1]) + z * l[2] * v[2]
    return (exponent + 2) / (2 * mp.pi) * _power(base / max(abs(xy), abs(z)), exponent)


def lafortune(l: Vector, v: Vector, diffuse: Any, **lobes: Any) -> Any:
    """Schwenk (2011), eq. 45."""
    out = diffuse / mp.pi
    for end in ("", "_1", "_2", "_3"):
        if "tilt" + end in lobes:
            out += lobes["specular" + end] * _lafortune_lobe(l, v, lobes["tilt" + end], lobes["exponent" + end])
    return out


def _schlick_fresnel(f0: Any, l: Vector, v: Vector) -> Any:
    return f0 + (1 - f0) * (1 - _cosine_d(l, v)) ** 5


def _schlick_d(r: Any, l: Vector, v: Vector) -> Any:
    """Schwenk (2011), eq. 49, with p = 1 and pi where the text has lost it."""
    t = _half(l, v)[2]
    z = r / (1 + r * t**2 - t**2) ** 2
    g = l[2] / (r - r * l[2] + l[2]) * v[2] / (r - r * v[2] + v[2])
    return (1 - g) / mp.pi + g / (4 * mp.pi * l[2] * v[2]) * z


def schlick(l: Vector, v: Vector, specular: Any, roughness: Any) -> Any:
    return _schlick_fresnel(specular, l, v) * _schlick_d(roughness, l, v)


def schlick_two_layers(l: Vector, v: Vector, specular: Any, base: Any, roughness: Any, base_roughness: Any) -> Any:
    """Schwenk (2011), eq. 48."""
    f = _schlick_fresnel(specular, l, v)
    return f * _schlick_d(roughness, l, v) + (1 - f) * _schlick_fresnel(base, l, v) * _schlick_d(base_roughness, l, v)


def strauss(l: Vector, v: Vector, diffuse: Any, smoothness: Any, metalness: Any, transparency: Any) -> Any:
    """Schwenk (2011), eq. 46 and what follows it, over pi."""
    s, m, t = smoothness, metalness, transparency
    kf, kg, kj = mpf(112) / 100, mpf(101) / 100, mpf(1) / 10
    i, o = (2 * mp.atan2(mp.hypot(x[0], x[1]), x[2]) / mp.pi for x in (l, v))
    f = (1 / (i - kf) ** 2 - 1 / kf**2) / (1 / (1 - kf) ** 2 - 1 / kf**2)
    gi, go = ((1 / (1 - kg) ** 2 - 1 / (x - kg) ** 2) / (1 / (1 - kg) ** 2 - 1 / kg**2) for x in (i, o))
    rd = (1 - s**3) * (1 - t)
    rn = (1 - t) - rd
    j = f * gi * go
    rs = min(1, rn + (rn + kj) * j) * _power(_dot(_mirror(l), v), 3 / (1 - s))
    cs = 1 + m * (1 - f) * (diffuse - 1)
    return (rd * (1 - m * s) * diffuse + rs * cs / l[2]) / mp.pi


def schwenk(l: Vector, v: Vector, diffuse: Any, specular: Any, smoothness: Any, scale: Any) -> Any:
    """Schwenk (2011), section 4.2.4, over pi."""
    h = _half(l, v)
    js = smoothness**2 / _cosine_d(l, v) * _schlick_fresnel(specular, l, v) * h[2] ** (2 / (1 + mpf(1) / 255 - smoothness))
    return (diffuse + scale * js) / mp.pi


def distribution_based(l: Vector, v: Vector, diffuse: Any, specular: Any, f0: Any, **p: Any) -> Any:
    """Ashikhmin & Premoze (2007), with ln p by de Boor's recursion for a uniform cubic B-spline."""
    hx, hy, _ = _half(l, v)
    width2 = mpf(0.002) ** 2  # the float64 number: it is a constant of the model
    c = [mpf(0), *(p[f"p_{k}"] for k in range(1, 12))]
    c = [2 * c[0] - c[1], *c, 2 * c[-1] - c[-2]]
    x = 11 * mp.log(1 + (hx**2 + hy**2) / width2) / mp.log(1 + 1 / width2)
    k = min(int(mp.floor(x)), 10)
    f = x - k
    d = c[k : k + 4]  # those at knots k - 1 to k + 2
    for degree in (3, 2, 1):
        d = [((i + 1 - f) * d[i] + (f + degree - 1 - i) * d[i + 1]) / degree for i in range(degree)]
    lobe = mp.exp(d[0]) / (l[2] + v[2] - l[2] * v[2])
    return diffuse / mp.pi + specular * _schlick_fresnel(f0, l, v) * lobe


def granier_heidrich(
    l: Vector, v: Vector, diffuse: Any, specular: Any, ior: Any, thickness: Any, exponent: Any, base_exponent: Any
) -> Any:
    """After Granier & Heidrich (2003): the surface of a layer and its base, with Snell's law and Fresnel's equations."""

    def enter(w: Vector) -> tuple[Vector, Any]:
        inside = [w[0] / ior, w[1] / ior, mp.sqrt(1 - (w[0] ** 2 + w[1] ** 2) / ior**2)]
        s = (w[2] - ior * inside[2]) / (w[2] + ior * inside[2])
        p = (ior * w[2] - inside[2]) / (ior * w[2] + inside[2])
        return inside, (s * s + p * p) / 2

    (li, rl), (vi, rv) = enter(l), enter(v)
    top = mp.sqrt(rl * rv) * _power(_dot(_mirror(l), v), exponent)
    base = (1 - rl) * (1 - rv) * _power(_dot(_mirror(li), vi), base_exponent)
    phase = 4 * mp.pi * thickness * ior * (li[2] + vi[2]) / 2
    lobe = top + base + 2 * mp.sqrt(top * base) * mp.cos(phase)
    return diffuse / mp.pi + specular * (exponent + 2) / (2 * mp.pi) * lobe


@cache
def _series_and_slopes(g: Any, t: Any) -> tuple[Any, Any, Any]:
    """:func:`series` and its derivatives by g and t, term by term either way from the largest until they are below 1e-45."""
    with mp.workdps(oracle.DIGITS):
        top = max(1, int(g))
        while mp.log(g) - mp.log(top + 1) + t / top**2 > 0:  # far out for t >> g
            top += max(1, top // 8)
        smallest = mpf(10) ** (-mp.dps - 5)
        start = g**top * mp.exp(-g) / mp.factorial(top)
        total = by_g = by_t = mpf(0)
        for step in (1, -1):
            m, weight, term = top, start, mp.inf
            while m >= 1:
                last, term = term, weight / m * mp.exp(-t / m)
                if step == 1 or m != top:
                    total += term
                    by_g += term * (m - g)
                    by_t -= term / m
                if term < smallest * total and term < last:
                    break
                weight = weight * g / (m + 1) if step == 1 else weight * m / g
                m += step
        return total, by_g / g, by_t


def series(g: Any, t: Any) -> Any:
    """Sum over m >= 1 of g^m e^-g/(m! m) exp(-t/m).

    Summed at the float64 numbers nearest to the arguments and carried from there to the first order, as ``oracle.smith``.
    """
    g0, t0 = mpf(float(g)), mpf(float(t))
    total, by_g, by_t = _series_and_slopes(g0, t0)
    return total + by_g * (g - g0) + by_t * (t - t0)


def _cook(ior: Any, c: Any) -> Any:
    """Cook & Torrance (1982), eq. 3."""
    g = mp.sqrt(ior**2 + c**2 - 1)
    ratio = (c * (g + c) - 1) / (c * (g - c) + 1)
    return (g - c) ** 2 / (g + c) ** 2 / 2 * (1 + ratio**2)


def _wave(l: Vector, v: Vector, sigma: Any, tau: Any) -> Any:
    """G D/(pi n.l n.v) of He et al. (1991), eq. 76 to 79, lambda = 1: v = k (k_r - k_i), k_i = -l, k_r = v."""
    k = 2 * mp.pi
    x, y, z = (k * (a + b) for a, b in zip(l, v, strict=True))
    g = (k * sigma * (l[2] + v[2])) ** 2
    d = mp.pi**2 * tau**2 / 4 * series(g, (x * x + y * y) * tau**2 / 4)
    geometry = ((x * x + y * y + z * z) / z) ** 2 / k**2  # (s.k)^2 + (p.k)^2 = |k_r x k_i|^2 cancels for unpolarised light
    return geometry * d / (mp.pi * l[2] * v[2])


def _smith(c: Any, sigma: Any, tau: Any) -> tuple[Any, Any]:
    """S of one direction (He et al. 1991, eq. 24) and K (eq. 82), of its cosine."""
    s = mp.sqrt(1 - c * c)
    if s < mpf(10) ** -30:
        return mpf(1), mpf(0)
    cot = c / s
    a = tau * cot / (2 * sigma)
    spread = (2 / mp.sqrt(mp.pi) * sigma / (tau * cot) * mp.exp(-a * a) - mp.erfc(a)) / 2
    return (1 - mp.erfc(a) / 2) / (spread + 1), mp.erfc(a) / cot


def _effective(ki: Any, ko: Any, sigma: Any) -> Any:
    """sigma of He et al. (1991), eq. 80 and 81: sqrt(pi/2) z = sigma/4 (K_i + K_r) exp(-z^2/(2 sigma^2)), by Newton."""
    right = (ki + ko) / 4 / mp.sqrt(mp.pi / 2)
    x = mpf(0) if right == 0 else mp.sqrt(mp.lambertw(right**2).real)
    return sigma / mp.sqrt(1 + x * x)


def htsg(l: Vector, v: Vector, diffuse: Any, specular: Any, ior: Any, sigma: Any, tau: Any) -> Any:
    """The two diffuse terms of He et al. (1991)."""
    (si, ki), (so, ko) = (_smith(w[2], sigma, tau) for w in (l, v))
    f = _cook(ior, _cosine_d(l, v))
    return diffuse / mp.pi + specular * f * si * so * _wave(l, v, _effective(ki, ko, sigma), tau)


def htsg_mirror(l: Vector, specular: Any, ior: Any, sigma: Any, tau: Any) -> Any:
    """The specular term of He et al. (1991), without its delta function."""
    s, k = _smith(l[2], sigma, tau)
    g = (4 * mp.pi * _effective(k, k, sigma) * l[2]) ** 2
    return specular * _cook(ior, l[2]) * mp.exp(-g) * s * s


def stam(l: Vector, v: Vector, diffuse: Any, specular: Any, sigma: Any, tau: Any, ior: Any) -> Any:
    """Stam (1999): F (1 + l.v)^2/(n.l + n.v)^2/(n.l n.v) times the transform of the surface over its area."""
    k = 2 * mp.pi
    g = (k * sigma * (l[2] + v[2])) ** 2
    u2 = k**2 * ((l[0] + v[0]) ** 2 + (l[1] + v[1]) ** 2)
    spectrum = mp.pi * tau**2 * series(g, u2 * tau**2 / 4)
    factor = ((1 + _dot(l, v)) / (l[2] + v[2])) ** 2 / (l[2] * v[2])
    return diffuse / mp.pi + specular * _cook(ior, _cosine_d(l, v)) * factor * spectrum


def _normalised(model: Callable[..., Any]) -> Callable[..., Any]:
    return lambda l, v, **numbers: model(unit(l), unit(v), **numbers)


_OF_UNIT_VECTORS: dict[str, Callable[..., Any]] = {
    "Phong": phong,
    "ModifiedPhong": modified_phong,
    "MaxPhong": max_phong,
    "OrenNayar": oren_nayar,
    "OrenNayarFull": oren_nayar_full,
    "lafortune": lafortune,
    "lafortune2": lafortune,
    "lafortune3": lafortune,
    "Strauss": strauss,
    "Schwenk": schwenk,
    "DistributionBased": distribution_based,
    "GranierHeidrich": granier_heidrich,
    "HTSG": htsg,
    "StamDiffraction": stam,
}

MODELS: dict[str, Callable[..., Any]] = {
    **oracle.MODELS,
    **microfacets.MODELS,
    "BlinnPhong": blinn_phong,
    "ModifiedBlinnPhong": modified_blinn_phong,
    "Schlick": schlick,
    "SchlickTwoLayers": schlick_two_layers,
    "PoulinFournier": cylinders.poulin_fournier,
    **{name: _normalised(model) for name, model in _OF_UNIT_VECTORS.items()},
}
"""By the name of the class under test: functions of directions and, by name, parameters."""

__all__ = ["MODELS", "htsg_mirror", "mp", "mpf", "series", "unit"]
