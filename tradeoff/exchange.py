"""A fitted microfacet model with one of its parts exchanged: another masking, another Fresnel term."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, ClassVar

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import Geometry
from ..models import BRDF, blocks
from ..models.abc import ABC
from ..models.fresnel import dielectric, dielectric_f0, schlick
from ..models.gtr import GTR
from ..models.masking.smith import NDF
from ..models.parts import Composition, Parts
from ..models.sgd import SGD

Field = Float[Array, "..."]
Masking = Callable[[NDF, Geometry], Field]
Fresnel = Callable[[Any, Geometry], Field]


@dataclass(frozen=True)
class Own:
    """What a microfacet model has in place of what it may be exchanged for."""

    fresnel: Fresnel
    """With its scale."""
    masking: str
    """Key of :data:`MASKINGS`."""

    @property
    def integral(self) -> bool:
        """Whether its masking is Smith's integral."""
        return MASKINGS[self.masking].integral


def _nothing(lobe: NDF, g: Geometry) -> Field:
    return 1 / (4 * g.cos_i * g.cos_o)


MASKINGS: dict[str, blocks.Masking] = {
    "Smith, height-correlated": blocks.MASKINGS["smith"],
    "Smith, separable": blocks.MASKINGS["smith_separable"],
    "V-cavity": blocks.MASKINGS["vcavity"],
    "none": blocks.Masking(_nothing, "G = 1", ()),
}
"""The masking that a model may have."""

PARTS: dict[type[BRDF], Own] = {
    cls: Own(cls.parts.lobes[0].reflectance, masking)
    for cls, masking in ((GTR, "Smith, height-correlated"), (ABC, "V-cavity"), (SGD, "Smith, separable"))
}


def _dielectric_of_f0(m: GTR, g: Geometry) -> Field:
    """Of the index of refraction that reflects F0 at normal incidence (at most 0.9998 of it: ior 2e4)."""
    root = jnp.sqrt(jnp.clip(m.specular, 1e-12, 0.9998))
    return dielectric((1 + root) / (1 - root), g)


FRESNELS: dict[type[BRDF], dict[str, Fresnel]] = {
    GTR: {"Schlick": PARTS[GTR].fresnel, "exact dielectric": _dielectric_of_f0},
    ABC: {
        "exact dielectric": PARTS[ABC].fresnel,
        "Schlick": lambda m, g: m.specular * schlick(dielectric_f0(m.ior), g),
    },
}
"""The Fresnel terms of a model, its own first: both reflect the same at normal incidence."""


COUNTERPART = {
    "Schlick": "exact dielectric",
    "exact dielectric": "Schlick",
    "V-cavity": "Smith, height-correlated",
    "Smith, height-correlated": "V-cavity",
    "Smith, separable": "V-cavity",
}
"""The form that is set against a model's own."""


@cache
def exchanged(cls: type[Composition], fresnel: Fresnel | None = None, masking: Masking | None = None) -> type[BRDF]:
    """The model class ``cls``, a key of :data:`PARTS`, with the parts given in place of its own."""
    own = cls.parts
    lobes = tuple(replace(lobe, reflectance=fresnel or lobe.reflectance) for lobe in own.lobes)

    class Exchanged(cls):  # type: ignore[valid-type, misc]
        """The same parameters, other parts."""

        parts: ClassVar[Parts] = replace(own, lobes=lobes, visibility=masking or own.visibility)

    return Exchanged


__all__ = ["COUNTERPART", "FRESNELS", "MASKINGS", "PARTS", "Fresnel", "Masking", "exchanged"]
