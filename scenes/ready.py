"""A model made ready for many directions: functions of one polar angle, such as Smith's integral, from a table."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from ..models import BRDF
from ..tradeoff.tabulated import Tabulated, from_table, tabulate

LIMIT = 90.0
"""Degrees: pictures have pixels up to the horizon."""


class Ready(eqx.Module):
    """A model whose polar functions were tabulated; called as the model is."""

    what: Tabulated

    def __call__(self, wi: ArrayLike, wo: ArrayLike) -> Float[Array, "... C"]:
        """BRDF in 1/sr at unit vectors ``[..., 3]``; 0 below the horizon."""
        wi, wo = jnp.broadcast_arrays(jnp.asarray(wi), jnp.asarray(wo))
        above = (wi[..., 2] > 0) & (wo[..., 2] > 0)
        # Guard: below the horizon there is no polar angle to look up, and models divide by the cosines
        # (tests/test_scenes.py::test_ready_below_the_horizon).
        normal = jnp.zeros(3, wi.dtype).at[2].set(1)
        wi, wo = (jnp.where(above[..., None], w, normal) for w in (wi, wo))
        return jnp.where(above[..., None], from_table(LIMIT)(self.what, wi, wo), 0)


def ready(brdf: Any) -> Any:
    """A model made ready for many directions, called as the model is: ``ready(model)(wi, wo)``.

    Smith's integral is then read from a table, good to 1e-8; a pair of directions takes a hundredth of the time (``gtr``,
    ``sgd``). The model itself where it has no function of a polar angle worth a table (nothing is added to its program).
    """
    if not isinstance(brdf, BRDF):
        return brdf
    what = tabulate(brdf, LIMIT)
    return Ready(what) if what.tables else brdf


__all__ = ["Ready", "ready"]
