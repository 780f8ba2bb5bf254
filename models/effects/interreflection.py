"""Light that goes from facet to facet before it leaves."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from jaxtyping import Array, Float

from ...geometry import Geometry
from ..base import Interval
from ..interreflection import compensation
from ..ndf.stretched import Stretched
from ..parts import Lobe, Parts, Term
from .effect import Declared, Effect


def _of(lobe: Lobe, name: str, fresnel: bool) -> Term:
    def term(m: Any, g: Geometry) -> Float[Array, "..."]:
        facets = lobe.facets(m)
        f0 = getattr(m, name)
        mean = f0 + (1 - f0) / 21 if fresnel else f0  # 2 int F cos d(cos) of Schlick's F
        return compensation(facets.round if isinstance(facets, Stretched) else facets, mean, g)

    return term


def _add(parts: Parts, effects: frozenset[str]) -> Parts:
    names = ("specular", "specular_2")
    terms = tuple(_of(lobe, name, "fresnel" in effects) for lobe, name in zip(parts.lobes, names, strict=False))
    return replace(parts, terms=(*parts.terms, *terms))


def _declare(parameters: Declared) -> Declared:
    """Light is multiplied by F at each facet: the BRDF is not affine in it, and defined for F <= 1."""
    changed = {n: replace(p, linear=False, valid=Interval(0, 1)) for n, p in parameters.items() if n.startswith("specular")}
    return parameters | changed


INTERREFLECTION = Effect(
    "interreflection",
    "interreflection between facets: what masking stops comes out again",
    "F_ms (1 - E(l))(1 - E(v))/(pi (1 - E_avg)), F_ms = F_avg^2 E_avg/(1 - F_avg (1 - E_avg)), E the albedo of the lobe for "
    "F = 1 (of the round lobe where it is stretched)",
    {},
    _add,
    needs=("lobe", "masking"),
    declare=_declare,
    references=("kulla2017", "heitz2014"),
)
