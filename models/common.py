"""Parameters that several models share, declared once."""

from __future__ import annotations

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
