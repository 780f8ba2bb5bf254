"""Fresnel's rise of the reflectance towards grazing."""

from __future__ import annotations

from dataclasses import replace

from jaxtyping import Array, Float

from ...geometry import Geometry
from ..fresnel import schlick
from ..parts import Lobe, Parts, Term, mixed
from .effect import Declared, Effect, Present, replaces
from .lobe import LOBE


def risen(reflectance: Term) -> Term:
    """Schlick's rise from the reflectance at normal incidence."""

    def rise(m: object, g: Geometry) -> Float[Array, "..."]:
        return schlick(reflectance(m, g), g)

    return rise


def _add(parts: Parts, effects: Present) -> Parts:
    def rising(lobe: Lobe) -> Lobe:
        return replace(lobe, reflectance=mixed(effects["fresnel"], lobe.reflectance, risen(lobe.reflectance)))

    return replace(parts, lobes=tuple(rising(lobe) for lobe in parts.lobes))


def _declare(parameters: Declared) -> Declared:
    """Diffraction without a lobe has its F0 from here; with one its scale and F0 multiply each other."""
    if "scatter" not in parameters:
        return parameters
    specular = parameters.get("specular", LOBE.parameters["specular"].metadata["parameter"])
    return parameters | {"specular": specular, "scatter": replace(parameters["scatter"], linear=False)}


FRESNEL = Effect(
    "fresnel",
    "Fresnel's rise towards grazing, by Schlick's approximation",
    "F = specular + (1 - specular)(1 - cos theta_d)^5 in place of specular",
    {},
    _add,
    neutral=replaces,
    needs=("lobe or diffraction",),
    declare=_declare,
    references=("schlick1994",),
)
