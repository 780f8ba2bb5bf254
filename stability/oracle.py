"""The models in 40-digit arithmetic, transcribed from the papers and not from the code under test.

Equation numbers are those of Hoffman (2013), "Background: physics and math of shading", unless another paper is named.
Every formula stands as it is printed; where it has a removable singularity or cancels, digits are added instead of
rewriting it. Integrals are differentiated under the integral sign.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache, lru_cache
from typing import Any

from mpmath import mp, mpf

DIGITS = 40
STEP = mpf(10) ** -50  # of a difference quotient, which is then wrong by STEP f''/2: at most 1e-24, of a lobe of height 1e13
DIFFERENCE_DIGITS = 105  # STEP costs 50, and a lobe 1e13 times the body term 13 in the derivative of that term
MANY_DIGITS = 200  # the normalisers lose up to 3 log10(1/b) + 2 log10(1/|c - 1|) digits: 24 + 100 a step beside c = 1

Vector = Sequence[Any]
Density = Callable[..., Any]
"""Of its parameters and n.m."""
Shape = tuple[Any, ...]
"""Parameters of a density."""


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
    with mp.workdps(DIFFERENCE_DIGITS):
        return mp.gammainc(s, x)


def sgd(alpha: Any, p: Any, cosine: Any) -> Any:
    """Eq. 23 and 24 in the variables of Bagher et al. (2012), x = alpha + tan^2/alpha."""
    x = alpha + (1 / cosine**2 - 1) / alpha
    return mp.exp(-x) / (x**p * alpha * upper_gamma(1 - p, alpha) * mp.pi * cosine**4)


def half_vector_albedo(exponent: Any) -> Any:
    """Of the lobe (n.h)^e at normal incidence, int cos^e(t/2) cos(t) sin(t) dt 2 pi.

    With u = cos(t/2): sin(t) dt = -4 u du, cos(t) = 2 u^2 - 1, u from 1 down to sqrt(1/2).
    """
    x, low = exponent + 4, mp.sqrt(mpf(1) / 2)
    return 8 * mp.pi * (2 * (1 - low**x) / x - (1 - low ** (x - 2)) / (x - 2))


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
BELOW, ABOVE = 12, 24  # in ln tan(theta): e^-24 of the mass is left out on either side, 4e-11
with mp.workdps(DIGITS):
    NEXT_TO_NORMAL = 1 - mpf(10) ** -20  # stands for a cosine of 1, where the sine divides

Nodes = Sequence[tuple[Any, Any, Any]]


def nodes(start: Any, width: Any, squared: bool = False) -> Nodes:
    """cos(theta_m), sin(theta_m) and the weights of int sin(theta_m) dtheta_m for a panel of ln tan(theta_m).

    With ``squared`` they go from ``start`` as the square of an even variable, in which the root of a kink is smooth.
    """
    found = []
    for x, w in gauss_legendre(NODES):
        tangent = mp.exp(start + width * (x * x if squared else x))
        c = 1 / mp.sqrt(1 + tangent**2)
        s = tangent * c
        found.append((c, s, width * w * (2 * x if squared else 1) * s * s * c))  # dtheta = sin cos dx
    return found


@cache
def panel(k: int) -> Nodes:
    """The nodes of panel ``k``, which all parameters and polar angles share."""
    return nodes(k * PANEL, PANEL)


def parted(cosine: Any, at: Nodes) -> tuple[Any, Any]:
    """Weights times the integral of max(0, v.m) over the azimuth, some m averted, and its derivative by ``cosine`` = n.v.

    phi0 need not be moved in the derivative: the integrand is 0 there.
    """
    sine = mp.sqrt(1 - cosine**2)
    area, slope = [], []
    for c, s, w in at:
        phi0 = mp.acos(-cosine / sine * c / s)
        area.append(2 * w * (phi0 * cosine * c + sine * s * mp.sin(phi0)))
        slope.append(2 * w * (phi0 * c - cosine / sine * s * mp.sin(phi0)))
    return area, slope


@cache
def parted_panel(cosine: Any, k: int) -> tuple[Any, Any]:
    """:func:`parted` for panel ``k``."""
    return parted(cosine, panel(k))


def density_and_slopes(density: Density, shape: Shape, at: Nodes) -> list[list[Any]]:
    """D at nodes, and its derivatives by its parameters as difference quotients."""
    found = [[density(*shape, c) for c, *_ in at]]
    for k, x in enumerate(shape):
        step = STEP * (abs(x) or 1)
        moved = *shape[:k], x + step, *shape[k + 1 :]
        found.append([(density(*moved, c) - d) / step for (c, *_), d in zip(at, found[0], strict=True)])
    return found


@lru_cache(maxsize=512)  # the panels of some sets of parameters: polar angles share them
def density_panel(density: Density, shape: Shape, k: int) -> list[list[Any]]:
    """:func:`density_and_slopes` for panel ``k``."""
    return density_and_slopes(density, shape, panel(k))


def projection(at: Nodes, values: list[list[Any]]) -> list[Any]:
    """Integrals of (n.m) D and of its derivatives: where no m is averted, the projected area over n.v."""
    weights = [2 * mp.pi * c * w for c, _, w in at]
    return [mp.fdot(weights, v) for v in values]


@lru_cache(maxsize=512)
def projection_panel(density: Density, shape: Shape, k: int) -> list[Any]:
    """:func:`projection` for panel ``k``."""
    return projection(panel(k), density_panel(density, shape, k))


@cache
def projected_area(density: Density, shape: Shape, cosine: Any) -> list[Any]:
    """Integral of max(0, v.m) D(m) over the hemisphere of m, and its derivatives by the parameters of D and ``cosine`` =
    n.v < 1.

    The azimuth is in closed form, the rest is summed over panels of ln tan(theta_m). The integrand has a kink of order 3/2
    at theta_m + theta_v = 90 degrees, from which panels go out anew. Derivatives are those of the integrand at its nodes.
    """
    with mp.workdps(DIFFERENCE_DIGITS):
        kink = mp.log(cosine / mp.sqrt(1 - cosine**2))
        first, here, last = (int(mp.floor(x / PANEL)) for x in EXTENT[density](*shape, kink))
        facing = [projection_panel(density, shape, k) for k in range(first, min(here, last + 1))]
        beyond = range(max(first, here + 2), last + 1)
        averted = [(density_panel(density, shape, k), parted_panel(cosine, k)) for k in beyond]
        if first - 2 < here <= last:
            before = nodes(here * PANEL, kink - here * PANEL)
            facing.append(projection(before, density_and_slopes(density, shape, before)))
            half = ((here + 2) * PANEL - kink) / 2
            after = nodes(kink, half, squared=True), nodes(kink + half, half)
            averted += [(density_and_slopes(density, shape, at), parted(cosine, at)) for at in after]
        mass = [mp.fsum(column) for column in zip(*facing, strict=True)] or [mpf(0)] * (1 + len(shape))
        area = [cosine * m + mp.fsum(mp.fdot(d[n], w) for d, (w, _) in averted) for n, m in enumerate(mass)]
        return [*area, mass[0] + mp.fsum(mp.fdot(d[0], slope) for d, (_, slope) in averted)]


def gtr_extent(alpha: Any, gamma: Any, kink: Any) -> tuple[Any, Any, Any]:
    """Ends of the integral of :func:`gtr` in ln tan(theta_m), with the kink between them."""
    narrow = mp.log(min(1, alpha / mp.sqrt(1 + gamma)))
    wide = mp.log(max(1, alpha * mp.sqrt(1 + gamma)))  # for alpha > 1 the density sits on the horizon
    return narrow - BELOW, kink, max(wide, kink) + ABOVE  # towards normal incidence the integrand ends beyond the kink


def sgd_extent(alpha: Any, p: Any, kink: Any) -> tuple[Any, Any, Any]:
    """The same of :func:`sgd`."""
    return mp.log(alpha / mp.sqrt(alpha + abs(p) + 1)) - BELOW, kink, mp.log(alpha * 200) / 2  # e^-200 is left out


def abc_extent(b: Any, c: Any, kink: Any) -> tuple[Any, Any, Any]:
    """The same of :func:`abc`."""
    return -mp.log(1 + b * (1 + c)) / 2 - BELOW, kink, max(0, kink) + ABOVE


EXTENT: dict[Density, Callable[..., tuple[Any, Any, Any]]] = {gtr: gtr_extent, sgd: sgd_extent, abc: abc_extent}
"""Others are added where they are defined."""


def smith(density: Density, *arguments: Any) -> Any:
    """G1, the exact Smith masking of a density, of its parameters and n.v: n.v over the projected area.

    The area is that at the float64 numbers nearest to the arguments, carried from there to the first order: what a
    difference quotient needs of steps that float64 does not see, without an integral for each.
    """
    at = [mpf(float(x)) for x in arguments]
    at[-1] = min(at[-1], NEXT_TO_NORMAL)
    area, *slopes = projected_area(density, tuple(at[:-1]), at[-1])
    return arguments[-1] / (area + mp.fsum(d * (x - x0) for d, x, x0 in zip(slopes, arguments, at, strict=True)))


def gtr_masking(alpha: Any, gamma: Any, cosine: Any) -> Any:
    """G1 of :func:`gtr`."""
    return smith(gtr, alpha, gamma, cosine)


def sgd_masking(alpha: Any, p: Any, cosine: Any) -> Any:
    """G1 of :func:`sgd`."""
    return smith(sgd, alpha, p, cosine)


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
