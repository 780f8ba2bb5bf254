"""What the plots of a report are drawn from, as plain arrays, and the file it is kept in beside fits.json."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..files import StrPath, reading, replacing

Array = NDArray[Any]
NAME = "evidence.h5"
FORMAT = "brdfit-evidence"
VERSION = 1


@dataclass(frozen=True)
class Lobes:
    """BRDF values in the plane of incidence, 1/sr. M fits, A angles of incidence, n viewers, C channels."""

    theta_i: Array
    """Angles of incidence, degrees, ``[A]``."""
    theta_o: Array
    """Angles of the viewer, degrees, ``[A, n]``; positive on the side of the mirror direction."""
    measured: Array
    """``[A, n, C]``, NaN where the table has no value."""
    fitted: Array
    """``[M, A, n, C]``, NaN for a fit without a model."""
    how: str
    """How the measured values were read from the table, in words."""


@dataclass(frozen=True)
class Maps:
    """Residual ln(1 + f cos_i) - ln(1 + m cos_i) over (theta_h, theta_d), averaged over the azimuth and the channels."""

    theta_h: Array
    """Edges, degrees, ``[H + 1]``."""
    theta_d: Array
    """Edges, degrees, ``[D + 1]``."""
    signed: Array
    """Mean, ``[M, H, D]``, NaN where no cell was fitted."""
    rms: Array
    """Root of the mean square, ``[M, H, D]``."""
    how: str


@dataclass(frozen=True)
class Sphere:
    """A sphere seen from far away under one directional light: BRDF times cos_i at each lit pixel."""

    light: Array
    """Direction to the light, ``[3]``; the viewer is at +z, +y is up."""
    lit: Array
    """``[N, N]``, 1 at the P lit pixels (row by row), 2 where the sphere is in its own shade, 0 beside it."""
    measured: Array
    """``[P, C]``, NaN where the table has no value."""
    fitted: Array
    """``[M, P, C]``."""
    difference: Array
    """CIEDE2000 between fitted and measured as shown, ``[M, P]``, NaN where nothing was measured."""
    exposure: float
    """Factor that takes the values to the screen, where 1 is white."""


@dataclass(frozen=True)
class Albedo:
    """Fraction of the light from theta_i that is returned."""

    theta_i: Array
    """Degrees, ``[A]``."""
    measured: Array
    """``[A, C]``, over the directions that the table has values for."""
    covered: Array
    """Share of the projected solid angle that the table has values for, ``[A]``."""
    fitted: Array
    """``[M, A, C]``."""
    error: Array
    """Error of the quadrature, ``[M, A, C]``."""


@dataclass(frozen=True)
class Published:
    """A fit of the same model to the same material in the literature."""

    source: str
    """Where it was published."""
    reference: str
    """Key of the citation."""
    errors: dict[str, float]
    """By loss, over the cells of the new fit."""


@dataclass(frozen=True)
class Evidence:
    """Everything that the plots of one material need. Parts that could not be made are None, with a word why."""

    material: str
    source: str
    sha256: str
    keys: tuple[str, ...]
    """The fits that it is about, as :func:`fit_key` names them, in order: the first axis M of the arrays."""
    channel_names: tuple[str, ...]
    lobes: Lobes | None = None
    maps: Maps | None = None
    sphere: Sphere | None = None
    albedo: Albedo | None = None
    published: dict[str, Published] = field(default_factory=dict)
    """The published fits beside the new ones, by the names of these."""
    missing: dict[str, str] = field(default_factory=dict)
    """Why a part is missing, by its name."""


PARTS: dict[str, type] = {"lobes": Lobes, "maps": Maps, "sphere": Sphere, "albedo": Albedo}


def save_evidence(out_dir: StrPath, evidence: Sequence[Evidence]) -> Path:
    """Write DIR/evidence.h5, under a temporary name first. Arrays are kept in single precision."""
    import h5py

    path = Path(out_dir) / NAME
    with replacing(path) as temporary, h5py.File(temporary, "w") as file:
        file.attrs["format"], file.attrs["version"] = FORMAT, VERSION
        for k, e in enumerate(evidence):
            group = file.create_group(f"{k:05d}")
            head = {n: getattr(e, n) for n in ("material", "source", "sha256", "keys", "channel_names", "missing")}
            head["published"] = {key: asdict(p) for key, p in e.published.items()}
            group.attrs["about"] = json.dumps(head)
            for name in PARTS:
                part = getattr(e, name)
                if part is None:
                    continue
                sub = group.create_group(name)
                for f in fields(part):
                    value = getattr(part, f.name)
                    if isinstance(value, np.ndarray):
                        packed = value.astype(np.uint8 if value.dtype.kind in "iub" else np.float32)
                        sub.create_dataset(f.name, data=packed, compression="gzip", shuffle=True)
                    else:
                        sub.attrs[f.name] = value
    return path


def load_evidence(out_dir: StrPath) -> list[Evidence]:
    """Read DIR/evidence.h5; an empty list if there is none.

    Raises InputError if the file is there but is not what it should be.
    """
    import h5py

    path = Path(out_dir) / NAME
    if not path.exists():
        return []
    try:
        with reading(path) as raw, h5py.File(raw, "r") as file:
            if file.attrs.get("format") != FORMAT:
                raise InputError(f"{path}: is not a brdfit evidence file; remove it or fit again")
            if file.attrs["version"] != VERSION:
                raise InputError(f"{path}: has version {file.attrs['version']}, this brdfit reads {VERSION}; fit again")
            return [_read(file[name]) for name in sorted(file)]
    except InputError:
        raise
    except (OSError, KeyError, ValueError, TypeError) as fault:
        raise InputError(f"{path}: cannot be read as evidence of a fit ({fault}); remove it or fit again") from None


def _read(group: Any) -> Evidence:
    head = json.loads(group.attrs["about"])
    parts = {}
    for name, cls in PARTS.items():
        if name in group:
            sub = group[name]
            kinds = get_type_hints(cls)
            parts[name] = cls(
                **{f.name: sub[f.name][()] if f.name in sub else kinds[f.name](sub.attrs[f.name]) for f in fields(cls)}
            )
    return Evidence(
        material=head["material"],
        source=head["source"],
        sha256=head["sha256"],
        keys=tuple(head["keys"]),
        channel_names=tuple(head["channel_names"]),
        published={key: Published(**p) for key, p in head.get("published", {}).items()},  # earlier files have none
        missing=head["missing"],
        **parts,
    )
