"""The picture of a material in a scene, as linear radiance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..programs import program
from .illumination import Everywhere, Illumination
from .sampling import BATCHES, sampled
from .scene import Reals


@dataclass(frozen=True, eq=False)
class Rendered:
    """Radiance of the pixels of an object."""

    values: Reals
    """``[P, C]``, in the units of the lights."""
    noise: Reals | None = None
    """Standard error of the values, ``[P, C]``; None where nothing was sampled."""


def radiance(brdf: Any, light: Illumination, alpha: Array | None = None, rounds: int = 0) -> Float[Array, "batches P C"]:
    """Radiance of the pixels: the sum over the sorts of light that the scene has, and over nothing else.

    Punctual lights by the closed form L_o = sum_l f(l, v) E_l (n.l) (Hoffman 2013, eq. 13, E = pi c_light), ambient light by
    the albedo, the rest by sampling. Without the rest there is one batch, and no random number.

    ``brdf`` is any function of unit vectors ``[..., 3]`` to light and viewer that gives ``[..., C]`` in 1/sr.
    """
    total: Any = None
    for p in light.punctual:
        term = brdf(p.wi, light.wo) * p.arriving
        total = term if total is None else total + term
    if light.everywhere is not None:
        term = albedo(brdf, light.everywhere) * light.everywhere.radiance
        total = term if total is None else total + term
    if light.extended is not None:
        assert alpha is not None
        terms = sampled(brdf, light.extended, light.wo, alpha, rounds, jax.random.key(0))
        return terms if total is None else terms + total
    return jnp.asarray(total)[None]


def albedo(brdf: Any, rule: Everywhere) -> Float[Array, "P C"]:
    """int f cos_i dwi of each pixel: integrated at a few polar angles, interpolated in between."""
    at_nodes = (brdf(rule.wi, rule.wo) * rule.weight[..., None]).sum(0)
    table = rule.stencil.tabulate(lambda _: at_nodes)
    return jax.vmap(rule.stencil.interpolate, 1, 1)(table)


_program = program(radiance)


def render(brdf: Any, light: Illumination, *, alpha: float = 0.3, samples: int = 64, dtype: str = "float32") -> Rendered:
    """Render a material.

    Args:
        brdf: A model, a measured table (:class:`brdfit.scenes.Measured`), or any JAX-traceable function of unit vectors.
        light: The light on each pixel.
        alpha: Width of the lobe that directions are drawn from where anything is sampled, as alpha of a GGX lobe.
        samples: Directions of each technique for each pixel, a multiple of :data:`~.sampling.BATCHES` or rounded up to one.
        dtype: ``"float32"`` or ``"float64"``.
    """
    with jax.enable_x64(dtype == "float64"):
        what, arriving = cast((brdf, light), dtype)
        extended = light.extended is not None
        rounds = -(-samples // BATCHES) if extended else 0
        width = jnp.asarray(alpha, dtype) if extended else None
        batches = np.asarray(_program(what, arriving, width, rounds), np.float64)
    if not extended:
        return Rendered(batches[0])
    return Rendered(batches.mean(0), batches.std(0, ddof=1) / np.sqrt(BATCHES))


def cast(tree: Any, dtype: str) -> Any:
    """Floating-point leaves of a pytree in a precision; others as they are."""

    def leaf(x: Any) -> Any:
        floating = isinstance(x, np.ndarray | jax.Array | float) and np.issubdtype(np.asarray(x).dtype, np.floating)
        return np.asarray(x, dtype) if floating else x

    return jax.tree.map(leaf, tree)


__all__ = ["Rendered", "albedo", "cast", "radiance", "render"]
