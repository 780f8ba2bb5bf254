"""Fits whose lobe is a spike between the samples of a table: it costs no error there, and shows in every picture."""

from __future__ import annotations

import math

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..models import BRDF
from ..programs import program
from ..tables import Table

FAR = 10.0
"""How far above the largest measured value a fit may peak. A lobe as wide as the samples are apart is not cut off by them:
what was measured towards grazing, where BRDFs are larger, exceeds its peak."""


def largest_value(table: Table) -> float:
    """The largest measured value, 1/sr."""
    return float(table.planes.max(where=table.mask, initial=0.0))


@program
def _peak(model: BRDF) -> Float[Array, ""]:
    normal = jnp.array([0.0, 0.0, 1.0])
    return jnp.max(model(normal, normal))


def peak(model: BRDF) -> float:
    """The largest value, 1/sr, of a model with parameters at normal incidence in the mirror direction."""
    with jax.enable_x64(True):
        return float(_peak(jax.tree.map(np.asarray, model)))


def is_spike(model: BRDF, largest: float) -> bool:
    """Whether a model peaks further above the largest measured value, 1/sr, than a table can tell."""
    return not peak(model) <= FAR * largest


def spike_warning(peak: float, largest: float, loss: str) -> str:
    """What to say of a spike that a fit under a loss ended with."""
    if not math.isfinite(peak):
        return f"its value at normal incidence is {peak}: do not render with it"
    others = " or ".join(name for name in ("perceptual", "ngan") if name != loss)
    return (
        f"it peaks at {peak:.2g}/sr, and no measured value is above {largest:.2g}/sr: a lobe narrower than the cells, which "
        f"costs no error there and shows in pictures; fit under the loss {others}"
    )


__all__ = ["is_spike", "largest_value", "peak", "spike_warning"]
