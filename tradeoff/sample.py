"""Directions to measure at: fitted cells of the table, drawn in proportion to what each counts."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..fitting import LOSSES
from ..geometry import from_directions
from ..tables import Table

Reals = NDArray[np.float64]

COUNT = 8192
"""Directions that models are timed on: enough that starting a program does not count, few enough for the caches."""


@dataclass(frozen=True)
class Sample:
    """Cells drawn from a table."""

    wi: Reals
    """Unit vectors to the light, ``[n, 3]``."""
    wo: Reals
    """Unit vectors to the viewer, ``[n, 3]``."""
    measured: Reals
    """BRDF in 1/sr, ``[n, C]``."""
    max_angle: float
    """Largest polar angle, degrees."""

    def error(self, values: Reals, loss: str) -> float:
        """Error of BRDF values ``[n, C]`` under a named loss: that of the whole table up to the luck of the draw.

        Values of one sample share that luck, so that their errors can be compared to more digits than they have.
        """
        with jax.enable_x64(True):
            g = from_directions(self.wi, self.wo)
            residual = np.asarray(LOSSES[loss].bind(self.measured)(jnp.asarray(values), jnp.asarray(self.measured), g))
            relative = LOSSES[loss].weight(g)
        weight = np.ones(len(residual)) if relative is None else np.asarray(relative)
        return float(np.sqrt((weight[:, None] * residual**2).sum() / (weight.sum() * residual.shape[1])))


def draw(table: Table, max_angle: float, measure: str, seed: int = 0) -> Sample:
    """Draw :data:`COUNT` cells of those that a fit uses, with replacement, by their share of the measure.

    Raises InputError if no cell has both polar angles within ``max_angle`` degrees.
    """
    used = table.within(float(np.radians(max_angle)))
    if not used.any():
        where = table.source or table.material
        raise InputError(
            f"{where}: no measured cell has both polar angles within {max_angle:g} degrees; choose a larger --max-angle"
        )
    share = np.broadcast_to(table.layout.solid_angle() if measure == "solid_angle" else np.ones(()), used.shape)[used]
    if not share.sum() > 0:
        share = np.ones(len(share))
    chosen = np.random.default_rng(seed).choice(len(share), COUNT, p=share / share.sum())
    wi, wo = (np.broadcast_to(w, (*used.shape, 3))[used][chosen] for w in table.layout.directions())
    return Sample(wi, wo, table.planes[:, used][:, chosen].T, max_angle)


__all__ = ["COUNT", "Sample", "draw"]
