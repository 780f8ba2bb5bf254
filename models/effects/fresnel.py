"""Fresnel's rise of the reflectance towards grazing."""

from __future__ import annotations

from dataclasses import replace

from jaxtyping import Array, Float

from ...geometry import Geometry
from ..fresnel import schlick
from ..parts import Parts, Term
from .effect import Effect


def risen(reflectance: Term) -> Term:
    """Schlick's rise from the reflectance at normal incidence."""

    def rise(m: object, g: Geometry) -> Float[Array, "..."]:
        return schlick(reflectance(m, g), g)

    return rise


def _add(parts: Parts, effects: frozenset[str]) -> Parts:
    return replace(parts, lobes=tuple(replace(lobe, reflectance=risen(lobe.reflectance)) for lobe in parts.lobes))


FRESNEL = Effect(
    "fresnel",
    "Fresnel's rise towards grazing, by Schlick's approximation",
    "F = specular + (1 - specular)(1 - cos theta_d)^5 in place of specular",
    {},
    _add,
    needs=("lobe",),
    references=("schlick1994",),
)
