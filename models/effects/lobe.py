"""A lobe of microfacets, of one width, without Fresnel's rise and without masking but that which its divisor cancels."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...geometry import Geometry
from .. import ndf
from ..base import NOT_NEGATIVE, POSITIVE, parameter
from ..parts import Lobe, Parts
from .effect import Effect, Present, Shapes, Values, at


def width(m: Any) -> Float[Array, ""]:
    """Alpha of the lobe; where it is anisotropic, that of the round lobe that it is stretched from."""
    alpha: Float[Array, ""] = m.alpha if hasattr(m, "alpha") else jnp.sqrt(m.alpha_x * m.alpha_y)
    return alpha


def _facets(m: Any) -> ndf.GGX:
    return ndf.GGX(width(m))


def _reflectance(m: Any, g: Geometry) -> Float[Array, "..."]:
    specular: Float[Array, "..."] = m.specular
    return specular


def _add(parts: Parts, effects: Present) -> Parts:
    return replace(parts, lobes=(Lobe(_facets, _reflectance, effects["lobe"]),))


def _start(half_width: float, shapes: Shapes) -> Shapes:
    # GGX falls to half its height at tan^2(theta) = alpha^2 (sqrt(2) - 1)
    alpha = np.tan(half_width) / np.sqrt(np.sqrt(2) - 1)
    return [s | {"alpha": float(np.clip(k * alpha, 1e-6, 5))} for s in shapes for k in (0.1, 0.3, 0.6, 1.0, 2.0, 5.0)]


def _neutral(values: Values, others: frozenset[str]) -> Values | None:
    """No reflectance, unless it rises towards grazing."""
    return None if "fresnel" in others else at(specular=0)(values, others)


LOBE = Effect(
    "lobe",
    "a lobe of microfacets with the GGX distribution and constant reflectance",
    "specular D/4, D = alpha^2/(pi (sin^2 theta_h + alpha^2 cos^2 theta_h)^2)",
    {
        "specular": parameter(
            "reflectance of a facet at normal incidence, F0",
            per_channel=True,
            linear=True,
            valid=NOT_NEGATIVE,
            search=(0, 1),
            default=0.04,
        ),
        "alpha": parameter("lobe width", valid=POSITIVE, search=(1e-9, 10), default=0.1, log=True),
    },
    _add,
    neutral=_neutral,
    start=_start,
    references=("trowbridge1975", "walter2007", "hoffman2013"),
)
