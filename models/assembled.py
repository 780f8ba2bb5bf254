"""Models made while a program runs: a class of a name, parameters and a formula."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import Field
from functools import cache
from types import new_class
from typing import Any

import equinox as eqx
from jaxtyping import Array, Float

from ..geometry import Geometry
from .base import BRDF, Parameter

Evaluate = Callable[[Any, Geometry], Float[Array, "..."]]
"""Value in 1/sr for one channel, of the parameters as attributes and a geometry: ``evaluate(parameters, geometry)``."""


def assemble(
    name: str,
    parameters: Mapping[str, Field[Any] | Parameter],
    evaluate: Evaluate,
    *,
    doc: str = "",
    references: tuple[str, ...] = (),
    anisotropic: bool = False,
    base: type[BRDF] = BRDF,
    **attributes: Any,
) -> type[BRDF]:
    """The model class ``name``, with ``parameters`` as :func:`brdfit.parameter` declares them and the formula ``evaluate``.

    Equal requests give the same class, so that compiled programs are found again; for that the ``attributes``, which
    become attributes of the class, must be hashable.
    """
    specs = tuple((n, p.metadata["parameter"] if isinstance(p, Field) else p) for n, p in parameters.items())
    extra = tuple(sorted(attributes.items()))
    return _assembled(name, specs, evaluate, doc, references, anisotropic, base, extra)


@cache
def _assembled(
    name: str,
    specs: tuple[tuple[str, Parameter], ...],
    evaluate: Evaluate,
    doc: str,
    references: tuple[str, ...],
    anisotropic: bool,
    base: type[BRDF],
    extra: tuple[tuple[str, Any], ...],
) -> type[BRDF]:
    def body(namespace: dict[str, Any]) -> None:
        namespace |= {n: eqx.field(metadata={"parameter": spec}) for n, spec in specs}
        namespace |= {"__module__": __name__, "__doc__": doc, "__annotations__": {n: Array for n, _ in specs}}
        namespace |= {"name": name, "references": references, "anisotropic": anisotropic, "evaluate": evaluate}
        namespace |= dict(extra)

    return new_class(name, (base,), {}, body)


def __getattr__(name: str) -> type[BRDF]:
    """The class of a name that :func:`brdfit.models.variants` knows: what lets its instances be pickled."""
    if not name.startswith("__"):  # what the import system asks for, before there are models
        from . import variants

        with suppress(ValueError):
            found = variants(name)[0]
            if found.__module__ == __name__:
                return found
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


__all__ = ["Evaluate", "assemble"]
