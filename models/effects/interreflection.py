"""Light that goes from facet to facet before it leaves."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from jaxtyping import Array, Float

from ...geometry import Geometry
from ..base import Interval
from ..interreflection import compensation
from ..ndf.stretched import Stretched
from ..parts import Lobe, Parts, Switch, Term, mixed
from .effect import Declared, Effect, Present, replaces


def _constant(m: Any, g: Geometry) -> Float[Array, ""]:
    mean: Float[Array, ""] = m.specular
    return mean


def _risen(m: Any, g: Geometry) -> Float[Array, ""]:
    """2 int F cos d(cos) of Schlick's F."""
    mean: Float[Array, ""] = m.specular + (1 - m.specular) / 21
    return mean


def _of(lobe: Lobe, mean: Term, present: Switch | None) -> Term:
    def term(m: Any, g: Geometry) -> Float[Array, "..."]:
        facets = lobe.facets(m)
        value = compensation(facets.round if isinstance(facets, Stretched) else facets, mean(m, g), g)
        for share in (lobe.share, present):
            value = value if share is None else share(m) * value
        return value

    return term


def _add(parts: Parts, effects: Present) -> Parts:
    mean = mixed(effects["fresnel"], _constant, _risen) if "fresnel" in effects else _constant
    terms = tuple(_of(lobe, mean, effects["interreflection"]) for lobe in parts.lobes)
    return replace(parts, terms=(*parts.terms, *terms))


def _declare(parameters: Declared) -> Declared:
    """Light is multiplied by F at each facet: the BRDF is not affine in it, and defined for F <= 1."""
    return parameters | {"specular": replace(parameters["specular"], linear=False, valid=Interval(0, 1))}


INTERREFLECTION = Effect(
    "interreflection",
    "interreflection between facets: what masking stops comes out again",
    "F_ms (1 - E(l))(1 - E(v))/(pi (1 - E_avg)), F_ms = F_avg^2 E_avg/(1 - F_avg (1 - E_avg)), E the albedo of the lobe for "
    "F = 1 (of the round lobe where it is stretched)",
    {},
    _add,
    neutral=replaces,
    needs=("lobe", "masking"),
    declare=_declare,
    references=("kulla2017", "heitz2014"),
)
