"""What a fit minimises: residuals, never squares, and weights relative to the table's measure.

A loss is any JAX-traceable ``loss(predicted, measured, geometry) -> residual`` with BRDF values ``[n, C]`` in 1/sr and a
:class:`~brdfit.geometry.Geometry` of ``[n]``; what is minimised is the sum of weight * residual^2. Those with a name are
here, each after the paper it comes from. f: model, m: measured, i: incident, o: outgoing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..geometry import Geometry

Values = Float[Array, "n C"]
LossFunction = Callable[[Values, Values, Geometry], Array]


class Loss(eqx.Module):
    """A named loss. Call it for the residual ``[..., C]``; :meth:`weight` is ``[...]``, relative to the measure."""

    name: str = eqx.field(static=True)
    source: str = eqx.field(static=True)
    """Key of ``brdfit.references``."""
    function: LossFunction = eqx.field(static=True)
    weigh: Callable[[Geometry], Array] | None = eqx.field(static=True, default=None)
    """Weight relative to the table's measure; None for 1."""
    transform: Callable[[Array, Geometry], Array] | None = eqx.field(static=True, default=None)
    """T with residual T(f) - T(m), on values ``[C, ...]`` that the geometry broadcasts to; None if there is none."""
    inverse: Callable[[Array, Geometry], Array] | None = eqx.field(static=True, default=None)
    """The value f of T(f)."""
    separable: bool = eqx.field(static=True, default=True)
    """Whether the residual of a channel depends on that channel alone, which lets channels be fitted one by one."""
    meaning: str = eqx.field(static=True, default="")
    """What it compares, in a few words."""

    def __call__(self, predicted: Values, measured: Values, g: Geometry) -> Values:
        """Residual of values ``[..., C]`` in 1/sr at a geometry ``[...]``."""
        return self.function(predicted, measured, g)

    def weight(self, g: Geometry) -> Array | None:
        """Weight ``[...]`` relative to the table's measure, or None for 1."""
        return None if self.weigh is None else self.weigh(g)

    def bind(self, measured: np.ndarray) -> Loss:
        """The loss for a table with these measured values (all channels of the fitted cells)."""
        return self


class Relative(Loss):
    """(f - m)/(m + eps) with eps a thousandth of the median of m, so that black cells do not divide by zero."""

    eps: Array | float = 0.0

    def __call__(self, predicted: Values, measured: Values, g: Geometry) -> Values:
        """Residual of values ``[..., C]`` in 1/sr at a geometry ``[...]``."""
        return (predicted - measured) / (measured + self.eps)

    def bind(self, measured: np.ndarray) -> Loss:
        """The loss for a table with these measured values; if half of them are 0, eps is taken from the others."""
        median = float(np.median(measured)) if measured.size else 0.0
        if median == 0:
            positive = measured[measured > 0]
            median = float(np.median(positive)) if positive.size else 1.0
        return replace(self, eps=np.float64(median / 1000))


@jax.custom_jvp
def _cbrt(x: Array) -> Array:
    """Cube root by exp and log, which XLA vectorises (its own is four times slower)."""
    positive = x != 0
    safe = jnp.where(positive, jnp.abs(x), 1.0)
    return jnp.where(positive, jnp.sign(x) * jnp.exp(jnp.log(safe) / 3), 0.0)


@_cbrt.defjvp
def _cbrt_jvp(primals: tuple[Array], tangents: tuple[Array]) -> tuple[Array, Array]:
    # Guard: the slope is infinite at 0, where a black model on a black cell sits. It is held at that of
    # x = 1e-12 (tests/test_losses.py::test_cube_root_slope_is_finite_at_zero); the value stays exact.
    root = _cbrt(primals[0])
    return root, tangents[0] / (3 * (root**2 + 1e-8))


def _log(f: Values, m: Values, g: Geometry) -> Values:
    """ln(1 + f cos_i) - ln(1 + m cos_i), as one logarithm that does not cancel where f is close to m.

    Its argument is positive whichever is larger: log1p near -1 has no digits left, and f far below a huge m is there.
    """
    cos_i = g.cos_i[..., None]
    sign = jnp.where(f >= m, 1.0, -1.0)
    return sign * jnp.log1p(sign * (f - m) * cos_i / (1 + jnp.where(f >= m, m, f) * cos_i))


def _ngan(f: Values, m: Values, g: Geometry) -> Values:
    return (f - m) * g.cos_i[..., None]


def _cuberoot(f: Values, m: Values, g: Geometry) -> Values:
    cos_i = g.cos_i[..., None]
    return _cbrt(f * cos_i) - _cbrt(m * cos_i)


def _perceptual(f: Values, m: Values, g: Geometry) -> Values:
    # root by root: those of f cos_i and m cos_i are also those of _cuberoot, and the compiler takes them once
    return _cuberoot(f, m, g) * _cbrt(g.cos_o)[..., None]


def _relative(f: Values, m: Values, g: Geometry) -> Values:
    raise TypeError("relative needs the table's median: bind() it first")


def _uniform_theta_o(g: Geometry) -> Array:
    return 1 / jnp.maximum(jnp.sqrt((1 - g.cos_o) * (1 + g.cos_o)), np.sin(np.radians(0.5)))


def _cos_o(g: Geometry) -> Array:
    return g.cos_o


_LOG = (lambda f, g: jnp.log1p(f * g.cos_i), lambda t, g: jnp.expm1(t) / g.cos_i)
_NGAN = (lambda f, g: f * g.cos_i, lambda t, g: t / g.cos_i)
_CUBEROOT = (lambda f, g: _cbrt(f * g.cos_i), lambda t, g: t**3 / g.cos_i)
_PERCEPTUAL = (lambda f, g: _cbrt(f * g.cos_i) * _cbrt(g.cos_o), lambda t, g: t**3 / (g.cos_i * g.cos_o))

LOSSES: dict[str, Loss] = {
    loss.name: loss
    for loss in (
        Loss("log", "low2012", _log, None, *_LOG, meaning="ln(1 + f cos θi)"),
        Loss("low", "low2012", _log, _uniform_theta_o, *_LOG, meaning="log, θo uniform (Löw)"),
        Loss("bieron", "bieron2020", _log, _cos_o, *_LOG, meaning="log, weighted cos θo"),
        Loss("ngan", "ngan2005", _ngan, None, *_NGAN, meaning="(f \u2212 m) cos θi"),
        Loss("cuberoot", "fores2012", _cuberoot, None, *_CUBEROOT, meaning="cube root of f cos θi"),
        Relative("relative", "brdfit", _relative, meaning="(f \u2212 m)/m"),
        Loss("perceptual", "lavoue2021", _perceptual, _cos_o, *_PERCEPTUAL, meaning="ranks fits as people do"),
    )
}
"""Every named loss, in the order reports show them after the perceptual one, which ranks fits."""


def check_loss(loss: Loss, channels: int) -> None:
    """Raises ValueError if a loss does not take predicted and measured values ``[n, C]`` and a geometry ``[n]``, or does not
    return one or more residuals a cell, ``[n]`` or ``[n, m]``.
    """
    n = 97  # no number that channels or residuals of a cell are likely to have
    values, one = jnp.ones((n, channels)), jnp.ones(n)
    g = Geometry(one, one, one, 0 * one, one, 0 * one, 0 * one, 0 * one)  # with the azimuth that anisotropic tables have
    try:
        shape = jax.eval_shape(lambda p, m: jnp.asarray(loss(p, m, g)), values, values).shape
    except Exception as fault:
        what = f"{type(fault).__name__}: {' '.join(str(fault).split())}"[:200]
        raise ValueError(f"loss {loss.name!r} cannot take values [n, {channels}] and a geometry [n]: {what}") from fault
    if len(shape) not in (1, 2) or shape[0] != n or n in shape[1:]:
        got = str(list(shape)).replace(str(n), "n")
        raise ValueError(
            f"loss {loss.name!r} returns {got} of values [n, {channels}]: it must return a residual for each cell"
        )


def named_loss(loss: str | Loss | LossFunction) -> Loss:
    """The loss of a name or of a function. Raises ValueError for an unknown name, TypeError for anything else."""
    if isinstance(loss, Loss):
        return loss
    if isinstance(loss, str):
        if loss not in LOSSES:
            raise ValueError(f"unknown loss {loss!r}: choose from {', '.join(LOSSES)}, or pass a function")
        return LOSSES[loss]
    if not callable(loss):
        raise TypeError(f"a loss is a name or a function (predicted, measured, geometry) -> residual, not {loss!r}")
    label = getattr(loss, "__name__", type(loss).__name__)
    return Loss("custom" if label == "<lambda>" else label, "user", loss, separable=False)
