"""A table of one's own measurements: samples at any directions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .layout import Scattered
from .table import Table, table

UNIT = 1e-3
"""How far from 1 the length of a unit vector may be: files hold them with a few digits."""


def measurements(
    wi: ArrayLike,
    wo: ArrayLike,
    values: ArrayLike,
    *,
    measure: ArrayLike | None = None,
    isotropic: bool = True,
    material: str = "measurements",
    channel_names: Sequence[str] = (),
) -> Table:
    """A table of samples at directions of their own, as a goniometer gives them.

    Args:
        wi: Unit vectors to the light ``[n, 3]``; z is the normal, x the tangent. :func:`brdfit.angles.unit_vectors` makes
            them from angles. A vector whose length is within 1e-3 of 1 is scaled to 1.
        wo: Unit vectors to the viewer ``[n, 3]``.
        values: BRDF in 1/sr, ``[n]`` or ``[n, C]``. What is negative or not finite counts as not measured.
        measure: Solid angle of light times that of viewer which a sample stands for, sr^2, ``[n]``; by default the same
            for all. Of a scan in equal steps of all angles it is proportional to sin(theta_i) sin(theta_o).
        isotropic: Whether only the difference of the azimuths matters. False fits anisotropic forms of models.
        material: Name for reports.
        channel_names: One for each channel.

    Raises ValueError if shapes do not agree, a vector is no unit vector, or a measure is negative or not finite.
    """
    values = np.asarray(values, float)
    planes = values[None] if values.ndim == 1 else values.T
    if values.ndim not in (1, 2) or values.size == 0:
        raise ValueError(f"{material}: values must have shape [n] or [n, C], not {values.shape}")
    count = planes.shape[1]
    share = np.ones(count) if measure is None else np.asarray(measure, float)
    if channel_names and len(channel_names) != len(planes):
        raise ValueError(f"{material}: {len(channel_names)} channel names for {len(planes)} channels")
    to_light, to_viewer = _unit_vectors(f"{material}: wi", wi, count), _unit_vectors(f"{material}: wo", wo, count)
    layout = Scattered(to_light, to_viewer, share, isotropic)
    return table(np.ascontiguousarray(planes), layout, material, channel_names=tuple(channel_names))


def _unit_vectors(name: str, vectors: ArrayLike, count: int) -> NDArray[np.float64]:
    w = np.asarray(vectors, float)
    if w.shape != (count, 3):
        raise ValueError(f"{name} must have shape ({count}, 3), as there are {count} values, not {w.shape}")
    length = np.linalg.norm(w, axis=-1)
    off = np.flatnonzero(~(np.abs(length - 1) <= UNIT))
    if len(off):
        raise ValueError(f"{name} must be unit vectors: number {off[0]} is {w[off[0]]}, of length {length[off[0]]:g}")
    unit: NDArray[np.float64] = w / length[:, None]
    return unit


__all__ = ["measurements"]
