"""The trade-off of energy: what the surface reflects does not reach the body."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from jaxtyping import Array, Float

from ...geometry import Geometry
from ..base import Interval
from ..diffuse import ashikhmin_shirley_albedo
from ..parts import Parts, Term, mixed
from .effect import Declared, Effect, Present, Values


def _add(parts: Parts, effects: Present) -> Parts:
    assert parts.albedo is not None
    albedo = parts.albedo

    def left(m: Any, g: Geometry) -> Float[Array, "..."]:
        rest: Float[Array, "..."] = albedo(m, g) * (1 - m.specular)
        return rest

    def left_by_rise(m: Any, g: Geometry) -> Float[Array, "..."]:
        return ashikhmin_shirley_albedo(albedo(m, g), m.specular, g)

    term: Term = mixed(effects["fresnel"], left, left_by_rise) if "fresnel" in effects else left
    return replace(parts, albedo=mixed(effects["trade_off"], albedo, term))


def _declare(parameters: Declared) -> Declared:
    """More than all light is not reflected; where it is all, the body is not determined."""
    return parameters | {"specular": replace(parameters["specular"], valid=Interval(0, 1), search=(0, 1 - 1e-9))}


def _neutral(values: Values, others: frozenset[str]) -> Values | None:
    """Without Fresnel's rise the body is scaled only."""
    if "fresnel" in others or (values["specular"] >= 1).any():
        return None
    return values | {"diffuse": values["diffuse"] / (1 - values["specular"])}


TRADE_OFF = Effect(
    "trade_off",
    "the trade-off of energy between body and surface",
    "diffuse (1 - specular) 28/23 (1 - (1 - n.l/2)^5)(1 - (1 - n.v/2)^5) in place of diffuse; without Fresnel's rise "
    "diffuse (1 - specular)",
    {},
    _add,
    neutral=_neutral,
    needs=("body", "lobe"),
    declare=_declare,
    references=("ashikhmin2000",),
)
