"""What a reflectance model is: parameters that say what they mean, and a formula for one channel."""

from __future__ import annotations

import abc
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields, replace
from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Bool, Float

from ..geometry import Geometry, from_directions
from ..special import hold_slopes


@dataclass(frozen=True)
class Interval:
    """A range of real numbers; an infinite end is open, a finite one open only where said."""

    lower: float = -math.inf
    upper: float = math.inf
    open_lower: bool = False
    open_upper: bool = False

    def __contains__(self, value: object) -> bool:
        v = float(value)  # type: ignore[arg-type]
        above = v > self.lower if self.open_lower else v >= self.lower
        below = v < self.upper if self.open_upper else v <= self.upper
        return math.isfinite(v) and above and below

    def __str__(self) -> str:
        left = "(" if self.open_lower or math.isinf(self.lower) else "["
        right = ")" if self.open_upper or math.isinf(self.upper) else "]"
        return f"{left}{self.lower:g}, {self.upper:g}{right}"


POSITIVE = Interval(0, open_lower=True)
NOT_NEGATIVE = Interval(0)
REAL = Interval()


@dataclass(frozen=True)
class Parameter:
    """What one parameter of a model means and where it may lie.

    ``valid`` is where the formula is defined; ``search`` is the narrower box that a fit searches by default; ``log``
    says that a fit works in its logarithm; ``linear`` that the BRDF is affine in it when the others are held fixed.
    """

    name: str
    meaning: str
    unit: str
    valid: Interval
    search: tuple[float, float]
    default: float
    per_channel: bool = False
    log: bool = False
    linear: bool = False


def parameter(
    meaning: str,
    *,
    valid: Interval = NOT_NEGATIVE,
    search: tuple[float, float] | None = None,
    default: float = 1.0,
    unit: str = "1",
    per_channel: bool = False,
    log: bool = False,
    linear: bool = False,
) -> Any:
    """Declare a parameter as a field of a model; see :class:`Parameter` for the arguments.

    ``search`` defaults to ``valid``; with ``log`` its lower end must be positive.
    """
    box = search if search is not None else (valid.lower, valid.upper)
    if log and not box[0] > 0:
        raise ValueError(f"parameter {meaning!r}: log needs a search box with a positive lower end, not {box}")
    spec = Parameter("", meaning, unit, valid, box, default, per_channel, log, linear)
    return eqx.field(metadata={"parameter": spec})


def parameters_of(model: type[eqx.Module] | eqx.Module) -> tuple[Parameter, ...]:
    """The declared parameters of a model class or instance, in order."""
    return tuple(replace(f.metadata["parameter"], name=f.name) for f in fields(model) if "parameter" in f.metadata)


class BRDF(eqx.Module):
    """A reflectance model: declared parameters and :meth:`evaluate`, the formula for one channel.

    Parameters of an instance have shape ``[C]`` (per channel) or ``[]`` (shared). Instances are JAX pytrees.
    """

    name: ClassVar[str]
    """The name it goes by on the command line and in files."""
    references: ClassVar[tuple[str, ...]] = ()
    """Keys of ``brdfit.references`` for what the model is made of."""
    anisotropic: ClassVar[bool] = False
    """Whether the value depends on the azimuth of the half vector."""

    @classmethod
    def shapes(cls, half_width: float) -> Iterable[dict[str, float]] | None:
        """Where fits start: values of the parameters that bend the lobe, for a lobe of this half-width in radians (where
        the mean over theta_d between 1 and 30 degrees has fallen half way). None: points spread over the search box.
        """
        return None

    def normal_reflectance(self) -> Float[Array, ""] | None:
        """F0, the reflectance of a facet at normal incidence, for one channel; None where nothing corresponds to it."""
        return None

    @abc.abstractmethod
    def evaluate(self, g: Geometry) -> Float[Array, "..."]:
        """BRDF in 1/sr for directions above the horizon, with every parameter a scalar (one channel at a time)."""

    # ``jax.jit(model)`` asks for a hash, which arrays do not have (tests/test_models.py::test_a_model_is_a_function).
    __hash__ = object.__hash__
    __eq__ = object.__eq__

    def __call__(self, wi: ArrayLike, wo: ArrayLike) -> Float[Array, "... C"]:
        """BRDF in 1/sr, ``[..., C]``, for unit vectors ``[..., 3]`` to the light and the viewer.

        Zero, with zero gradient, where either direction is at or below the horizon.
        """
        above, wi, wo = above_horizon(wi, wo)
        model = jax.tree.map(in_session, self)
        single = jnp.result_type(wi, *jax.tree.leaves(model)) == jnp.float32
        values = _single_precision(model, wi, wo) if single else evaluate_channels(model, from_directions(wi, wo))
        return jnp.where(above[..., None], values, 0)


def above_horizon(wi: ArrayLike, wo: ArrayLike) -> tuple[Bool[Array, "..."], Float[Array, "... 3"], Float[Array, "... 3"]]:
    """Whether both unit vectors ``[..., 3]`` are above the horizon, and the vectors, the normal where one is not.

    Guard: below the horizon models divide by zero or take roots of negative numbers, and 0 * inf = NaN in the gradient
    (tests/test_models.py::test_finite, tests/test_tabulated.py::test_below_the_horizon).
    """
    wi, wo = jnp.broadcast_arrays(jnp.asarray(wi), jnp.asarray(wo))
    above = (wi[..., 2] > 0) & (wo[..., 2] > 0)
    normal = jnp.zeros(3, wi.dtype).at[2].set(1)
    return above, jnp.where(above[..., None], wi, normal), jnp.where(above[..., None], wo, normal)


def in_session(x: ArrayLike) -> Array:
    """An array in the precision that JAX works in; a fit's parameters are NumPy's, in float64.

    Guard: NumPy narrows them, not JAX: a constant that JAX once narrowed in a compiled function it would take narrow
    ever after, in float64, too (tests/test_models.py::test_a_model_is_a_function).
    """
    return jnp.asarray(x.astype(jax.dtypes.canonicalize_dtype(x.dtype)) if isinstance(x, np.ndarray) else x)


def channel_axes(model: BRDF, channel: Any = 0, shared: Any = None) -> BRDF:
    """A pytree like ``model`` with ``channel`` at its per-channel parameters and ``shared`` at the others."""
    per_channel = {p.name: p.per_channel for p in parameters_of(model)}
    names = list(per_channel)
    marked: BRDF = eqx.tree_at(
        lambda m: [getattr(m, n) for n in names],
        model,
        [channel if per_channel[n] else shared for n in names],
        is_leaf=lambda x: x is None,
    )
    return marked


def channels(model: BRDF) -> int:
    """Number of channels C of an instance."""
    return max([np.shape(getattr(model, p.name))[0] for p in parameters_of(model) if p.per_channel], default=1)


def evaluate_channels(model: BRDF, g: Geometry, out_axis: int = -1) -> Float[Array, "... C"]:
    """``model.evaluate`` for each channel, stacked along ``out_axis``; what no channel changes is computed once."""
    shape = g.shape

    def one(m: BRDF) -> Array:
        return jnp.broadcast_to(m.evaluate(g), shape)

    return _over_channels(one, model, out_axis)


def _single_precision(model: BRDF, wi: Float[Array, "... 3"], wo: Float[Array, "... 3"]) -> Float[Array, "... C"]:
    """As :func:`evaluate_channels`, with derivatives that stay finite where float32 cannot hold them."""
    directions = [w[..., k] for w in (wi, wo) for k in range(3)]

    def one(m: BRDF) -> Array:
        leaves, kind = jax.tree.flatten(m)
        rebuild: Any = kind

        def value(*x: Array) -> Array:
            g = from_directions(jnp.stack(x[-6:-3], -1), jnp.stack(x[-3:], -1))
            return jnp.broadcast_to(rebuild.unflatten(x[:-6]).evaluate(g), g.shape)

        return hold_slopes(value, *leaves, *directions)

    return _over_channels(one, model, -1)


def _over_channels(one: Callable[[BRDF], Array], model: BRDF, out_axis: int) -> Array:
    axes = (channel_axes(model),)
    return jax.vmap(one, in_axes=axes, out_axes=out_axis, axis_size=channels(model))(model)


__all__ = [
    "BRDF",
    "NOT_NEGATIVE",
    "POSITIVE",
    "REAL",
    "Interval",
    "Parameter",
    "channels",
    "evaluate_channels",
    "parameter",
    "parameters_of",
]
