"""Reflectance models by name. One file a model; the blocks they share are in ndf/, masking/, fresnel/ and diffuse/."""

from __future__ import annotations

from difflib import get_close_matches

import numpy as np
from jaxtyping import ArrayLike

from .abc import ABC
from .abc_smooth import ABCSmooth
from .ashikhmin_shirley import AshikhminShirley, AshikhminShirleyAnisotropic
from .base import BRDF, Interval, Parameter, channels, evaluate_channels, parameter, parameters_of
from .beckmann import Beckmann
from .blinn_phong import BlinnPhong
from .cook_torrance import CookTorrance, CookTorranceBlinn, CookTorranceGaussian
from .disney import Disney, DisneyAnisotropic
from .distribution_based import DistributionBased
from .effects import EFFECTS, compose, switchable
from .epd import EPD
from .factory import by_name
from .ggx import GGX
from .granier_heidrich import GranierHeidrich
from .gtr import GTR
from .htsg import HTSG
from .lafortune import Lafortune, Lafortune2, Lafortune3
from .lambert import Lambert
from .low_microfacet import LowMicrofacet
from .max_phong import MaxPhong
from .modified_blinn_phong import ModifiedBlinnPhong
from .modified_phong import ModifiedPhong
from .oren_nayar import OrenNayar, OrenNayarFull
from .pbr import PBR
from .phong import Phong
from .poulin_fournier import PoulinFournier
from .schlick import Schlick, SchlickTwoLayers
from .schwenk import Schwenk
from .sgd import SGD
from .stam_diffraction import StamDiffraction
from .strauss import Strauss
from .student_t import StudentT
from .ward import Ward, WardAnisotropic
from .ward_bounded import WardBounded, WardBoundedAnisotropic
from .ward_duer import WardDuer, WardDuerAnisotropic

MODELS: dict[str, tuple[type[BRDF], ...]] = {
    "gtr": (GTR,),
    "abc": (ABC,),
    "sgd": (SGD,),
    "ward": (Ward, WardAnisotropic),
    "ashikhmin_shirley": (AshikhminShirley, AshikhminShirleyAnisotropic),
    "lambert": (Lambert,),
    "ggx": (GGX,),
    "beckmann": (Beckmann,),
    "pbr": (PBR,),
    "cook_torrance": (CookTorrance,),
    "cook_torrance_blinn": (CookTorranceBlinn,),
    "cook_torrance_gaussian": (CookTorranceGaussian,),
    "epd": (EPD,),
    "student_t": (StudentT,),
    "low_microfacet": (LowMicrofacet,),
    "abc_smooth": (ABCSmooth,),
    "ward_duer": (WardDuer, WardDuerAnisotropic),
    "ward_bounded": (WardBounded, WardBoundedAnisotropic),
    "disney": (Disney, DisneyAnisotropic),
    "phong": (Phong,),
    "blinn_phong": (BlinnPhong,),
    "modified_phong": (ModifiedPhong,),
    "modified_blinn_phong": (ModifiedBlinnPhong,),
    "max_phong": (MaxPhong,),
    "oren_nayar": (OrenNayar,),
    "oren_nayar_full": (OrenNayarFull,),
    "lafortune": (Lafortune,),
    "lafortune2": (Lafortune2,),
    "lafortune3": (Lafortune3,),
    "schlick": (Schlick,),
    "schlick_two_layers": (SchlickTwoLayers,),
    "strauss": (Strauss,),
    "schwenk": (Schwenk,),
    "distribution_based": (DistributionBased,),
    "granier_heidrich": (GranierHeidrich,),
    "htsg": (HTSG,),
    "stam_diffraction": (StamDiffraction,),
    "poulin_fournier": (PoulinFournier,),
}
"""Every named model: its isotropic form first, then the anisotropic one where there is one. One has no isotropic form."""


def variants(name: str) -> tuple[type[BRDF], ...]:
    """The classes that go by a name: of :data:`MODELS`, effects joined by ``+`` (see :func:`compose`), with switches or
    without (see :func:`.effects.switchable`), or blocks of a microfacet model (see :func:`brdfit.microfacet`). Spaces and
    capitals do not count.

    Raises ValueError for any other name, and for effects that do not go together.
    """
    given, name = name, "".join(name.split()).lower()
    if name in MODELS:
        return MODELS[name]
    if name.startswith("switchable("):
        return (switchable(*name.removeprefix("switchable(").removesuffix(")").split("+")),)
    if "+" in name or name in EFFECTS:
        return (compose(*name.split("+")),)
    if name.startswith("microfacet("):
        return (by_name(name),)
    if close := get_close_matches(name, [*MODELS, *EFFECTS]):
        raise ValueError(f"unknown model {given!r}: did you mean {' or '.join(close)}?")
    raise ValueError(f"unknown model {given!r}: choose from {', '.join(MODELS)}, or join effects by +: {', '.join(EFFECTS)}")


def model(name: str, **parameters: ArrayLike) -> BRDF:
    """A model with given parameters.

    ``name`` is a key of :data:`MODELS` or effects joined by ``+``; parameters are scalars or sequences of one value per
    channel, and scalars broadcast over channels (three if no parameter says otherwise). Models that have an anisotropic
    form take either set.

    Raises ValueError for an unknown name and for parameters unknown, missing, or outside the range of the formula.
    """
    candidates = variants(name)
    for candidate in candidates:
        if {p.name for p in parameters_of(candidate)} == set(parameters):
            return build(candidate, parameters)
    wanted = " or ".join(", ".join(p.name for p in parameters_of(c)) for c in candidates)
    known = {p.name for c in candidates for p in parameters_of(c)}
    unknown = sorted(set(parameters) - known)
    if unknown:
        raise ValueError(f"model {name!r} has no parameter {unknown[0]!r}: it takes {wanted}")
    closest = max(candidates, key=lambda c: len({p.name for p in parameters_of(c)} & set(parameters)))
    missing = [p.name for p in parameters_of(closest) if p.name not in parameters]
    if missing:
        raise ValueError(f"model {name!r} misses parameter {missing[0]!r}: it takes {wanted}")
    raise ValueError(f"model {name!r} takes {wanted}, not {', '.join(parameters)} together")


def build(cls: type[BRDF], parameters: dict[str, ArrayLike]) -> BRDF:
    """An instance of ``cls`` with validated parameters as float64 numpy arrays, per-channel ones of one length C.

    Raises ValueError naming the parameter, its range and the value.
    """
    specs = parameters_of(cls)
    values = {p.name: np.asarray(parameters[p.name], dtype=np.float64) for p in specs}
    lengths = {values[p.name].shape[0] for p in specs if p.per_channel and values[p.name].ndim == 1}
    lengths = lengths - {1} or lengths or {3}
    if len(lengths) > 1:
        raise ValueError(f"model {cls.name!r}: parameters disagree on the number of channels, {sorted(lengths)}")
    count = lengths.pop()
    for p in specs:
        v = values[p.name]
        if v.ndim > (1 if p.per_channel else 0):
            kind = "a scalar or one value per channel" if p.per_channel else "a scalar"
            raise ValueError(f"model {cls.name!r}: parameter {p.name!r} is {kind}, not of shape {list(v.shape)}")
        for x in v.ravel():
            if x not in p.valid:
                raise ValueError(f"model {cls.name!r}: parameter {p.name!r} must lie in {p.valid}, not {x:g}")
        if p.per_channel:
            values[p.name] = np.broadcast_to(v, (count,)).copy()
    return cls(**values)


def parameter_values(m: BRDF) -> dict[str, np.ndarray]:
    """The parameters of an instance as numpy arrays, by name."""
    return {p.name: np.asarray(getattr(m, p.name)) for p in parameters_of(m)}


__all__ = [
    "BRDF",
    "EFFECTS",
    "MODELS",
    "Interval",
    "Parameter",
    "build",
    "channels",
    "compose",
    "evaluate_channels",
    "model",
    "parameter",
    "parameter_values",
    "parameters_of",
    "variants",
]
