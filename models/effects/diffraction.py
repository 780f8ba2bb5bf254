"""Scattering by a surface that is smooth against the wavelength."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...geometry import Geometry
from ..base import NOT_NEGATIVE, POSITIVE, parameter
from ..parts import Parts, Term, mixed
from .effect import Effect, Present, Shapes, at


def _scattering(m: Any, g: Geometry) -> Float[Array, "..."]:
    d2 = 4 * g.cos_d**2 * g.sin2_h  # |D_p|^2 = |l + v|^2 sin^2(theta_h)
    scattering: Float[Array, "..."] = m.scatter * jnp.exp(-m.c * jnp.log1p(m.b * d2))
    return scattering


def _risen(m: Any, g: Geometry) -> Float[Array, "..."]:
    """With F at the angle whose sine is |l_xy - v_xy|/2."""
    cosine = jnp.sqrt(g.cos_d**2 + (g.cos_i - g.cos_o) ** 2 / 4)
    vers = g.tangential_distance2 / 4 / (1 + cosine)
    fresnel: Float[Array, "..."] = m.specular + (1 - m.specular) * vers**5
    return fresnel * _scattering(m, g)


def _add(parts: Parts, effects: Present) -> Parts:
    term: Term = mixed(effects["fresnel"], _scattering, _risen) if "fresnel" in effects else _scattering
    return replace(parts, terms=(*parts.terms, term))


def _start(half_width: float, shapes: Shapes) -> Shapes:
    d2 = (2 * np.sin(half_width)) ** 2
    bent = [
        {"b": float(np.expm1(np.log(2) / c) / (d2 * k**2)), "c": c}
        for c, k in ((0.7, 1.0), (1.5, 1.0), (1.0, 0.2), (1.5, 3.0), (4.0, 1.0))
    ]
    return [s | bent[k % 5] for k, s in enumerate(shapes)] if len(shapes) > 5 else [s | b for s in shapes for b in bent]


DIFFRACTION = Effect(
    "diffraction",
    "diffraction by a smooth surface, the ABC form of its power spectrum",
    "scatter F/(1 + b |D_p|^2)^c, D_p = l_xy + v_xy; F = 1, or with Fresnel's rise that of specular at cos = "
    "sqrt(1 - |l_xy - v_xy|^2/4)",
    {
        "scatter": parameter(
            "scattering into the mirror direction", unit="1/sr", per_channel=True, linear=True, valid=NOT_NEGATIVE, default=1
        ),
        "b": parameter("inverse squared width", valid=POSITIVE, search=(1e-2, 1e9), default=100, log=True),
        "c": parameter("fall-off", valid=NOT_NEGATIVE, search=(1e-3, 1e3), default=1, log=True),
    },
    _add,
    neutral=at(scatter=0),
    start=_start,
    references=("low2012", "church1990"),
)
