"""Masking and shadowing of facets by each other."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from jaxtyping import Array, Float

from ...geometry import Geometry
from ..masking import averted_area, smith_correlated
from ..ndf.stretched import Stretched
from ..parts import Parts
from .effect import Effect, Present, replaces


def _visibility(facets: Any, g: Geometry) -> Float[Array, "..."]:
    if not isinstance(facets, Stretched):
        return smith_correlated(facets, g)
    cosines = (facets.stretched_cosine(w) for w in g.directions())
    light, viewer = (averted_area(facets.round, c) / c for c in cosines)
    return 0.25 / (g.cos_i * g.cos_o * (1 + light + viewer))


def _add(parts: Parts, effects: Present) -> Parts:
    return replace(parts, visibility=_visibility, masked=effects["masking"])


MASKING = Effect(
    "masking",
    "masking and shadowing, exact Smith of the lobe itself, height-correlated",
    "V = 1/(4 n.l n.v (1 + Lambda(l) + Lambda(v))) in place of 1/4",
    {},
    _add,
    neutral=replaces,
    needs=("lobe",),
    references=("smith1967", "heitz2014"),
)
