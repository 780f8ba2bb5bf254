"""Retro-reflection: a lobe back to the light."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from jaxtyping import Array, Float

from ...geometry import Geometry
from .. import ndf
from ..base import NOT_NEGATIVE, POSITIVE, parameter
from ..microfacet import microfacet
from ..parts import Parts, implicit
from .effect import Effect, Present, Shapes, at, crossed


def _lobe(m: Any, g: Geometry) -> Float[Array, "..."]:
    across, along = g.tangential_distance2, (g.cos_i + g.cos_o) ** 2
    facets = ndf.GGX(m.alpha_retro)
    total = across + along
    return microfacet(facets(across / total, along / total), m.retro, implicit(facets, g))


def _add(parts: Parts, effects: Present) -> Parts:
    return replace(parts, terms=(*parts.terms, _lobe))


def _start(half_width: float, shapes: Shapes) -> Shapes:
    return crossed(shapes, [{"alpha_retro": a} for a in (0.05, 0.2, 0.6)])


RETRO = Effect(
    "retro",
    "retro-reflection: a lobe of the back vector",
    "retro D(b)/4, D GGX of alpha_retro, b = (l' + v)/|l' + v|, l' the mirror image of l in n",
    {
        "retro": parameter(
            "reflectance back to the light",
            per_channel=True,
            linear=True,
            valid=NOT_NEGATIVE,
            search=(0, 10),
            default=0.02,
        ),
        "alpha_retro": parameter(
            "width of the lobe back to the light", valid=POSITIVE, search=(1e-9, 10), default=0.2, log=True
        ),
    },
    _add,
    neutral=at(retro=0),
    start=_start,
    references=("belcour2014",),
)
