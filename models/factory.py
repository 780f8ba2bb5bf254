"""Microfacet models put together of named blocks."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from itertools import product
from typing import Any

from jaxtyping import Array, Float

from ..geometry import Geometry
from .assembled import assemble
from .blocks import BODIES, FRESNELS, MASKINGS, NDFS, Shape
from .diffuse import lambert
from .masking.smith import NDF
from .parts import Composition, Lobe, Parts

Value = Float[Array, "..."]

_NAME = re.compile(r"microfacet\((\w+),(\w+),(\w+),(\w+)\)")


def microfacet(
    ndf: str = "ggx", masking: str = "smith", fresnel: str = "schlick", body: str = "lambert"
) -> type[Composition]:
    """The model class f = body + F D G/(4 n.l n.v) of the given blocks.

    It fits, saves and reports like any other model, by the class or by its name, ``microfacet(ndf,masking,fresnel,body)``.
    Equal requests give the same class.

    Args:
        ndf: Distribution D, a name of ``brdfit.models.blocks.NDFS``.
        masking: G, a name of ``MASKINGS`` there; "smith" is height-correlated and D's own.
        fresnel: F, a name of ``FRESNELS`` there.
        body: "lambert", diffuse/pi; "transmitted", (1 - F) diffuse/pi; or "none".

    Raises:
        ValueError: A name that is unknown, or masking that is a function of a width ``alpha`` for a distribution without.
    """
    return named(f"microfacet({ndf},{masking},{fresnel},{body})", (ndf, masking, fresnel, body))


def by_name(name: str) -> type[Composition]:
    """The class that :func:`microfacet` gives the name. Raises ValueError if it is no such name, and as that does."""
    match = _NAME.fullmatch(name)
    if not match:
        raise ValueError(
            f"{name!r} is no microfacet model: name all four parts, microfacet(ndf,masking,fresnel,body), as in "
            "microfacet(ggx,smith,schlick,lambert)"
        )
    return microfacet(*match.groups())


def named(
    name: str, blocks: tuple[str, str, str, str], doc: str = "", references: tuple[str, ...] = ()
) -> type[Composition]:
    """As :func:`microfacet`, under a name and with a description of its own."""
    d_name, m_name, f_name, b_name = blocks
    for kind, given, known in (
        ("ndf", d_name, NDFS),
        ("masking", m_name, MASKINGS),
        ("fresnel", f_name, FRESNELS),
        ("body", b_name, BODIES),
    ):
        if given not in known:
            raise ValueError(f"unknown {kind} {given!r}: choose from {', '.join(known)}")
    distribution, masking, fresnel = NDFS[d_name], MASKINGS[m_name], FRESNELS[f_name]
    before, body_parameters = BODIES[b_name]
    if masking.needs_alpha and "alpha" not in distribution.parameters:
        raise ValueError(f"masking {m_name!r} needs a distribution with a width alpha, and {d_name!r} has none")
    formula = f"f = {before}F D G/(4 n.l n.v); {distribution.formula}; {masking.formula}; {fresnel.formula}."
    sources = (*references, *distribution.references, *masking.references, *fresnel.references)
    cls = assemble(
        name,
        {**body_parameters, **fresnel.parameters, **distribution.parameters},
        Composition.evaluate,
        doc=doc or formula,
        references=tuple(dict.fromkeys(sources)),
        base=Composition,
        parts=_parts(blocks),
        blocks=blocks,
        shapes=_SHAPES,
    )
    assert issubclass(cls, Composition)
    return cls


@cache
def _parts(blocks: tuple[str, str, str, str]) -> Parts:
    """One object for equal blocks, so that equal requests give the same class."""
    d_name, m_name, f_name, b_name = blocks
    distribution, fresnel = NDFS[d_name], FRESNELS[f_name]

    def facets(m: Any) -> NDF:
        return distribution.make(*(getattr(m, n) for n in distribution.parameters))

    def reflectance(m: Any, g: Geometry) -> Value:
        return fresnel.value(g, *(getattr(m, n) for n in fresnel.parameters))

    def albedo(m: Any, g: Geometry) -> Value:
        value: Value = m.diffuse
        return value

    def transmitted(albedo: Value, m: Any, g: Geometry) -> Value:
        return (1 - reflectance(m, g)) * lambert(albedo)

    bodies = {
        "lambert": Parts(albedo=albedo),
        "transmitted": Parts(albedo=albedo, body=transmitted),
        "none": Parts(),
    }
    return replace(bodies[b_name], lobes=(Lobe(facets, reflectance),), visibility=MASKINGS[m_name].visibility)


def _shapes(cls: Any, half_width: float) -> list[Shape]:
    d_name, _, f_name, _ = cls.blocks
    return [a | b for a, b in product(NDFS[d_name].shapes(half_width), FRESNELS[f_name].shapes())]


_SHAPES = classmethod(_shapes)

__all__ = ["by_name", "microfacet", "named"]
