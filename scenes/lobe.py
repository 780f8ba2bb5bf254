"""How wide the highlight of a material is, whatever it is made of: what directions are drawn by."""

from __future__ import annotations

import jax
import numpy as np

from ..angles import directions
from ..physics import THETA_D, THETA_H, Width, half_way
from .interpolated import Measured, evaluated
from .rendering import cast

NARROWEST, WIDEST = 0.002, 1.0


def lobe_alpha(table: Measured) -> float:
    """alpha of the GGX lobe of the same half-width, from :data:`NARROWEST` to :data:`WIDEST`.

    The half-width is as in :func:`brdfit.physics.lobe_width`, of the mean of the channels.
    """
    wi, wo = directions(THETA_H, THETA_D, np.pi / 2)
    with jax.enable_x64(True):
        values = np.asarray(evaluated(*cast((table, wi, wo), "float64")), float).mean(-1)
    half = half_way(values, values[-1])
    return WIDEST if half is None else float(np.clip(Width(half).alpha, NARROWEST, WIDEST))


__all__ = ["lobe_alpha"]
