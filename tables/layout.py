"""Where the samples of a table lie, and how much of the directions each stands for.

The measure of a sample is the solid angle of light times that of the viewer, dl dv, *integrated over its cell*; on the
half/difference grid dl dv = 4 cos(theta_d) sin(theta_h) sin(theta_d) dtheta_h dtheta_d dphi_d dphi_h.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from ..angles import directions, polar_cosines, unit_vectors

Reals = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class HalfDifferenceGrid:
    """Rusinkiewicz' half/difference angles on a grid, isotropic (``phi_h`` None) or anisotropic.

    Positions are where the values hold; edges bound the cell that each stands for, one more than positions. All angles
    are in radians. An axis ``phi_d`` over [0, pi] assumes reciprocity; one over [0, 2 pi] does not.
    """

    theta_h: Reals
    theta_d: Reals
    phi_d: Reals
    theta_h_edges: Reals
    theta_d_edges: Reals
    phi_d_edges: Reals
    phi_h: Reals | None = None
    phi_h_edges: Reals | None = None

    @property
    def isotropic(self) -> bool:
        """Whether the azimuth of the half vector is left out."""
        return self.phi_h is None

    @property
    def shape(self) -> tuple[int, ...]:
        """``(H, D, P)``, or ``(Q, H, D, P)`` with the azimuth of the half vector first."""
        base = (len(self.theta_h), len(self.theta_d), len(self.phi_d))
        return base if self.phi_h is None else (len(self.phi_h), *base)

    @cached_property
    def _content(self) -> tuple[bytes | None, ...]:
        return tuple(None if a is None else a.tobytes() for a in (getattr(self, f.name) for f in fields(self)))

    def __eq__(self, other: object) -> bool:
        """Whether all positions and edges are the same."""
        return isinstance(other, HalfDifferenceGrid) and self._content == other._content

    def __hash__(self) -> int:
        """Of the content: what is made for a grid can be kept for the next table on it."""
        return hash(self._content)

    def solid_angle(self) -> Reals:
        """Measure of each cell in sr^2, broadcastable to :attr:`shape` (an isotropic cell spans all of phi_h)."""
        h = -np.diff(np.cos(self.theta_h_edges))[:, None, None]
        d = 2 * np.diff(np.sin(self.theta_d_edges) ** 2)[:, None]
        m: Reals = h * d * np.diff(self.phi_d_edges)
        if self.phi_h_edges is None:
            return 2 * np.pi * m
        return np.diff(self.phi_h_edges)[:, None, None, None] * m

    def polar_cosines(self) -> tuple[Reals, Reals]:
        """cos(theta_i) and cos(theta_o) of every cell, of shape ``(H, D, P)``; negative below the horizon."""
        return polar_cosines(self.theta_h[:, None, None], self.theta_d[:, None], self.phi_d)

    def visible(self, max_angle: float, margin: float = 0.0) -> NDArray[np.bool_]:
        """Cells ``(H, D, P)`` with both polar angles below ``max_angle`` radians and the horizon, or, with a ``margin`` of
        cosine, hardly above. Not to be written to: kept for the next table on the same grid.
        """
        return _visible(self, max_angle, margin)

    def directions(self) -> tuple[Reals, Reals]:
        """Unit vectors to light and viewer, each ``[*shape, 3]``."""
        if self.phi_h is None:
            return directions(self.theta_h[:, None, None], self.theta_d[:, None], self.phi_d)
        return directions(self.theta_h[:, None, None], self.theta_d[:, None], self.phi_d, self.phi_h[:, None, None, None])


@lru_cache(maxsize=4)
def _visible(grid: HalfDifferenceGrid, max_angle: float, margin: float) -> NDArray[np.bool_]:
    least = max(np.cos(max_angle), 0.0) - margin
    cos_i, cos_o = grid.polar_cosines()
    both: NDArray[np.bool_] = (cos_i > least) & (cos_o > least)
    return both


@dataclass(frozen=True, eq=False)
class SphericalGrid:
    """Polar angle and azimuth of light and viewer on a grid, as goniometers scan it; radians.

    ``phi_i`` is None on isotropic tables: the light then has azimuth 0.
    """

    theta_i: Reals
    theta_o: Reals
    phi_o: Reals
    theta_i_edges: Reals
    theta_o_edges: Reals
    phi_o_edges: Reals
    phi_i: Reals | None = None
    phi_i_edges: Reals | None = None

    @property
    def isotropic(self) -> bool:
        """Whether the azimuth of the light is left out."""
        return self.phi_i is None

    @property
    def shape(self) -> tuple[int, ...]:
        """``(I, O, P)``, or ``(Q, I, O, P)`` with the azimuth of the light first."""
        base = (len(self.theta_i), len(self.theta_o), len(self.phi_o))
        return base if self.phi_i is None else (len(self.phi_i), *base)

    def solid_angle(self) -> Reals:
        """Measure of each cell in sr^2, broadcastable to :attr:`shape`."""
        i = -np.diff(np.cos(self.theta_i_edges))[:, None, None]
        o = -np.diff(np.cos(self.theta_o_edges))[:, None]
        m: Reals = i * o * np.diff(self.phi_o_edges)
        if self.phi_i_edges is None:
            return 2 * np.pi * m
        return np.diff(self.phi_i_edges)[:, None, None, None] * m

    def directions(self) -> tuple[Reals, Reals]:
        """Unit vectors to light and viewer, each ``[*shape, 3]``."""
        phi_i = np.zeros(()) if self.phi_i is None else self.phi_i[:, None, None, None]
        wi = unit_vectors(self.theta_i[:, None, None], phi_i)
        wo = unit_vectors(self.theta_o[:, None], self.phi_o)
        shape = (*self.shape, 3)
        return np.broadcast_to(wi, shape), np.broadcast_to(wo, shape)


@dataclass(frozen=True, eq=False)
class Scattered:
    """Samples at directions of their own: unit vectors ``[n, 3]`` and the measure ``[n]`` each stands for, in sr^2.

    :func:`brdfit.measurements` makes a table of them. Raises ValueError if a vector is no unit vector, to 1e-6, or a
    measure is negative, not finite, or 0 throughout.
    """

    wi: Reals
    wo: Reals
    measure: Reals
    isotropic: bool = False

    def __post_init__(self) -> None:
        """Check what a fit takes for granted."""
        n = self.measure.shape
        if len(n) != 1 or self.wi.shape != (*n, 3) or self.wo.shape != (*n, 3):
            raise ValueError(f"wi {self.wi.shape}, wo {self.wo.shape} and measure {n} are not [n, 3], [n, 3] and [n]")
        for name, w in (("wi", self.wi), ("wo", self.wo)):
            if not (np.abs(np.einsum("nk,nk->n", w, w) - 1) <= 2e-6).all():
                raise ValueError(f"{name} must be unit vectors")
        if not (np.isfinite(self.measure) & (self.measure >= 0)).all() or (self.measure.size and not self.measure.any()):
            raise ValueError("measure must be finite numbers, not negative and not all 0")

    @property
    def shape(self) -> tuple[int, ...]:
        """``(n,)``."""
        return (len(self.wi),)

    def solid_angle(self) -> Reals:
        """Measure of each sample in sr^2, ``[n]``."""
        return self.measure

    def directions(self) -> tuple[Reals, Reals]:
        """Unit vectors to light and viewer, each ``[n, 3]``."""
        return self.wi, self.wo


Layout = HalfDifferenceGrid | SphericalGrid | Scattered
