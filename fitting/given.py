"""What the caller of a fit gives, checked before anything is compiled: table, model, bounds and start."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from jaxtyping import ArrayLike

from ..errors import InputError
from ..models import BRDF, parameter_values, parameters_of, variants
from ..tables import Table
from .result import Named

Model = str | BRDF | type[BRDF]


def model_class(model: Model, anisotropic: bool) -> type[BRDF]:
    """The class to fit: of a name, its form for the kind of table.

    Raises ValueError for an unknown name, TypeError for what is no model.
    """
    if isinstance(model, str):
        forms = variants(model)
        return next((f for f in forms if f.anisotropic == anisotropic), forms[0])
    cls = model if isinstance(model, type) else type(model)
    if not issubclass(cls, BRDF) or not parameters_of(cls):
        raise TypeError(
            f"a model is a name, a brdfit.BRDF or a subclass of it with fields declared by brdfit.parameter, not {model!r}"
        )
    return cls


def check_azimuth(cls: type[BRDF], where: str) -> None:
    """Raise InputError for an anisotropic model; ``where`` names an isotropic table that it is to be fitted to."""
    if cls.anisotropic:
        raise InputError(
            f"{where}: an anisotropic model needs the azimuth of the half vector, and this table is isotropic: fit "
            f"{name_of(cls)} to an anisotropic table, or another model to this one"
        )


def name_of(cls: type[BRDF]) -> str:
    """The name of a model class; one from outside may have none but its own."""
    return getattr(cls, "name", cls.__name__.lower())


def check_table(table: Any) -> None:
    """Raise TypeError for what is no table."""
    if not isinstance(table, Table):
        raise TypeError(f"a table is what brdfit.load or brdfit.measurements returns, not {table!r:.100}")


def given_start(cls: type[BRDF], model: Model, start: Mapping[str, ArrayLike] | str | None, table: Table) -> Named:
    """Values to start from: those of a model instance, and over them those of ``start``, or the published ones.

    Raises ValueError for any other word.
    """
    given = dict(parameter_values(model)) if isinstance(model, BRDF) else {}
    if isinstance(start, str):
        if start != "published":
            raise ValueError(f"start is a mapping of parameters or 'published', not {start!r}")
        from ..data.presets import published_start  # the numbers are read when they are asked for

        start = published_start(name_of(cls), table.material) if table.channels == 3 else None
        start = start if start and set(start) == {p.name for p in parameters_of(cls)} else None
    return given | {n: np.asarray(v, float) for n, v in (start or {}).items()}


def check_names(cls: type[BRDF], values: Mapping[str, Any]) -> None:
    """Raise ValueError if one of the names is no parameter of a model."""
    known = [p.name for p in parameters_of(cls)]
    for name in values:
        if name not in known:
            raise ValueError(f"{cls.__name__} has no parameter {name!r}: it has {', '.join(known)}")


def check_bounds(cls: type[BRDF], bounds: Mapping[str, tuple[float, float]]) -> None:
    """Raise ValueError for bounds that are none, or leave the range of a formula."""
    for p in parameters_of(cls):
        if p.name not in bounds:
            continue
        lower, upper = bounds[p.name]
        if not (p.valid.lower <= lower < upper <= p.valid.upper):
            raise ValueError(
                f"{cls.__name__}: bounds of {p.name!r} must be lower < upper within {p.valid}, not {lower:g} and {upper:g}"
            )


def per_channel(cls: type[BRDF], values: Named, channels: int) -> Named:
    """Given values as arrays ``[C]`` or ``[]``, as each parameter is. Raises ValueError if one does not fit."""
    out = {}
    for p in parameters_of(cls):
        if p.name not in values:
            continue
        v = values[p.name]
        for x in v.ravel():
            if x not in p.valid:
                raise ValueError(f"{cls.__name__}: parameter {p.name!r} must lie in {p.valid}, not {x:g}")
        try:
            out[p.name] = np.broadcast_to(v, (channels,) if p.per_channel else ()).copy()
        except ValueError:
            wanted = f"a scalar or {channels} values" if p.per_channel else "a scalar"
            raise ValueError(f"{cls.__name__}: parameter {p.name!r} is {wanted}, not of shape {list(v.shape)}") from None
    return out


__all__ = [
    "Model",
    "check_azimuth",
    "check_bounds",
    "check_names",
    "check_table",
    "given_start",
    "model_class",
    "name_of",
    "per_channel",
]
