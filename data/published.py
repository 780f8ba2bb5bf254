"""The published fits to the MERL materials, as numbers.

``published.json`` holds, for each form of model that was fitted, its source, its formula and one row of parameters a
material, exactly as printed. Nothing is converted here: :mod:`.presets` makes models of them. ``kd`` and ``albedo``
of the ``ngan_*`` forms lack the channel factors of the tables: times :data:`NGAN_SCALE` they hold for values in 1/sr.
"""

from __future__ import annotations

import json
from difflib import get_close_matches
from functools import lru_cache
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError

NGAN_SCALE = (1.0, 1.15, 1.66)
"""Factor per channel on ``kd`` and ``albedo`` of the ``ngan_*`` forms."""


@lru_cache(maxsize=1)
def _forms() -> dict[str, dict[str, Any]]:
    loaded: dict[str, dict[str, Any]] = json.loads((files(__package__) / "published.json").read_text("utf-8"))
    return loaded


def _form(form: str) -> dict[str, Any]:
    try:
        return _forms()[form]
    except KeyError:
        raise InputError(f"unknown published form {form!r}: choose from {', '.join(_forms())}") from None


def forms() -> tuple[str, ...]:
    """Names of the forms that were fitted."""
    return tuple(_forms())


def source(form: str) -> str:
    """Where the numbers of a form were published. Raises InputError for an unknown form."""
    return str(_form(form)["source"])


def formula(form: str) -> str:
    """The exact form that was fitted, in 1/sr. Raises InputError for an unknown form."""
    return str(_form(form)["form"])


def published_materials(form: str) -> tuple[str, ...]:
    """Names of the materials a form was fitted to, sorted. Raises InputError for an unknown form."""
    return tuple(_form(form)["materials"])


def raw(form: str, material: str) -> dict[str, NDArray[np.float64]]:
    """The numbers as printed, by the names of the form: shape ``[3]`` (R, G, B) or ``[]``.

    Raises InputError for an unknown form, and for a material that it was not fitted to, naming close ones.
    """
    known = _form(form)
    try:
        row = known["materials"][material]
    except KeyError:
        close = get_close_matches(material, known["materials"])
        hint = f"did you mean {', '.join(close)}?" if close else f"there are {len(known['materials'])}"
        raise InputError(f"no published {form!r} fit of {material!r}: {hint}") from None
    return {name: np.asarray(value, float) for name, value in zip(known["parameters"], row, strict=True)}


__all__ = ["NGAN_SCALE", "forms", "formula", "published_materials", "raw", "source"]
