"""The models in 40-digit arithmetic, transcribed from the papers and not from the code under test.

Equation numbers are those of Hoffman (2013), "Background: physics and math of shading", unless another paper is named.
Every formula stands as it is printed; where it has a removable singularity or cancels, digits are added instead of
rewriting it. Integrals use fixed nodes, so that a difference quotient sees a smooth function.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

from mpmath import mp, mpf

DIGITS = 40
DIFFERENCE_DIGITS = 75  # STEP costs 30, and a lobe 1e13 times the body term 13 in the derivative of that term
MANY_DIGITS = 130  # the normalisers lose up to 3 log10(1/b) + 2 log10(1/|c - 1|) digits: 24 + 60 at the corners tested

Vector = Sequence[Any]
Density = Callable[[Any], Any]


# Normal distributions: functions of n.m -------------------------------------------------------------------------------


@cache
def gtr_normaliser(alpha: Any, gamma: Any) -> Any:
    """Eq. 26, with the limits 27 and 28."""
    with mp.workdps(MANY_DIGITS):
        a2 = alpha**2
        if a2 == 1:
            return 1 / mp.pi
        if gamma == 1:
            return (a2 - 1) / (mp.pi * mp.log(a2))
        return (gamma - 1) * (a2 - 1) / (mp.pi * (1 - a2 ** (1 - gamma)))


def gtr(alpha: Any, gamma: Any, cosine: Any) -> Any:
    """Eq. 25 times its normaliser."""
    return gtr_normaliser(alpha, gamma) / (cosine**2 * (alpha**2 - 1) + 1) ** gamma


@cache
def abc_normaliser(b: Any, c: Any) -> Any:
    """Eq. 20, with the limits 21 and 22."""
    with mp.workdps(MANY_DIGITS):
        if c == 1:
            return b**2 / (2 * mp.pi * ((1 + b) * mp.log(1 + b) - b))
        if c == 2:
            return b**2 / (2 * mp.pi * (b - mp.log(1 + b)))
        power = (1 + b) ** c
        return b**2 * power * (c - 2) * (c - 1) / (2 * mp.pi * ((1 + b) ** 2 + power * (b * (c - 2) - 1)))


def abc(b: Any, c: Any, cosine: Any) -> Any:
    """Eq. 19 times its normaliser."""
    return abc_normaliser(b, c) / (1 + b * (1 - cosine)) ** c


@cache
def upper_gamma(s: Any, x: Any) -> Any:
    """Gamma(s, x), the upper incomplete gamma function."""
    with mp.workdps(DIGITS + 20):
        return mp.gammainc(s, x)


def sgd(alpha: Any, p: Any, cosine: Any) -> Any:
    """Eq. 23 and 24 in the variables of Bagher et al. (2012), x = alpha + tan^2/alpha."""
    x = alpha + (1 / cosine**2 - 1) / alpha
    return mp.exp(-x) / (x**p * alpha * upper_gamma(1 - p, alpha) * mp.pi * cosine**4)


# Smith masking --------------------------------------------------------------------------------------------------------


@cache
def gauss_legendre(n: int) -> tuple[tuple[Any, Any], ...]:
    """Nodes and weights on [0, 1], by Newton's method on the Legendre polynomial."""
    with mp.workdps(DIGITS + 10):
        rule = []
        for k in range(n):
            x = mp.cos(mp.pi * (k + mpf(3) / 4) / (n + mpf(1) / 2))
            for _ in range(8):
                below, here = mpf(1), x
                for j in range(2, n + 1):
                    below, here = here, ((2 * j - 1) * x * here - (j - 1) * below) / j
                slope = n * (x * here - below) / (x * x - 1)
                x -= here / slope
            rule.append(((x + 1) / 2, 1 / ((1 - x * x) * slope**2)))
        return tuple(rule)


NODES = 20
PANEL = mpf("0.7")  # width in ln tan(theta): errs by 2e-11 at the worst, the derivative of a Gaussian whose kink is far out


def integrate(f: Callable[[Any], Any], a: Any, b: Any) -> Any:
    """Integral of a smooth ``f`` over [a, b] by one Gauss-Legendre panel."""
    return (b - a) * mp.fsum(w * f(a + (b - a) * x) for x, w in gauss_legendre(NODES))


def projected_area(density: Density, cosine: Any, low: Any, high: Any) -> Any:
    """Integral of max(0, v.m) D(m) over the hemisphere of m, with the azimuth in closed form.

    The rest is summed over panels of ln tan(theta_m) from ``low`` to ``high``, the range that ``density`` needs; the
    integrand has a kink of order 3/2 at theta_m + theta_v = 90 degrees, where panels meet and a square root is mapped out.
    """
    sine = mp.sqrt(1 - cosine**2)
    kink = mp.log(cosine / sine)

    def integrand(x: Any) -> Any:
        tangent = mp.exp(x)
        c = 1 / mp.sqrt(1 + tangent**2)
        s = tangent * c
        if x <= kink:
            azimuth = 2 * mp.pi * cosine * c
        else:
            phi0 = mp.acos(-cosine / sine * c / s)
            azimuth = 2 * (phi0 * cosine * c + sine * s * mp.sin(phi0))
        return density(c) * azimuth * s * (s * c)  # dtheta = sin cos dx

    def panels(a: Any, b: Any) -> Any:
        count = max(1, int(mp.ceil((b - a) / PANEL)))
        width = (b - a) / count
        return mp.fsum(integrate(integrand, a + k * width, a + (k + 1) * width) for k in range(count))

    if kink >= high:
        return panels(low, high)
    width = min(PANEL, high - kink)
    after = integrate(lambda r: integrand(kink + width * r * r) * 2 * width * r, mpf(0), mpf(1))
    if width == PANEL:
        after += panels(kink + width, high)
    return after + (panels(low, kink) if low < kink else 0)


BELOW, ABOVE = 12, 24  # in ln tan(theta): e^-24 of the mass is left out on either side, 4e-11


@cache
def gtr_masking(alpha: Any, gamma: Any, cosine: Any) -> Any:
    """G1, the exact Smith masking of :func:`gtr`."""
    if cosine == 1:
        return mpf(1)
    narrow = mp.log(min(1, alpha / mp.sqrt(1 + gamma)))
    wide = mp.log(max(1, alpha * mp.sqrt(1 + gamma)))  # for alpha > 1 the density sits on the horizon
    density = lambda c: gtr(alpha, gamma, c)  # noqa: E731
    level = mp.log(cosine / mp.sqrt(1 - cosine**2))  # towards normal incidence the integrand ends beyond the kink
    return cosine / projected_area(density, cosine, narrow - BELOW, max(wide, level) + ABOVE)


@cache
def sgd_masking(alpha: Any, p: Any, cosine: Any) -> Any:
    """G1, the exact Smith masking of :func:`sgd`."""
    if cosine == 1:
        return mpf(1)
    narrow = mp.log(alpha / mp.sqrt(alpha + abs(p) + 1))
    wide = mp.log(alpha * 200) / 2  # e^-200 is left out
    density = lambda c: sgd(alpha, p, c)  # noqa: E731
    return cosine / projected_area(density, cosine, narrow - BELOW, wide)


# Models: one channel, directions as triples ---------------------------------------------------------------------------


def _half(l: Vector, v: Vector) -> tuple[Any, Any, Any, Any]:
    """h = (l + v)/|l + v| and theta_d, with tan(theta_d) = |l - v|/|l + v|."""
    total = [a + b for a, b in zip(l, v, strict=True)]
    length = mp.sqrt(mp.fsum(a * a for a in total))
    apart = mp.sqrt(mp.fsum((a - b) ** 2 for a, b in zip(l, v, strict=True)))
    return total[0] / length, total[1] / length, total[2] / length, mp.atan2(apart, length)


def _theta(hx: Any, hy: Any, hz: Any) -> Any:
    return mp.atan2(mp.sqrt(hx**2 + hy**2), hz)


def schlick(f0: Any, cosine: Any) -> Any:
    return f0 + (1 - f0) * (1 - cosine) ** 5


def sgd_fresnel(f0: Any, f1: Any, cosine: Any) -> Any:
    """Bagher et al. (2012), eq. 12."""
    return schlick(f0, cosine) - f1 * cosine


def dielectric(ior: Any, cosine: Any) -> Any:
    """Cook & Torrance (1982), eq. 3."""
    g = mp.sqrt(ior**2 + cosine**2 - 1)
    ratio = (cosine * (g + cosine) - 1) / (cosine * (g - cosine) + 1)
    return (g - cosine) ** 2 / (g + cosine) ** 2 / 2 * (1 + ratio**2)


def vcavity(l: Vector, v: Vector) -> Any:
    """Cook & Torrance (1982), eq. 4."""
    *h, theta_d = _half(l, v)
    return min(1, 2 * h[2] * v[2] / mp.cos(theta_d), 2 * h[2] * l[2] / mp.cos(theta_d))


def ward_lobe(alpha_x: Any, alpha_y: Any, l: Vector, v: Vector) -> Any:
    """The exponential of Ward (1992), eq. 5, over pi alpha_x alpha_y."""
    hx, hy, hz, _ = _half(l, v)
    theta, phi = _theta(hx, hy, hz), mp.atan2(hy, hx)
    slope = mp.tan(theta) ** 2 * (mp.cos(phi) ** 2 / alpha_x**2 + mp.sin(phi) ** 2 / alpha_y**2)
    return mp.exp(-slope) / (mp.pi * alpha_x * alpha_y)


def phong_lobe(exponent_x: Any, exponent_y: Any, l: Vector, v: Vector) -> Any:
    """The power of Ashikhmin & Shirley (2000), eq. 4, as a density of half vectors."""
    hx, hy, hz, _ = _half(l, v)
    across = hx**2 + hy**2
    exponent = (exponent_x * hx**2 + exponent_y * hy**2) / across if across else mpf(0)  # 1 to any power
    return mp.sqrt((exponent_x + 1) * (exponent_y + 1)) / (2 * mp.pi) * hz**exponent


def lambert_model(l: Vector, v: Vector, diffuse: Any) -> Any:
    return diffuse / mp.pi


def gtr_model(l: Vector, v: Vector, diffuse: Any, specular: Any, alpha: Any, gamma: Any) -> Any:
    *h, theta_d = _half(l, v)
    light, viewer = (1 / gtr_masking(alpha, gamma, c) - 1 for c in (l[2], v[2]))
    g = 1 / (1 + light + viewer)
    f = schlick(specular, mp.cos(theta_d))
    return diffuse / mp.pi + f * gtr(alpha, gamma, h[2]) * g / (4 * l[2] * v[2])


def sgd_model(l: Vector, v: Vector, diffuse: Any, specular: Any, alpha: Any, p: Any, f0: Any, f1: Any) -> Any:
    *h, theta_d = _half(l, v)
    g = sgd_masking(alpha, p, l[2]) * sgd_masking(alpha, p, v[2])
    c = mp.cos(theta_d)
    f = sgd_fresnel(f0, f1, c)
    return diffuse / mp.pi + specular * f * sgd(alpha, p, h[2]) * g / (4 * l[2] * v[2])


def abc_model(l: Vector, v: Vector, diffuse: Any, specular: Any, b: Any, c: Any, ior: Any) -> Any:
    *h, theta_d = _half(l, v)
    f = dielectric(ior, mp.cos(theta_d))
    return diffuse / mp.pi + specular * f * abc(b, c, h[2]) * vcavity(l, v) / (4 * l[2] * v[2])


def ward_model(l: Vector, v: Vector, diffuse: Any, specular: Any, alpha_x: Any, alpha_y: Any) -> Any:
    return diffuse / mp.pi + specular * ward_lobe(alpha_x, alpha_y, l, v) / (4 * mp.sqrt(l[2] * v[2]))


def ashikhmin_shirley_model(
    l: Vector,
    v: Vector,
    diffuse: Any,
    specular: Any,
    exponent_x: Any,
    exponent_y: Any,
) -> Any:
    *_, theta_d = _half(l, v)
    body = 28 * diffuse / (23 * mp.pi) * (1 - specular) * (1 - (1 - v[2] / 2) ** 5) * (1 - (1 - l[2] / 2) ** 5)
    cd = mp.cos(theta_d)
    return body + phong_lobe(exponent_x, exponent_y, l, v) * schlick(specular, cd) / (4 * cd * max(l[2], v[2]))


MODELS: dict[str, Callable[..., Any]] = {
    "Lambert": lambert_model,
    "GTR": gtr_model,
    "SGD": sgd_model,
    "ABC": abc_model,
    "Ward": lambda l, v, diffuse, specular, alpha: ward_model(l, v, diffuse, specular, alpha, alpha),
    "WardAnisotropic": ward_model,
    "AshikhminShirley": lambda l, v, diffuse, specular, exponent: ashikhmin_shirley_model(
        l, v, diffuse, specular, exponent, exponent
    ),
    "AshikhminShirleyAnisotropic": ashikhmin_shirley_model,
}
"""By the name of the class under test."""


def value(name: str, parameters: dict[str, float], wi: Sequence[float], wo: Sequence[float]) -> Any:
    """The model's value for parameters and directions taken as exact."""
    with mp.workdps(DIGITS):
        numbers = {k: mpf(float(x)) for k, x in parameters.items()}
        return MODELS[name]([mpf(float(x)) for x in wi], [mpf(float(x)) for x in wo], **numbers)


STEP = mpf(10) ** -30  # of a difference quotient, which is then wrong by STEP^2 f'''/6


def gradient(name: str, parameters: dict[str, float], wi: Sequence[float], wo: Sequence[float]) -> dict[str, Any]:
    """Derivatives by parameter, and in every component of the directions, ``wi_0`` to ``wo_2``.

    Components are independent: the formulas are those of MODELS.md off the unit sphere too.
    """
    model, out = MODELS[name], {}
    with mp.workdps(DIFFERENCE_DIGITS):
        numbers = {k: mpf(float(x)) for k, x in parameters.items()}
        ends = {"wi": [mpf(float(x)) for x in wi], "wo": [mpf(float(x)) for x in wo]}
        for key, x in numbers.items():
            step = STEP * (abs(x) or 1)
            high, low = (model(ends["wi"], ends["wo"], **{**numbers, key: x + s}) for s in (step, -step))
            out[key] = (high - low) / (2 * step)
        for end, vector in ends.items():
            for axis in range(3):
                # a cosine stays below 1, where the sine of masking is real: the derivative there is taken 1e-20 away
                centre = min(vector[axis], 1 - mpf(10) ** -20)
                moved = []
                for s in (STEP, -STEP):
                    vectors = {**ends, end: [centre + s if k == axis else x for k, x in enumerate(vector)]}
                    moved.append(model(vectors["wi"], vectors["wo"], **numbers))
                out[f"{end}_{axis}"] = (moved[0] - moved[1]) / (2 * STEP)
    return out
