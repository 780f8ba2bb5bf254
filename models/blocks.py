"""The blocks of microfacet models by name: distributions, masking, Fresnel, body terms, and the parameters they bring."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import product
from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import Geometry
from . import fresnel, masking, ndf
from .base import NOT_NEGATIVE, POSITIVE, Interval, parameter
from .common import diffuse_parameter
from .masking.smith import NDF
from .parts import implicit

Shape = dict[str, float]


def _width(meaning: str = "lobe width") -> Any:
    return parameter(meaning, valid=POSITIVE, search=(1e-4, 30), default=0.1, log=True)


def _at_once() -> list[Shape]:
    return [{}]


@dataclass(frozen=True)
class Distribution:
    """A distribution of microfacets, made of its parameters in order."""

    make: Callable[..., NDF]
    parameters: Mapping[str, Any]
    formula: str
    references: tuple[str, ...]
    shapes: Callable[[float], list[Shape]]
    """Where a fit may start, of the half-width of the lobe in radians."""


@dataclass(frozen=True)
class Masking:
    """Masking V = G/(4 n.l n.v) of a distribution."""

    visibility: Callable[[Any, Geometry], Any]
    formula: str
    references: tuple[str, ...]
    needs_alpha: bool = False
    """Whether it is a function of the width alpha of the distribution, which must have one."""
    integral: bool = False
    """Whether it is Smith's integral over the distribution."""


@dataclass(frozen=True)
class Fresnel:
    """Reflectance of a facet, of the geometry and its parameters in order."""

    value: Callable[..., Float[Array, "..."]]
    parameters: Mapping[str, Any]
    formula: str
    references: tuple[str, ...]
    shapes: Callable[[], list[Shape]] = field(default=_at_once)
    """Where a fit may start."""


def _scaled(value: Callable[..., Float[Array, "..."]]) -> Callable[..., Float[Array, "..."]]:
    """Specular times a reflectance that has no scale of its own."""

    def scaled(g: Geometry, specular: Float[Array, ""], *parameters: Float[Array, ""]) -> Float[Array, "..."]:
        return specular * value(*parameters, g)

    return scaled


def _ggx_widths(t: float) -> list[Shape]:
    return [{"alpha": min(max(math.tan(t) * s / math.sqrt(math.sqrt(2) - 1), 2e-4), 20)} for s in (0.1, 0.3, 0.7, 1.3, 4)]


def _gaussian_widths(t: float) -> list[Shape]:
    return [{"alpha": min(max(math.tan(t) / math.sqrt(math.log(2)) * s, 2e-4), 20)} for s in (0.2, 0.5, 1, 2, 6)]


def _exponents(t: float) -> list[Shape]:
    one = -math.log(2) / math.log(math.cos(t))
    return [{"exponent": min(max(one * s, 2e-3), 5e6)} for s in (0.03, 0.2, 1, 4)]


def _student_t(t: float) -> list[Shape]:
    tan2 = math.tan(t) ** 2
    return [
        {"alpha": min(max(math.sqrt(tan2 / ((gamma - 1) * math.expm1(math.log(2) / gamma))) * s, 2e-4), 20), "gamma": gamma}
        for gamma, s in product((1.6, 2.0, 4.0, 20.0), (0.2, 0.6, 1.5))
    ]


def _epd(t: float) -> list[Shape]:
    return [
        {"alpha": min(max(math.tan(t) * math.log(2) ** (-0.5 / p) * s, 1e-6), 20), "p": p}
        for p, s in product((0.25, 0.5, 1.0), (1e-3, 0.03, 0.2, 1, 3))
    ]


def _abc(t: float) -> list[Shape]:
    widths = product((0.4, 0.7, 1.0, 1.6, 4.0), (1.0, 0.2))
    return [{"b": math.expm1(math.log(2) / c) / ((1 - math.cos(t)) * s), "c": c} for c, s in widths]


NDFS: dict[str, Distribution] = {
    "ggx": Distribution(
        ndf.GGX,
        {"alpha": _width()},
        "D = alpha^2/(pi (sin^2 theta_h + alpha^2 cos^2 theta_h)^2)",
        ("trowbridge1975", "walter2007"),
        _ggx_widths,
    ),
    "beckmann": Distribution(
        ndf.Beckmann,
        {"alpha": _width("lobe width (rms slope times sqrt 2)")},
        "D = exp(-tan^2 theta_h/alpha^2)/(pi alpha^2 cos^4 theta_h)",
        ("beckmann1963", "walter2007"),
        _gaussian_widths,
    ),
    "blinn": Distribution(
        ndf.Blinn,
        {"exponent": parameter("exponent of the lobe", search=(1e-3, 1e7), default=100, log=True)},
        "D = (exponent + 2)/(2 pi) (n.h)^exponent",
        ("blinn1977", "hoffman2013"),
        _exponents,
    ),
    "gaussian": Distribution(
        ndf.GaussianAngles,
        {"alpha": parameter("lobe width", valid=POSITIVE, search=(1e-4, 30), default=0.1, log=True, unit="rad")},
        "D = k exp(-theta_h^2/alpha^2), k so that D is normalised",
        ("torrance1967", "blinn1977"),
        _gaussian_widths,
    ),
    "epd": Distribution(
        ndf.EPD,
        {
            "alpha": parameter("lobe width", valid=POSITIVE, search=(1e-7, 30), default=0.1, log=True),
            "p": parameter(
                "power of the squared slope (1: Beckmann)", valid=Interval(0, 1.5, True), search=(0.15, 1.5), default=1
            ),
        },
        "D = exp(-(tan^2 theta_h/alpha^2)^p)/(pi alpha^2 Gamma(1 + 1/p) cos^4 theta_h)",
        ("holzschuch2017",),
        _epd,
    ),
    "student_t": Distribution(
        ndf.StudentT,
        {
            "alpha": _width(),
            "gamma": parameter(
                "fall-off of the tail (2: GGX)",
                valid=Interval(1.5, open_lower=True),
                search=(1.52, 100),
                default=2,
                log=True,
            ),
        },
        "D = 1/(pi alpha^2 cos^4 theta_h (1 + tan^2 theta_h/((gamma - 1) alpha^2))^gamma)",
        ("ribardiere2017",),
        _student_t,
    ),
    "gtr": Distribution(
        ndf.GTR,
        {
            "alpha": parameter("lobe width", valid=POSITIVE, search=(1e-9, 10), default=0.1, log=True),
            "gamma": parameter(
                "fall-off of the tail (2: GGX, 1: Berry)", valid=POSITIVE, search=(0.01, 1e7), default=2, log=True
            ),
        },
        "D = k/(sin^2 theta_h + alpha^2 cos^2 theta_h)^gamma",
        ("burley2012",),
        ndf.GTR.shapes,
    ),
    "abc": Distribution(
        ndf.ABC,
        {
            "b": parameter("inverse width of the lobe", valid=POSITIVE, search=(1e-2, 1e9), default=100, log=True),
            "c": parameter("fall-off of the tail", valid=NOT_NEGATIVE, search=(1e-3, 1e4), default=1, log=True),
        },
        "D = k/(1 + b (1 - n.h))^c",
        ("low2012", "church1990"),
        _abc,
    ),
    "sgd": Distribution(
        ndf.SGD,
        {
            "alpha": parameter("lobe width (mean square slope)", valid=POSITIVE, search=(1e-7, 30), default=0.1, log=True),
            "p": parameter("fall-off of the tail", valid=Interval(), search=(-10, 60), default=0.5),
        },
        "D = exp(-x)/(x^p alpha Gamma(1 - p, alpha) pi cos^4 theta_h), x = alpha + tan^2 theta_h/alpha",
        ("bagher2012",),
        ndf.SGD.shapes,
    ),
}
"""Distributions of microfacets. Their shared parameters are those of the lobe."""

MASKINGS: dict[str, Masking] = {
    "smith": Masking(
        masking.smith_correlated,
        "G = 1/(1 + Lambda(l) + Lambda(v)), Smith's Lambda of D",
        ("smith1967", "heitz2014"),
        integral=True,
    ),
    "smith_separable": Masking(
        masking.smith_separable, "G = G1(l) G1(v), Smith's G1 of D", ("smith1967", "heitz2014"), integral=True
    ),
    "vcavity": Masking(
        lambda lobe, g: masking.vcavity(g),
        "G = min(1, 2 (n.h)(n.l)/(l.h), 2 (n.h)(n.v)/(l.h))",
        ("torrance1967", "cook1982"),
    ),
    "implicit": Masking(implicit, "G = (n.l)(n.v)", ("hoffman2013",)),
    "kelemen": Masking(lambda lobe, g: masking.kelemen(g), "G = (n.l)(n.v)/(l.h)^2", ("kelemen2001",)),
    "half_vector": Masking(
        lambda lobe, g: masking.half_vector(g), "G = (n.l)(n.v)/((l.h) max(n.l, n.v))", ("ashikhmin2000",)
    ),
    "hammon": Masking(
        lambda lobe, g: masking.hammon(lobe.alpha, g),
        "G = 2 (n.l)(n.v)/mix(2 (n.l)(n.v), n.l + n.v, alpha)",
        ("hammon2017",),
        needs_alpha=True,
    ),
    "schlick_smith": Masking(
        lambda lobe, g: masking.schlick_smith(lobe.alpha, g),
        "G = G1(l) G1(v), G1 = n.v/((1 - alpha/2) n.v + alpha/2)",
        ("schlick1994", "karis2013"),
        needs_alpha=True,
    ),
    "walter": Masking(
        lambda lobe, g: masking.walter_correlated(lobe.alpha, g),
        "G = 1/(1 + Lambda(l) + Lambda(v)), Walter's rational Lambda of Beckmann's D",
        ("walter2007", "heitz2014"),
        needs_alpha=True,
    ),
    "walter_separable": Masking(
        lambda lobe, g: masking.walter_separable(lobe.alpha, g),
        "G = G1(l) G1(v), Walter's rational G1 of Beckmann's D",
        ("walter2007",),
        needs_alpha=True,
    ),
}
"""Masking and shadowing."""


def _f0() -> Any:
    return parameter(
        "reflectance at normal incidence, F0", per_channel=True, linear=True, valid=NOT_NEGATIVE, search=(0, 1), default=0.04
    )


def _scale() -> Any:
    return parameter("scale of the lobe", per_channel=True, linear=True, valid=NOT_NEGATIVE, default=1.0)


def _ior(lowest: float = 1.0) -> Any:
    valid = Interval(lowest, open_lower=lowest == 0)
    return parameter("index of refraction", valid=valid, search=(max(lowest * 1.001, 0.05), 1001), default=1.5, log=True)


def _extinction() -> Any:
    return parameter("extinction coefficient", search=(1e-3, 100), default=3.0, log=True)


def _indices() -> list[Shape]:
    return [{"ior": n} for n in (1.3, 1.7, 6.0, 60.0)]


def _complex_indices() -> list[Shape]:
    return [{"ior": n, "k": k} for n, k in ((0.2, 3.0), (1.5, 0.01), (2.0, 3.0))]


FRESNELS: dict[str, Fresnel] = {
    "schlick": Fresnel(
        lambda g, specular: fresnel.schlick(specular, g),
        {"specular": _f0()},
        "F = specular + (1 - specular)(1 - cos theta_d)^5",
        ("schlick1994",),
    ),
    "schlick_scaled": Fresnel(
        _scaled(fresnel.schlick),
        {
            "specular": _scale(),
            "f0": parameter("reflectance at normal incidence, F0", search=(0, 1), default=0.04),
        },
        "F = specular (f0 + (1 - f0)(1 - cos theta_d)^5)",
        ("schlick1994", "ngan2005"),
        lambda: [{"f0": f} for f in (0.03, 0.3, 0.9)],
    ),
    "schlick_ior": Fresnel(
        _scaled(fresnel.schlick_ior),
        {"specular": _scale(), "ior": _ior()},
        "F = specular ((ior - 1)^2 + 4 ior (1 - cos theta_d)^5)/(ior + 1)^2",
        ("schlick1994",),
        _indices,
    ),
    "lazanyi": Fresnel(
        _scaled(fresnel.lazanyi),
        {"specular": _scale(), "ior": _ior(0), "k": _extinction()},
        "F = specular ((ior - 1)^2 + 4 ior (1 - cos theta_d)^5 + k^2)/((ior + 1)^2 + k^2)",
        ("lazanyi2005",),
        _complex_indices,
    ),
    "dielectric": Fresnel(
        _scaled(fresnel.dielectric),
        {"specular": _scale(), "ior": _ior()},
        "F = specular times Fresnel's reflectance of a dielectric of index ior",
        ("cook1982",),
        _indices,
    ),
    "conductor": Fresnel(
        _scaled(fresnel.conductor),
        {"specular": _scale(), "ior": _ior(0), "k": _extinction()},
        "F = specular times Fresnel's reflectance of a conductor of index ior + i k",
        ("born1999",),
        _complex_indices,
    ),
    "none": Fresnel(lambda g, specular: jnp.asarray(specular), {"specular": _scale()}, "F = specular", ("hoffman2013",)),
}
"""Reflectance of a facet. Each has a scale or reflectance ``specular`` per channel that the BRDF is affine in."""

BODIES: dict[str, tuple[str, dict[str, Any]]] = {
    "lambert": ("diffuse/pi + ", {"diffuse": diffuse_parameter()}),
    "transmitted": ("(1 - F) diffuse/pi + ", {"diffuse": diffuse_parameter()}),
    "none": ("", {}),
}
"""Body terms: what they add to the formula, and their parameters."""

__all__ = ["BODIES", "FRESNELS", "MASKINGS", "NDFS", "Distribution", "Fresnel", "Masking", "Shape"]
