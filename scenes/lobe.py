"""How wide the highlight of a material is, whatever it is made of: what directions are drawn by."""

from __future__ import annotations

import jax
import numpy as np

from ..angles import directions
from .interpolated import Measured, evaluated
from .rendering import cast

THETA_D = np.radians(20)
NARROWEST, WIDEST = 0.002, 1.0


def lobe_alpha(table: Measured) -> float:
    """alpha of the GGX lobe of the same half-width, from :data:`NARROWEST` to :data:`WIDEST`.

    The half-width is the first theta_h, at theta_d = 20 degrees and phi_d = 90, at which the mean of the channels has
    fallen half way from its peak to its value at 60 degrees; its alpha is as in :func:`brdfit.reports.physics.lobe_width`.
    """
    theta = np.concatenate([[0.0], np.geomspace(1e-4, np.radians(60), 400)])
    wi, wo = directions(theta, THETA_D, np.pi / 2)
    with jax.enable_x64(True):
        values = np.asarray(evaluated(*cast((table, wi, wo), "float64")), float).mean(-1)
    half = (values[0] + values[-1]) / 2
    below = np.flatnonzero(values <= half)
    if values[0] <= values[-1] or len(below) == 0:
        return WIDEST
    sin2 = np.sin(theta[below[0]]) ** 2
    return float(np.clip(np.sqrt(sin2 / (np.sqrt(2) - 1 + sin2)), NARROWEST, WIDEST))


__all__ = ["lobe_alpha"]
