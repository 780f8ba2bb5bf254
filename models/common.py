"""Parameters that several models share, declared once."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

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


def stretched_shapes(shapes: Iterable[dict[str, float]], name: str) -> list[dict[str, float]]:
    """Elliptical shapes from round ones: their parameter ``name`` as a pair, each stretched either way."""
    stretches = (0.4, 1.0, 2.5)
    return [
        {k: v for k, v in s.items() if k != name} | {f"{name}_x": s[name] * r, f"{name}_y": s[name] / r}
        for s in shapes
        for r in stretches
    ]
