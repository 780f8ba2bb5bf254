"""A model as a compiled program on a list of directions: what it gives, what it costs by the compiler's own account."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array
from numpy.typing import NDArray

from .sample import Sample

Reals = NDArray[np.float64]


@dataclass(frozen=True)
class Operations:
    """The compiler's own count for one pair of directions and all channels (XLA's cost analysis)."""

    flops: float
    transcendentals: float
    """Calls of exp, log, sqrt and the like, which it does not count as flops."""
    bytes: float
    """Bytes that are read or written."""

    @property
    def count(self) -> float:
        """Flops and transcendentals together."""
        return self.flops + self.transcendentals


class Evaluation:
    """``function(what, wi, wo)`` compiled for the directions of a sample, in ``float32`` or ``float64``.

    ``what`` is a pytree of numbers, a model for example, passed as argument: nothing is folded into the program.
    """

    def __init__(
        self, function: Callable[[Any, Array, Array], Array], what: Any, sample: Sample, dtype: str = "float32"
    ) -> None:
        self._wide = dtype == "float64"
        self.count = len(sample.wi)
        with jax.enable_x64(self._wide):
            self._arguments = jax.tree.map(lambda x: jnp.asarray(x, dtype), (what, sample.wi, sample.wo))
            self._program = jax.jit(function).lower(*self._arguments).compile()

    def __call__(self) -> Array:
        """Values ``[n, C]``, when they are there."""
        with jax.enable_x64(self._wide):
            values: Array = self._program(*self._arguments).block_until_ready()
        return values

    def values(self) -> Reals:
        """Values ``[n, C]`` as float64."""
        return np.asarray(self(), np.float64)

    def operations(self) -> Operations:
        """For one pair of directions; NaN for what the compiler does not tell."""
        cost = self._program.cost_analysis() or {}
        counted = [float(cost.get(k, 0.0 if cost else np.nan)) for k in ("flops", "transcendentals", "bytes accessed")]
        return Operations(*(v / self.count for v in counted))


def direct(model: Any, wi: Array, wo: Array) -> Array:
    """The model as anyone calls it."""
    values: Array = model(wi, wo)
    return values


__all__ = ["Evaluation", "Operations", "direct"]
