"""A second lobe beside the first one."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from jaxtyping import Array, Float

from ...geometry import Geometry
from .. import ndf
from ..base import NOT_NEGATIVE, POSITIVE, parameter
from ..parts import Lobe, Parts
from .effect import Effect, Shapes, crossed


def _facets(m: Any) -> ndf.GGX:
    return ndf.GGX(m.alpha_2)


def _reflectance(m: Any, g: Geometry) -> Float[Array, "..."]:
    specular: Float[Array, "..."] = m.specular_2
    return specular


def _add(parts: Parts, effects: frozenset[str]) -> Parts:
    return replace(parts, lobes=(*parts.lobes, Lobe(_facets, _reflectance)))


def _start(half_width: float, shapes: Shapes) -> Shapes:
    """The first lobe is the narrow one: without a tail the two can change places."""
    return crossed(shapes, [{"alpha_2": min(k * half_width, 2.0)} for k in (1.5, 4.0, 10.0)])


SECOND_LOBE = Effect(
    "second_lobe",
    "a second lobe with the GGX distribution",
    "specular_2 D/4 with D of alpha_2, with the same Fresnel and masking terms as the first",
    {
        "specular_2": parameter(
            "reflectance of a facet of the second lobe at normal incidence",
            per_channel=True,
            linear=True,
            valid=NOT_NEGATIVE,
            search=(0, 1),
            default=0.02,
        ),
        "alpha_2": parameter("width of the second lobe", valid=POSITIVE, search=(1e-9, 10), default=0.4, log=True),
    },
    _add,
    needs=("lobe",),
    start=_start,
    references=("cook1982",),
)
