"""Every model with its parameters, every effect and every loss, as data and as text."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Any

from .fitting.losses import LOSSES
from .models import BRDF, EFFECTS, MODELS, parameters_of, variants
from .references import REFERENCES


def catalogue(names: Sequence[str] = ()) -> dict[str, Any]:
    """Models, all or those named, effects and losses as JSON values; an end of a range that is infinite is null.

    Raises ValueError for an unknown name.
    """
    return {
        "models": [
            {
                "name": name,
                "anisotropic": cls.anisotropic,
                "description": " ".join((cls.__doc__ or "").split()),
                "references": [REFERENCES[key] for key in cls.references],
                "parameters": [
                    {
                        "name": p.name,
                        "meaning": p.meaning,
                        "unit": p.unit,
                        "per_channel": p.per_channel,
                        "range": [_end(p.valid.lower), _end(p.valid.upper)],
                        "search": [_end(p.search[0]), _end(p.search[1])],
                        "default": p.default,
                    }
                    for p in parameters_of(cls)
                ],
            }
            for name, cls in _models(names)
        ],
        "effects": [
            {
                "name": e.name,
                "meaning": e.meaning,
                "formula": e.formula,
                "needs": list(e.needs),
                "references": [REFERENCES[key] for key in e.references],
            }
            for e in EFFECTS.values()
        ],
        "losses": [{"name": loss.name, "source": REFERENCES.get(loss.source, loss.source)} for loss in LOSSES.values()],
    }


def text(names: Sequence[str] = ()) -> str:
    """The catalogue for a terminal: all of it, or the models named. Raises ValueError for an unknown name."""
    lines = []
    for name, cls in _models(names):
        lines += [f"{name}{' (anisotropic)' if cls.anisotropic else ''}", *_wrapped(cls.__doc__ or "")]
        for p in parameters_of(cls):
            shape = "per channel" if p.per_channel else "shared"
            searched = f"searched [{p.search[0]:g}, {p.search[1]:g}]"
            lines.append(f"    {p.name:12s} {p.meaning}; unit {p.unit}, {shape}, range {p.valid}, {searched}")
        lines += [f"    {REFERENCES[key]}" for key in cls.references] + [""]
    if names:
        return "\n".join(lines[:-1])
    lines += ["effects, to be joined by +"]
    for effect in EFFECTS.values():
        needs = f"; needs {', '.join(effect.needs)}" if effect.needs else ""
        lines += [f"    {effect.name:15s} {effect.meaning}{needs}"]
    lines += ["", "losses", *(f"    {loss.name:12s} {REFERENCES.get(loss.source, '')}" for loss in LOSSES.values())]
    return "\n".join(lines)


def _models(names: Sequence[str]) -> list[tuple[str, type[BRDF]]]:
    """Names with a class each: anisotropic forms have the name of the isotropic one."""
    return [(name, cls) for name in names or MODELS for cls in variants(name)]


def prose(doc: str) -> str:
    """A docstring as running text, without the marks of code and cross-references."""
    return re.sub(r":\w+:`[~.]*([^`]*)`|`+([^`]*)`+", r"\1\2", " ".join(doc.split()))


def _wrapped(doc: str) -> list[str]:
    import textwrap

    return textwrap.wrap(prose(doc), 110, initial_indent="    ", subsequent_indent="    ")


def _end(x: float) -> float | None:
    return x if math.isfinite(x) else None


__all__ = ["catalogue", "prose", "text"]
