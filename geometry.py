"""The directions of a reflectance measurement, in the quantities that reflectance models are made of.

Local frame: the normal is +z. With l and v the unit vectors to light and viewer,

    h = (l + v)/|l + v|,   theta_h = angle(n, h),   theta_d = angle(h, l) = angle(h, v).

1 - cos loses all digits where an angle is small, so each angle is carried as a cosine *and* a squared sine, both formed
without cancellation: sin^2(theta_h) = h_x^2 + h_y^2 and tan(theta_d) = |l - v|/|l + v|.

A ``Geometry`` may be a flat list of samples (all fields ``[n]``) or lie on a grid, where each field has only the axes it
depends on (``theta_h`` as ``[H, 1, 1]``, ``theta_d`` as ``[1, D, 1]``): models written in array code then evaluate their
parts on their own axes and let them broadcast.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .polar import PolarStencil, PolarTables
from .special import root, sine

Field = Float[Array, "..."]


class Geometry(eqx.Module):
    """Parameter-free quantities of pairs of directions above the horizon. All fields broadcast against each other."""

    cos_i: Field
    """cos(theta_i) = n.l, in (0, 1]."""
    cos_o: Field
    """cos(theta_o) = n.v, in (0, 1]."""
    cos_h: Field
    """n.h."""
    sin2_h: Field
    """sin^2(theta_h), accurate near 0."""
    cos_d: Field
    """l.h = v.h."""
    sin2_d: Field
    """sin^2(theta_d), accurate near 0."""
    h_x2: Field | None = None
    """Squared tangent component of h; None on isotropic tables, where it is not defined."""
    h_y2: Field | None = None
    """Squared bitangent component of h; None on isotropic tables."""
    stencil_i: PolarStencil | None = None
    """Where theta_i lies on a table of polar angles; None to evaluate functions of it directly."""
    stencil_o: PolarStencil | None = None
    slope_x2: Field | None = None
    """h_x^2/h_z^2; None to form it of h_x2 and cos_h, which between grazing directions depend on each other."""
    slope_y2: Field | None = None

    light: Float[Array, "... 3"] | None = None
    """Unit vector to the light; None on isotropic tables."""
    viewer: Float[Array, "... 3"] | None = None

    tables: PolarTables | None = eqx.field(static=True, default=None)
    """Tables of polar angles made beforehand; None to make them where they are asked for."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape that all fields broadcast to."""
        return np.broadcast_shapes(*(f.shape for f in (self.cos_i, self.cos_o, self.sin2_h, self.cos_d)))

    @property
    def cos2_h(self) -> Field:
        """cos^2(theta_h)."""
        return self.cos_h * self.cos_h

    @property
    def vers_h(self) -> Field:
        """1 - cos(theta_h), accurate near 0."""
        return self.sin2_h / (1 + self.cos_h)

    @property
    def tan2_h(self) -> Field:
        """tan^2(theta_h)."""
        return self.sin2_h / self.cos2_h

    @property
    def vers_d(self) -> Field:
        """1 - cos(theta_d), accurate near 0."""
        return self.sin2_d / (1 + self.cos_d)

    @property
    def sin_i(self) -> Field:
        """sin(theta_i), accurate near 0 where the direction is known; never quite 0, as :func:`brdfit.special.sine`."""
        return _sine(self.cos_i, self.light)

    @property
    def sin_o(self) -> Field:
        """sin(theta_o), likewise."""
        return _sine(self.cos_o, self.viewer)

    @property
    def theta_i(self) -> Field:
        """Polar angle of the light, radians."""
        # Guard, here and below: the cosine of a vector normalised to rounding may be above 1, the square of a sine of an
        # azimuth below 0 (tests/test_geometry.py::test_angles_that_come_from_cosines).
        return jnp.arccos(jnp.clip(self.cos_i, -1, 1))

    @property
    def theta_o(self) -> Field:
        """Polar angle of the viewer, radians."""
        return jnp.arccos(jnp.clip(self.cos_o, -1, 1))

    @property
    def theta_h(self) -> Field:
        """Angle between normal and half vector, radians."""
        return jnp.arctan2(jnp.sqrt(self.sin2_h), self.cos_h)

    @property
    def theta_d(self) -> Field:
        """Angle between half vector and either direction, radians."""
        return jnp.arctan2(jnp.sqrt(self.sin2_d), self.cos_d)

    @property
    def phi_d(self) -> Field:
        """Azimuth of the light about the half vector, folded by mirror symmetry into [0, pi], radians."""
        across = 2 * jnp.sqrt(self.sin2_h * self.sin2_d)
        return jnp.arctan2(jnp.sqrt(jnp.maximum(across**2 - (self.cos_o - self.cos_i) ** 2, 0)), self.cos_o - self.cos_i)

    @property
    def tangential_product(self) -> Field:
        """l_x v_x + l_y v_y = sin(theta_i) sin(theta_o) cos(phi_i - phi_o).

        l.v - (n.l)(n.v), of which this is a rewriting, cancels at normal incidence; so do the terms here, but as squares
        of sines.
        """
        return self.cos_d**2 * self.sin2_h - self.sin2_d + (self.cos_i - self.cos_o) ** 2 / 4

    @property
    def tangential_distance2(self) -> Field:
        """(l_x - v_x)^2 + (l_y - v_y)^2.

        Without the directions themselves it is 4 sin^2(theta_d) - (n.l - n.v)^2, which cancels where both graze the surface.
        """
        if self.light is None or self.viewer is None:
            return 4 * self.sin2_d - (self.cos_i - self.cos_o) ** 2
        return (self.light[..., 0] - self.viewer[..., 0]) ** 2 + (self.light[..., 1] - self.viewer[..., 1]) ** 2

    def at_polar(self, function: Callable[[Field], Field]) -> tuple[Field, Field]:
        """``function(cos(theta))`` at theta_i and theta_o: through the table of polar angles where there is one."""
        if self.stencil_i is None or self.stencil_o is None:
            return function(self.cos_i), function(self.cos_o)
        stencil = self.stencil_i
        nodes = stencil.tabulate(function) if self.tables is None else self.tables.get(lambda: stencil.tabulate(function))
        return self.stencil_i.interpolate(nodes), self.stencil_o.interpolate(nodes)

    def tangential(self) -> tuple[Field, Field]:
        """Squared tangent and bitangent components of h.

        Raises ValueError on isotropic tables, which do not have them.
        """
        if self.h_x2 is None or self.h_y2 is None:
            raise ValueError("an anisotropic model needs the azimuth of the half vector, and this table is isotropic")
        return self.h_x2, self.h_y2

    def directions(self) -> tuple[Float[Array, "... 3"], Float[Array, "... 3"]]:
        """Unit vectors to the light and the viewer.

        Raises ValueError on isotropic tables, which do not have them.
        """
        if self.light is None or self.viewer is None:
            raise ValueError(
                "this model needs the directions themselves, which geometry of an isotropic table does not have"
            )
        return self.light, self.viewer

    def slopes(self) -> tuple[Field, Field]:
        """Squared slopes of h along tangent and bitangent, h_x^2/h_z^2 and h_y^2/h_z^2; raises as :meth:`tangential`."""
        x2, y2 = self.tangential()
        if self.slope_x2 is not None and self.slope_y2 is not None:
            return self.slope_x2, self.slope_y2
        over = 1 / self.cos2_h
        return x2 * over, y2 * over

    def flat(self) -> Geometry:
        """The same geometry with every field broadcast and flattened to ``[n]``, without stencils, slopes and directions."""
        shape = self.shape
        fields = (self.cos_i, self.cos_o, self.cos_h, self.sin2_h, self.cos_d, self.sin2_d, self.h_x2, self.h_y2)
        return Geometry(*(None if f is None else jnp.broadcast_to(f, shape).reshape(-1) for f in fields))  # type: ignore[arg-type]


def _sine(cosine: Field, direction: Array | None) -> Field:
    return sine(cosine) if direction is None else root(direction[..., 0] ** 2 + direction[..., 1] ** 2)


def from_directions(wi: ArrayLike, wo: ArrayLike) -> Geometry:
    """Geometry of unit vectors ``[..., 3]`` to light and viewer, in the precision they come in."""
    wi, wo = jnp.asarray(wi), jnp.asarray(wo)
    wi, wo = jnp.broadcast_arrays(wi, wo)
    return replace(from_sums(wi + wo, wi - wo, wi[..., 2], wo[..., 2]), light=wi, viewer=wo)


def from_sums(total: Array, difference: Array, cos_i: Array, cos_o: Array) -> Geometry:
    """Geometry of l + v and l - v, ``[..., 3]``, and of n.l and n.v, ``[...]``."""
    # Component by component: XLA hands a sum along an axis to a library of its own and no longer joins what comes before and
    # after it to one loop, which takes up to five times as long (tests/test_geometry.py::test_one_loop).
    x2, y2, z2 = (total[..., k] ** 2 for k in range(3))
    dx2, dy2, dz2 = (difference[..., k] ** 2 for k in range(3))
    total2, difference2 = x2 + y2 + z2, dx2 + dy2 + dz2
    # |l + v|^2 + |l - v|^2 is 4 for unit vectors; dividing by it keeps theta_d right for vectors normalised to rounding.
    square = total2 + difference2
    # The derivative of z/|l + v| cancels where x^2 + y^2 is small, that of (x^2 + y^2)/|l + v|^2 where z is, and between two
    # directions that graze |l + v| may be 1e-4 (tests/test_stability.py::test_single_precision).
    high = x2 + y2 < z2
    # Guard: 0/0 in the derivative where l + v lies on the horizon (tests/test_geometry.py::test_half_vector_on_the_horizon).
    tan2 = (x2 + y2) / jnp.where(high, z2, 1)
    return Geometry(
        cos_i=cos_i,
        cos_o=cos_o,
        cos_h=jnp.where(high, 1 / jnp.sqrt(1 + tan2), total[..., 2] / jnp.sqrt(total2)),
        sin2_h=jnp.where(high, (x2 + y2) / total2, 1 - z2 / total2),
        cos_d=jnp.sqrt(total2 / square),
        sin2_d=difference2 / square,
        h_x2=x2 / total2,
        h_y2=y2 / total2,
        slope_x2=x2 / z2,
        slope_y2=y2 / z2,
    )


__all__ = ["Geometry", "from_directions", "from_sums"]
