"""A rough body: grooves with Lambertian walls, which shine back to the light."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from jaxtyping import Array, Float

from ...geometry import Geometry
from ..base import NOT_NEGATIVE, parameter
from ..diffuse import oren_nayar
from ..parts import Parts
from .effect import Effect, Present, Shapes, at, crossed


def _body(albedo: Float[Array, "..."], m: Any, g: Geometry) -> Float[Array, "..."]:
    return oren_nayar(albedo, m.sigma, g)


def _add(parts: Parts, effects: Present) -> Parts:
    return replace(parts, body=_body)


def _start(half_width: float, shapes: Shapes) -> Shapes:
    return crossed(shapes, [{"sigma": 0.2}, {"sigma": 0.7}])


ROUGH_BODY = Effect(
    "rough_body",
    "a rough body, Oren and Nayar's qualitative model",
    "diffuse/pi (A + B max(0, cos(phi_i - phi_o)) sin(alpha) tan(beta)) in place of diffuse/pi, "
    "A = 1 - sigma^2/(2 (sigma^2 + 0.33)), B = 0.45 sigma^2/(sigma^2 + 0.09)",
    {
        "sigma": parameter(
            "standard deviation of the slope angle", unit="rad", valid=NOT_NEGATIVE, search=(0, 1.5), default=0.3
        )
    },
    _add,
    neutral=at(sigma=0),
    needs=("body",),
    start=_start,
    references=("oren1994",),
)
