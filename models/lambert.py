"""Lambert: a body term and nothing else."""

from __future__ import annotations

from typing import ClassVar

from jaxtyping import Array, Float

from ..geometry import Geometry
from .base import BRDF
from .common import diffuse_parameter
from .diffuse import lambert


class Lambert(BRDF):
    """f = diffuse/pi (Lambert 1760). Reciprocal; conserves energy for diffuse <= 1. Shows no highlight at all."""

    name: ClassVar[str] = "lambert"
    references: ClassVar[tuple[str, ...]] = ("lambert1760",)

    diffuse: Float[Array, " C"] = diffuse_parameter()

    def evaluate(self, g: Geometry) -> Float[Array, "..."]:
        """Value in 1/sr."""
        return lambert(self.diffuse)
