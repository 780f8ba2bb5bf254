"""A measured BRDF: values, where they hold, which of them are real, and where they came from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .layout import HalfDifferenceGrid, Layout

Convention = Literal["edge", "centre", "exact"]


@dataclass(frozen=True, eq=False)
class Table:
    """Tabulated BRDF values in 1/sr. Build one with :func:`brdfit.load` or :func:`table`.

    ``planes`` ``[C, *layout.shape]`` float64, one plane a channel; what the mask leaves out is never read as a value.
    ``mask`` ``[*layout.shape]`` is True where every channel is a measured value (finite and not negative).
    ``angles`` says how a cell's index became an angle: its lower ``edge``, its ``centre``, or angles given ``exact``.
    """

    planes: NDArray[np.float64]
    mask: NDArray[np.bool_]
    layout: Layout
    material: str
    source: str = ""
    sha256: str = ""
    angles: Convention = "exact"
    channel_names: tuple[str, ...] = ()
    seconds: float = 0.0
    """Time that reading it took."""

    def __repr__(self) -> str:
        """What it is and where it came from, without its values."""
        shape = " x ".join(str(n) for n in self.layout.shape)
        kind = f"{'isotropic' if self.isotropic else 'anisotropic'} {type(self.layout).__name__}"
        masked = f"{100 * (1 - self.mask.mean()):.1f} % masked" if self.mask.size else "empty"
        origin = f" from {self.source}" if self.source else ""
        return f"Table({self.material}{origin}\n    {kind} {shape}, channels {self.channels}, {masked})"

    @property
    def channels(self) -> int:
        """Number of channels C."""
        return int(self.planes.shape[0])

    @property
    def values(self) -> NDArray[np.float64]:
        """BRDF values ``[*layout.shape, C]`` in 1/sr (a view); NaN is possible only where ``mask`` is False."""
        return np.moveaxis(self.planes, 0, -1)

    @property
    def isotropic(self) -> bool:
        """Whether the table says nothing about rotation about the normal."""
        return self.layout.isotropic

    def within(self, max_angle: float) -> NDArray[np.bool_]:
        """Cells that are measured and have both polar angles within ``max_angle`` radians.

        Cells at the limit itself are left out, to rounding: 80 degrees is a row of the MERL grid, and with the edge
        convention its cells lie beyond.
        """
        if isinstance(self.layout, HalfDifferenceGrid):
            return self.mask & self.layout.visible(max_angle)
        limit = np.cos(max_angle)
        wi, wo = self.layout.directions()
        ci, co = wi[..., 2], wo[..., 2]
        kept: NDArray[np.bool_] = self.mask & (ci > limit) & (co > limit) & (ci > 0) & (co > 0)
        return kept


def table(planes: NDArray[np.float64], layout: Layout, material: str, **provenance: object) -> Table:
    """A table whose mask is what the values say: cells with a negative or non-finite channel are masked.

    Raises ValueError if ``planes`` is not ``[C, *layout.shape]``.
    """
    planes = np.asarray(planes, float)
    if planes.shape[1:] != layout.shape or planes.ndim < 2:
        raise ValueError(f"{material}: values of shape {planes.shape} do not fit channels x {layout.shape}")
    mask = np.ones(layout.shape, bool)
    for plane in planes:
        with np.errstate(invalid="ignore"):
            mask &= np.isfinite(plane) & (plane >= 0)
    return Table(planes, mask, layout, material, **provenance)  # type: ignore[arg-type]
