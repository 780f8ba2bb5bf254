"""A model as the sum of its parts: a body term, lobes of microfacets, and further terms. What it lacks is not there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import Geometry, from_directions
from .base import BRDF
from .diffuse import lambert
from .masking.smith import NDF
from .microfacet import microfacet
from .ndf.stretched import Stretched

Field = Float[Array, "..."]
Term = Callable[[Any, Geometry], Field]
"""A quantity of the parameters of one channel and a geometry."""


def implicit(lobe: Any, g: Geometry) -> Any:
    """V = 1/4, of G = (n.l)(n.v): masking that its divisor cancels (Hoffman 2013, eq. 29)."""
    return 0.25


Switch = Callable[[Any], Field]
"""How much of something there is, of the parameters: 0 none, 1 all of it."""


def mixed(switch: Switch | None, without: Term, with_it: Term) -> Term:
    """The second of two terms; with a switch the mean of both that it asks for."""
    if switch is None:
        return with_it

    def term(m: Any, g: Geometry) -> Field:
        share = switch(m)
        return (1 - share) * without(m, g) + share * with_it(m, g)

    return term


def _lambert(albedo: Field, m: Any, g: Geometry) -> Field:
    return lambert(albedo)


def density(facets: Any, g: Geometry) -> Field:
    """D of the half vector, of an isotropic or a stretched distribution."""
    values: Field = facets.density(g) if isinstance(facets, Stretched) else facets(g.sin2_h, g.cos2_h)
    return values


@dataclass(frozen=True)
class Lobe:
    """Microfacets of one distribution."""

    facets: Callable[[Any], NDF | Stretched]
    """Their distribution, of the parameters."""
    reflectance: Term
    """F of one facet, with its scale."""
    share: Switch | None = None
    """Its share in the surface term; None for all of it."""


@dataclass(frozen=True)
class Parts:
    """What a model is composed of."""

    albedo: Term | None = None
    """Albedo of the body term; None for a model without one."""
    body: Callable[[Field, Any, Geometry], Field] = _lambert
    """The body term, 1/sr, of that albedo, the parameters and the geometry."""
    lobes: tuple[Lobe, ...] = ()
    visibility: Callable[[Any, Geometry], Any] = implicit
    """V = G / (4 n.l n.v) of a distribution."""
    masked: Switch | None = None
    """How much of that stands in place of :func:`implicit`; None for all of it."""
    terms: tuple[Term, ...] = ()
    """Whatever else is added, 1/sr."""

    def evaluate(self, m: Any, g: Geometry) -> Field:
        """Value in 1/sr of the parameters of one channel."""
        values = [] if self.albedo is None else [self.body(self.albedo(m, g), m, g)]
        for lobe in self.lobes:
            facets = lobe.facets(m)
            visibility = self.visibility(facets, g)
            if self.masked is not None:
                visibility = (1 - self.masked(m)) * implicit(facets, g) + self.masked(m) * visibility
            value = microfacet(density(facets, g), lobe.reflectance(m, g), visibility)
            values.append(value if lobe.share is None else lobe.share(m) * value)
        values += [term(m, g) for term in self.terms]
        total = values[0]
        for value in values[1:]:
            total = total + value
        return total


class Composition(BRDF):
    """A model that is the sum of its :class:`Parts`."""

    parts: ClassVar[Parts]
    effects: ClassVar[tuple[str, ...]] = ()
    """The effects of ``brdfit.compose`` that it consists of; none for parts from elsewhere."""

    def normal_reflectance(self) -> Field | None:
        """F0: F of the lobe, with its scale, at normal incidence; None without a lobe."""
        normal = jnp.zeros(3).at[2].set(1)
        return self.parts.lobes[0].reflectance(self, from_directions(normal, normal)) if self.parts.lobes else None

    def evaluate(self, g: Geometry) -> Field:
        """Value in 1/sr."""
        return self.parts.evaluate(self, g)


__all__ = ["Composition", "Lobe", "Parts", "Switch", "Term", "density", "implicit", "mixed"]
