"""Fits whose lobe is a spike between the samples of a table: it costs no error there, and shows in every picture."""

from __future__ import annotations

import jax
import numpy as np

from ..models import BRDF
from ..tables import Table

FAR = 10.0
"""How far above the largest measured value a fit may peak. A lobe as wide as the samples are apart is not cut off by them:
what was measured towards grazing, where BRDFs are larger, exceeds its peak."""


def highest_peak(table: Table) -> float:
    """The largest value, 1/sr, at normal incidence in the mirror direction that a fit to a table can be believed."""
    return FAR * max((float(plane[table.mask].max(initial=0.0)) for plane in table.planes), default=0.0)


def is_spike(model: BRDF, highest: float) -> bool:
    """Whether a model peaks above ``highest``, 1/sr, at normal incidence in the mirror direction."""
    normal = np.array([0.0, 0.0, 1.0])
    with jax.enable_x64(True):
        peak = float(np.max(np.asarray(model(normal, normal))))
    return not peak <= highest


__all__ = ["highest_peak", "is_spike"]
