"""A fitted microfacet model with one of its parts exchanged: another masking, another Fresnel term."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import Geometry
from ..models import BRDF, ndf
from ..models.abc import ABC
from ..models.diffuse import lambert
from ..models.fresnel import dielectric, dielectric_f0, schlick, sgd_fresnel
from ..models.gtr import GTR
from ..models.masking import smith_correlated, smith_separable, vcavity
from ..models.masking.smith import NDF
from ..models.microfacet import microfacet
from ..models.sgd import SGD

Field = Float[Array, "..."]
Masking = Callable[[NDF, Geometry], Field]
Fresnel = Callable[[Any, Geometry], Field]


@dataclass(frozen=True)
class Parts:
    """What a microfacet model with Lambert's body is composed of."""

    lobe: Callable[[Any], NDF]
    fresnel: Fresnel
    """With its scale."""
    masking: str
    """Key of :data:`MASKINGS`."""


def _vcavity(lobe: NDF, g: Geometry) -> Field:
    return vcavity(g)


def _nothing(lobe: NDF, g: Geometry) -> Field:
    return 1 / (4 * g.cos_i * g.cos_o)


MASKINGS: dict[str, Masking] = {
    "Smith, height-correlated": smith_correlated,
    "Smith, separable": smith_separable,
    "V-cavity": _vcavity,
    "none": _nothing,
}
"""V = G / (4 n.l n.v) of a lobe."""

PARTS: dict[type[BRDF], Parts] = {
    GTR: Parts(lambda m: ndf.GTR(m.alpha, m.gamma), lambda m, g: schlick(m.specular, g), "Smith, height-correlated"),
    ABC: Parts(lambda m: ndf.ABC(m.b, m.c), lambda m, g: m.specular * dielectric(m.ior, g), "V-cavity"),
    SGD: Parts(lambda m: ndf.SGD(m.alpha, m.p), lambda m, g: m.specular * sgd_fresnel(m.f0, m.f1, g), "Smith, separable"),
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
def exchanged(cls: type[BRDF], fresnel: Fresnel | None = None, masking: Masking | None = None) -> type[BRDF]:
    """The model class ``cls``, a key of :data:`PARTS`, with the parts given in place of its own."""
    parts = PARTS[cls]
    reflect, mask = fresnel or parts.fresnel, masking or MASKINGS[parts.masking]

    class Exchanged(cls):  # type: ignore[valid-type, misc]
        """The same parameters, other parts."""

        def evaluate(self, g: Geometry) -> Field:
            lobe = parts.lobe(self)
            return lambert(self.diffuse) + microfacet(lobe(g.sin2_h, g.cos2_h), reflect(self, g), mask(lobe, g))

    return Exchanged


__all__ = ["COUNTERPART", "FRESNELS", "MASKINGS", "PARTS", "Fresnel", "Masking", "exchanged"]
