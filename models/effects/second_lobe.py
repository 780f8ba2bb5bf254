"""A second lobe, which shares the surface term with the first one."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from jaxtyping import Array, Float

from .. import ndf
from ..base import POSITIVE, Interval, parameter
from ..parts import Parts
from .effect import Effect, Present, Shapes, at, crossed


def _facets(m: Any) -> ndf.GGX:
    return ndf.GGX(m.alpha_2)


def _add(parts: Parts, effects: Present) -> Parts:
    (first,) = parts.lobes
    present = first.share

    def narrow(m: Any) -> Float[Array, ""]:
        share: Float[Array, ""] = 1 - m.share
        return share if present is None else present(m) * share

    def wide(m: Any) -> Float[Array, ""]:
        share: Float[Array, ""] = m.share
        return share if present is None else present(m) * share

    return replace(parts, lobes=(replace(first, share=narrow), replace(first, facets=_facets, share=wide)))


def _start(half_width: float, shapes: Shapes) -> Shapes:
    """The first lobe is the narrow one: without a tail the two can change places."""
    return crossed(shapes, [{"alpha_2": min(k * half_width, 2.0)} for k in (1.5, 4.0, 10.0)])


SECOND_LOBE = Effect(
    "second_lobe",
    "a second lobe with the GGX distribution",
    "(1 - share) F D V + share F D_2 V_2 in place of F D V, D_2 and V_2 of alpha_2",
    {
        "share": parameter(
            "share of the second lobe in the surface term", per_channel=True, linear=True, valid=Interval(0, 1), default=0.3
        ),
        "alpha_2": parameter("width of the second lobe", valid=POSITIVE, search=(1e-9, 10), default=0.4, log=True),
    },
    _add,
    neutral=at(share=0),
    needs=("lobe",),
    start=_start,
    references=("cook1982",),
)
