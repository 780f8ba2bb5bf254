"""Body reflection: light that entered the material and leaves it in all directions alike."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from jaxtyping import Array, Float

from ...geometry import Geometry
from ..common import diffuse_parameter
from ..parts import Parts
from .effect import Effect, Present, at


def _albedo(m: Any, g: Geometry) -> Float[Array, "..."]:
    albedo: Float[Array, "..."] = m.diffuse
    return albedo


def _add(parts: Parts, effects: Present) -> Parts:
    return replace(parts, albedo=_albedo)


BODY = Effect(
    "body",
    "Lambert's body term",
    "diffuse/pi",
    {"diffuse": diffuse_parameter()},
    _add,
    neutral=at(diffuse=0),
    references=("lambert1760",),
)
