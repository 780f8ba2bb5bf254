"""Parameters that several models share, declared once."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from .base import NOT_NEGATIVE, parameter


def diffuse_parameter() -> Any:
    """Albedo of the body term."""
    return parameter("body albedo", per_channel=True, linear=True, valid=NOT_NEGATIVE, default=0.5)


def lobe_parameter() -> Any:
    """Scale of a lobe."""
    return parameter("scale of the lobe", per_channel=True, linear=True, valid=NOT_NEGATIVE, default=0.2)


def exponent_parameter(meaning: str = "exponent of the cosine") -> Any:
    """Exponent of a power of a cosine."""
    return parameter(meaning, valid=NOT_NEGATIVE, search=(1e-2, 1e7), default=50, log=True)


def exponent_shapes(half_width: float) -> list[dict[str, float]]:
    """Exponents of cosines narrower and wider than a lobe of this half-width, and such as serve as body."""
    exponent = -np.log(2) / np.log(np.cos(min(half_width, 1.5)))
    exponents = [float(np.clip(exponent * k, 2e-2, 5e6)) for k in (0.1, 0.3, 1.0, 3.0, 10.0)]
    return [{"exponent": e} for e in (*exponents, 1.0)]


def stretched_shapes(shapes: Iterable[dict[str, float]], name: str) -> list[dict[str, float]]:
    """Elliptical shapes from round ones: their parameter ``name`` as a pair, each stretched either way."""
    stretches = (0.4, 1.0, 2.5)
    return [
        {k: v for k, v in s.items() if k != name} | {f"{name}_x": s[name] * r, f"{name}_y": s[name] / r}
        for s in shapes
        for r in stretches
    ]
