"""The published fit of a material, judged on the cells and under the losses of the new one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ..tables import Table
from .evidence import Published

if TYPE_CHECKING:
    from ..fitting.result import Fit

REFERENCE = {"abc": "low2012", "low": "low2012", "sgd": "bagher2012", "ngan": "ngan2005"}
"""Whose fits they are, by how the name of their form begins."""


def published(table: Table, fits: Sequence[Fit]) -> list[Published | None]:
    """For each fit that of the same model in the literature, None where the table's material has none."""
    from ..data import forms, preset, published_materials, source
    from ..data.presets import STARTS
    from ..fitting import evaluate

    known = [f for f in forms() if table.channels == 3 and table.material in published_materials(f)]
    errors: dict[tuple[str, str, float], dict[str, float]] = {}
    out: list[Published | None] = []
    for fit in fits:
        form = STARTS.get(fit.model_name)
        if form not in known or fit.model is None:
            out.append(None)
            continue
        measure = "cells" if fit.measure == "cells" else "solid_angle"  # that of a scene is in the table's weights
        key = form, measure, fit.max_angle
        if key not in errors:
            errors[key] = evaluate(table, preset(form, table.material), measure=measure, max_angle=fit.max_angle)
        out.append(Published(source(form), REFERENCE[form.split("_")[0]], errors[key]))
    return out


__all__ = ["published"]
