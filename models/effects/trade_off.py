"""The trade-off of energy: what the surface reflects does not reach the body."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from jaxtyping import Array, Float

from ...geometry import Geometry
from ..base import Interval
from ..diffuse import ashikhmin_shirley_albedo
from ..parts import Parts, Term
from .effect import Declared, Effect


def _left(albedo: Term, fresnel: bool, second: bool) -> Term:
    def term(m: Any, g: Geometry) -> Float[Array, "..."]:
        left = albedo(m, g) * (1 - m.specular_2) if second else albedo(m, g)
        return ashikhmin_shirley_albedo(left, m.specular, g) if fresnel else left * (1 - m.specular)

    return term


def _add(parts: Parts, effects: frozenset[str]) -> Parts:
    assert parts.albedo is not None
    return replace(parts, albedo=_left(parts.albedo, "fresnel" in effects, "second_lobe" in effects))


def _declare(parameters: Declared) -> Declared:
    """More than all light is not reflected; where it is all, the body is not determined."""
    changed = {
        n: replace(p, valid=Interval(0, 1), search=(0, 1 - 1e-9)) for n, p in parameters.items() if n.startswith("specular")
    }
    return parameters | changed


TRADE_OFF = Effect(
    "trade_off",
    "the trade-off of energy between body and surface",
    "diffuse (1 - specular) 28/23 (1 - (1 - n.l/2)^5)(1 - (1 - n.v/2)^5) in place of diffuse; without Fresnel's rise "
    "diffuse (1 - specular). A second lobe takes its part, (1 - specular_2), too",
    {},
    _add,
    needs=("body", "lobe"),
    declare=_declare,
    references=("ashikhmin2000",),
)
