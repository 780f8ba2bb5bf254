"""From linear values to a screen, and how different two colours look.

Tables of measured BRDFs name their channels, if at all, R, G, B and not what light they stand for: three channels are
taken as linear sRGB. Any other number is shown as grey, the mean of the channels. Values stay linear until the end.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from .tables import Table

Reals = NDArray[np.float64]

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
"""Y of linear sRGB primaries (IEC 61966-2-1)."""


def channel_names(table: Table) -> tuple[str, ...]:
    """Names of the channels: the table's, or R, G, B, or numbers."""
    if table.channel_names:
        return table.channel_names
    return ("R", "G", "B") if table.channels == 3 else tuple(str(k) for k in range(table.channels))


def luminance(values: Reals) -> Reals:
    """One number for the channels ``[..., C]``: luminance of three, the mean of any other number."""
    if values.shape[-1] == 3:
        return np.asarray(values @ LUMINANCE)
    return np.asarray(values.mean(-1))


def exposure_of(values: Reals) -> float:
    """Factor that takes the geometric mean of the luminance of ``[n, C]`` to 0.18, the middle grey of photographers."""
    y = luminance(values)
    y = y[np.isfinite(y) & (y > 0)]
    return float(0.18 / np.exp(np.log(y).mean())) if len(y) else 1.0


def screen(values: Reals, exposure: float) -> Reals:
    """Linear sRGB in [0, 1], ``[..., 3]``, of values ``[..., C]`` under an exposure; NaN stays NaN."""
    scaled = np.clip(values * exposure, 0, 1)
    if values.shape[-1] == 3:
        return scaled
    return np.repeat(np.clip(values.mean(-1, keepdims=True) * exposure, 0, 1), 3, -1)


@cache
def library() -> Any:
    """The colour library, imported on first use. Importing it sets NumPy's print options, which here stay as they were."""
    with np.printoptions():
        import colour
    return colour


def encode(linear: Reals) -> Reals:
    """sRGB code values of linear ones."""
    return np.asarray(library().cctf_encoding(linear, "sRGB"))


def delta_e(a: Reals, b: Reals) -> Reals:
    """CIEDE2000 colour difference of linear sRGB ``[n, 3]``; NaN where either is."""
    known = np.isfinite(a).all(-1) & np.isfinite(b).all(-1)
    out = np.full(a.shape[0], np.nan)
    if known.any():
        colour = library()
        lab = [colour.XYZ_to_Lab(colour.RGB_to_XYZ(x[known], "sRGB")) for x in (a, b)]
        out[known] = colour.delta_E(lab[0], lab[1], method="CIE 2000")
    return out
