"""Synthetic materials by name.

gtr-00 .. gtr-19                 drawn from the ranges of published fits; likewise abc, sgd, ward, ashikhmin_shirley
ward-aniso-00 ..                 anisotropic, likewise ashikhmin_shirley-aniso
abc-nickel, sgd-nickel ..        the published fits of the 100 MERL materials, in the models of this package
published_sgd-nickel ..          those of SGD in their exact form, whose masking is not that of ``sgd``
misfit-two-lobes, misfit-retro, misfit-coated
                                 what none of the five models can reproduce
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from difflib import get_close_matches
from functools import lru_cache, partial
from typing import Any

import equinox as eqx
import numpy as np

from ...errors import InputError
from ...models import build, model, variants
from ...models.base import BRDF, parameters_of
from ..presets import published_abc, published_sgd, published_sgd_smith
from ..published import published_materials
from ..published_sgd import PublishedSGD
from .draws import ANISOTROPIC_RANGES, RANGES, draw
from .misfits import Coated, Retro, TwoLobes

DRAWS = 20
"""Number of materials drawn for each model."""

DEFAULT_NAMES = (
    "gtr-00",
    "abc-nickel",
    "sgd-blue-metallic-paint",
    "ward-00",
    "ashikhmin_shirley-00",
    "misfit-two-lobes",
    "misfit-retro",
    "misfit-coated",
)
"""A few of each sort."""

FORMULAS: dict[str, type[BRDF]] = {c.name: c for c in (PublishedSGD, TwoLobes, Retro, Coated)}
"""Formulas that are no models to fit with, by name."""


@dataclass(frozen=True)
class Material:
    """A named material: one line on what it is, and its BRDF for a number of channels."""

    name: str
    description: str
    anisotropic: bool
    brdf: Callable[[int], BRDF]


def names() -> tuple[str, ...]:
    """Every name, in the order of this module's table."""
    return tuple(_registry())


def material(name: str) -> Material:
    """The material of a name. Raises InputError, naming close ones, if there is none."""
    try:
        return _registry()[name]
    except KeyError:
        close = get_close_matches(name, _registry(), n=4)
        hint = f"did you mean {', '.join(close)}?" if close else f"choose from names like {', '.join(DEFAULT_NAMES)}"
        raise InputError(f"no synthetic material {name!r}: {hint}") from None


def from_truth(truth: dict[str, object]) -> BRDF:
    """The BRDF that a truth (see :func:`generate`) says a table was made from, with numpy float64 parameters.

    Raises ValueError if the truth names no known formula or its parameters are out of range.
    """
    name, parameters = str(truth["model"]), truth["parameters"]
    if name in FORMULAS:
        return build(FORMULAS[name], parameters)  # type: ignore[arg-type]
    return model(name, **parameters)  # type: ignore[arg-type]


@lru_cache(maxsize=1)
def _registry() -> dict[str, Material]:
    return {m.name: m for m in (*_drawn(), *_published(), *_misfits())}


def _drawn() -> list[Material]:
    found = []
    for prefix, anisotropic, ranges in (("", False, RANGES), ("-aniso", True, ANISOTROPIC_RANGES)):
        for form, box in ranges.items():
            cls = next(c for c in variants(form) if c.anisotropic == anisotropic)
            what = f"{'anisotropic ' * anisotropic}{form}, drawn from the ranges of published fits"
            for k in range(DRAWS):
                name = f"{form}{prefix}-{k:02d}"
                found.append(Material(name, what, anisotropic, partial(draw, cls, box, name)))
    return found


def _published() -> list[Material]:
    makers: tuple[tuple[str, str, Callable[[str], BRDF], str], ...] = (
        ("abc", "abc", published_abc, "Low et al. 2012"),
        ("sgd", "sgd", published_sgd_smith, "Bagher et al. 2012, with exact Smith masking"),
        ("published_sgd", "sgd", published_sgd, "Bagher et al. 2012, in its exact form"),
    )
    return [
        Material(f"{prefix}-{of}", f"published fit of {of}, {source}", False, partial(_first_channels, make, of))
        for prefix, form, make, source in makers
        for of in published_materials(form)
    ]


def _misfits() -> list[Material]:
    two_lobes = {
        "diffuse": [0.18, 0.11, 0.07],
        "sigma": 0.6,
        "specular": [0.07, 0.06, 0.05],
        "alpha": 0.03,
        "haze": [0.35, 0.45, 0.55],
        "alpha_haze": 0.28,
    }
    retro = {
        "diffuse": [0.12, 0.13, 0.16],
        "specular": [0.05, 0.05, 0.05],
        "alpha": 0.35,
        "retro": [0.02, 0.025, 0.03],
        "width": 0.18,
    }
    coated = {
        "diffuse": [0.02, 0.05, 0.09],
        "specular": [0.22, 0.35, 0.5],
        "alpha": [0.3, 0.24, 0.18],
        "ior": [1.48, 1.52, 1.58],
        "coat_alpha": 0.02,
    }
    return [
        Material(f"misfit-{name}", what, False, partial(_first_channels, partial(build, cls), values))
        for name, cls, values, what in (
            ("two-lobes", TwoLobes, two_lobes, "a narrow and a wide lobe over a rough body"),
            ("retro", Retro, retro, "a lobe, and a return towards the light"),
            ("coated", Coated, coated, "a dispersive varnish on a metallic paint"),
        )
    ]


def _first_channels(make: Callable[[Any], BRDF], of: object, channels: int) -> BRDF:
    """The first channels of a material that has three. Raises InputError if more are asked for."""
    if channels > 3:
        raise InputError(f"published and misfit materials have 3 channels, {channels} were asked for; drawn ones have any")
    whole = make(of)
    each = [p.name for p in parameters_of(whole) if p.per_channel]
    first = [np.asarray(getattr(whole, n))[:channels] for n in each]
    fewer: BRDF = eqx.tree_at(lambda m: [getattr(m, n) for n in each], whole, first)
    return fewer


__all__ = ["DEFAULT_NAMES", "FORMULAS", "Material", "from_truth", "material", "names"]
