"""Parameters that several models share, declared once."""

from __future__ import annotations

from typing import Any

from .base import NOT_NEGATIVE, parameter


def diffuse_parameter() -> Any:
    """Albedo of the body term."""
    return parameter("body albedo", per_channel=True, linear=True, valid=NOT_NEGATIVE, default=0.5)
