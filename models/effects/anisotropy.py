"""A lobe that is wider along one direction of the surface than across it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from ..common import stretched_shapes
from ..ndf.stretched import Stretched
from ..parts import Lobe, Parts
from .effect import Declared, Effect, Present, Shapes, Values


def _stretched(lobe: Lobe) -> Lobe:
    def facets(m: Any) -> Stretched:
        return Stretched(lobe.facets(m), m.alpha_x, m.alpha_y)

    return replace(lobe, facets=facets)


def _add(parts: Parts, effects: Present) -> Parts:
    first, *others = parts.lobes
    return replace(parts, lobes=(_stretched(first), *others))


def _declare(parameters: Declared) -> Declared:
    """The width becomes a pair, in its place."""
    pair: Declared = {}
    for name, p in parameters.items():
        if name == "alpha":
            pair["alpha_x"] = replace(p, meaning="lobe width along the tangent")
            pair["alpha_y"] = replace(p, meaning="lobe width along the bitangent")
        else:
            pair[name] = p
    return pair


def _start(half_width: float, shapes: Shapes) -> Shapes:
    return stretched_shapes(shapes, "alpha")


def _neutral(values: Values, others: frozenset[str]) -> Values:
    return values | {"alpha_x": values["alpha"], "alpha_y": values["alpha"]}


ANISOTROPY = Effect(
    "anisotropy",
    "an anisotropic lobe: slopes stretched along the tangent",
    "D(h) = D_round(n.h/q)/q^4, q^2 = h_x^2 alpha_y/alpha_x + h_y^2 alpha_x/alpha_y + h_z^2, of width sqrt(alpha_x alpha_y)",
    {},
    _add,
    neutral=_neutral,
    needs=("lobe",),
    declare=_declare,
    start=_start,
    references=("heitz2014", "burley2012"),
)
