"""Effects of reflection, one file each, and the models that any set of them makes."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from operator import attrgetter

from ..assembled import assemble
from ..base import Interval, Parameter
from ..parts import Composition, Parts
from .anisotropy import ANISOTROPY
from .body import BODY
from .diffraction import DIFFRACTION
from .dispersion import DISPERSION
from .effect import Effect, Shapes
from .fresnel import FRESNEL
from .interreflection import INTERREFLECTION
from .lobe import LOBE
from .masking import MASKING
from .retro import RETRO
from .rough_body import ROUGH_BODY
from .second_lobe import SECOND_LOBE
from .tail import TAIL
from .trade_off import TRADE_OFF

_ORDER = (
    *(BODY, ROUGH_BODY, LOBE, TAIL, SECOND_LOBE, ANISOTROPY, DISPERSION, DIFFRACTION),
    *(FRESNEL, MASKING, INTERREFLECTION, TRADE_OFF, RETRO),
)

EFFECTS: dict[str, Effect] = {e.name: e for e in _ORDER}
"""Every effect by name, in the order in which they are put together and named."""


def compose(*effects: str) -> type[Composition]:
    """The model class that consists of the given effects, names of :data:`EFFECTS` in any order.

    Its name is theirs, joined by ``+`` in the order of :data:`EFFECTS`, and goes wherever a model's name goes. What is not
    asked for is absent from its program. Equal sets give the same class.

    Raises ValueError for a name that is unknown or given twice, and for an effect without the one that it needs.
    """
    return _composed(in_order(effects))


def in_order(effects: Iterable[str]) -> tuple[str, ...]:
    """Names of effects in the order of :data:`EFFECTS`, checked as :func:`compose` says."""
    given = tuple(effects)
    for name in given:
        if name not in EFFECTS:
            raise ValueError(f"unknown effect {name!r}: choose from {', '.join(EFFECTS)}")
        if given.count(name) > 1:
            raise ValueError(f"effect {name!r} is asked for twice")
        for need in EFFECTS[name].needs:
            if not set(need.split(" or ")) & set(given):
                raise ValueError(f"effect {name!r} needs {need}, which is not among {', '.join(given)}")
    if not given:
        raise ValueError(f"a model needs an effect: choose from {', '.join(EFFECTS)}")
    return tuple(name for name in EFFECTS if name in given)


def parts_of(*effects: str) -> Parts:
    """What a model of the given effects is composed of; raises as :func:`compose`."""
    return _put_together(in_order(effects), ())


def _put_together(names: tuple[str, ...], switched: tuple[str, ...]) -> Parts:
    switches = {name: attrgetter(SWITCH + name) if name in switched else None for name in names}
    parts = Parts()
    for name in names:
        parts = EFFECTS[name].add(parts, switches)
    return parts


SWITCH = "with_"
"""What a switch of :func:`switchable` is called: this and the name of the effect."""
SWITCHED = ("lobe", "fresnel", "masking", "interreflection", "trade_off")
"""Effects that have one: those that some model without them is no special case of (see :class:`Effect`)."""


def switchable(*effects: str) -> type[Composition]:
    """A model of the given effects in which those of :data:`SWITCHED` have a switch, a parameter that is 0 or 1: with them
    at 0, and the parameters of other effects at their neutral values, it is the model of any subset.

    It is for comparing many subsets in one program. Raises as :func:`compose`.
    """
    return _composed(in_order(effects), tuple(name for name in SWITCHED if name in effects))


STARTS = 60
"""Shapes that a fit starts from, at most: a search takes a fraction of a second for each."""


def _shapes(cls: type[Composition], half_width: float) -> Shapes:
    shapes: Shapes = [{}]
    for name in cls.effects:
        shapes = EFFECTS[name].start(half_width, shapes)
    return shapes[:: -(-len(shapes) // STARTS)]


_SHAPES = classmethod(_shapes)


@cache
def _composed(names: tuple[str, ...], switched: tuple[str, ...] = ()) -> type[Composition]:
    parameters: dict[str, Parameter] = {}
    for name in names:
        declared = {n: f.metadata["parameter"] for n, f in EFFECTS[name].parameters.items()}
        parameters = EFFECTS[name].declare(parameters | declared)
    for name in switched:
        parameters[SWITCH + name] = Parameter("", f"1 with {name}, 0 without", "1", Interval(0, 1), (0, 1), 1.0)
    cls = assemble(
        f"switchable({'+'.join(names)})" if switched else "+".join(names),
        parameters,
        Composition.evaluate,
        doc="; ".join(EFFECTS[name].meaning for name in names) + ".",
        references=tuple(dict.fromkeys(key for name in names for key in EFFECTS[name].references)),
        anisotropic="anisotropy" in names,
        base=Composition,
        parts=_put_together(names, switched),
        effects=names,
        shapes=_SHAPES,
    )
    assert issubclass(cls, Composition)
    return cls


__all__ = ["EFFECTS", "SWITCH", "SWITCHED", "Effect", "compose", "in_order", "parts_of", "switchable"]
