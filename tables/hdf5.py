"""The project's own table file: HDF5 that holds every layout and any number of channels, bit for bit.

    attributes     format = "brdfit-table", version = 1, material, angles (edge, centre or exact), channel_names,
                   source and source_sha256 (where the table came from when it was written), truth (JSON; optional)
    values         float64 [C, *shape], 1/sr, masked cells included
    mask           bool [*shape], True where measured
    layout         group; attribute kind = half_difference, spherical or scattered; one dataset a field of that class
                   of brdfit.tables (rad; wi and wo are unit vectors, measure is in sr^2); fields that are None are absent

Datasets are neither compressed nor stored outside the file, so none can claim more memory than the file has bytes.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import MISSING, fields, replace
from typing import Any, get_args

import h5py
import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..files import StrPath, reading, replacing
from .layout import HalfDifferenceGrid, Layout, Scattered, SphericalGrid
from .table import Convention, Table, table

FORMAT = "brdfit-table"
VERSION = 1

_KINDS: dict[str, type[Layout]] = {
    "half_difference": HalfDifferenceGrid,
    "spherical": SphericalGrid,
    "scattered": Scattered,
}
_UNITS = {"wi": "1", "wo": "1", "measure": "sr^2"}


def read_hdf5(path: StrPath) -> Table:
    """The table in a brdfit HDF5 file; ``source`` and ``sha256`` are those of the file itself.

    Raises InputError if the file is missing, damaged, not of this format and version, or at odds with itself.
    """
    with reading(path) as raw:
        sha256 = hashlib.file_digest(raw, "sha256").hexdigest()
    with _opened(path) as file:
        layout = _read_layout(path, file)
        planes = _array(path, file, "values", float)
        mask = _array(path, file, "mask", bool)
        if planes.shape[1:] != layout.shape or mask.shape != layout.shape:
            raise _odd(path, f"values {planes.shape} and mask {mask.shape} do not fit a layout of {layout.shape}")
        angles = file.attrs["angles"]
        if angles not in get_args(Convention):
            raise _odd(path, f"angles are {angles!r}, not one of {', '.join(get_args(Convention))}")
        names = tuple(str(n) for n in file.attrs["channel_names"])
        material = str(file.attrs["material"])
    found = table(planes, layout, material, source=os.fspath(path), sha256=sha256, angles=angles, channel_names=names)
    if names and len(names) != found.channels:
        raise _odd(path, f"{len(names)} channel names and {found.channels} channels")
    if (mask & ~found.mask).any():
        raise _odd(path, "its mask passes cells with a negative or non-finite value")
    return replace(found, mask=mask)


def read_truth(path: StrPath) -> dict[str, Any] | None:
    """What :func:`write_hdf5` was given as ``truth`` (arrays come back as lists); None if nothing was.

    Raises InputError as :func:`read_hdf5` does.
    """
    with _opened(path) as file:
        found = file.attrs.get("truth")
        return None if found is None else dict(json.loads(found))


def write_hdf5(path: StrPath, values: Table, *, truth: Mapping[str, Any] | None = None) -> None:
    """Write a table, with the true parameters of a synthetic one as ``truth`` if they are known (numbers, text, arrays).

    Raises InputError if the file cannot be written and for a table weighted by a scene; nothing is left behind.
    """
    if type(values.layout) not in _KINDS.values():
        raise InputError(f"{path}: the format keeps no weights of a scene; save the table itself, and weight it when read")
    with replacing(path) as temporary:
        temporary.write_bytes(_image(values, truth))


def _image(values: Table, truth: Mapping[str, Any] | None) -> bytes:
    """The bytes of the file, put together in memory: HDF5 cannot give up cleanly on a disk that fills up."""
    with h5py.File("table", "w", driver="core", backing_store=False) as file:
        file.attrs.update(format=FORMAT, version=VERSION, material=values.material, angles=values.angles)
        file.attrs.update(source=values.source, source_sha256=values.sha256)
        names = np.array(values.channel_names, object)
        file.attrs.create("channel_names", names, shape=names.shape, dtype=h5py.string_dtype())
        if truth is not None:
            file.attrs["truth"] = json.dumps(dict(truth), default=lambda a: np.asarray(a).tolist())
        file.create_dataset("values", data=values.planes).attrs["units"] = "1/sr"
        file.create_dataset("mask", data=values.mask)
        group = file.create_group("layout")
        group.attrs["kind"] = next(kind for kind, cls in _KINDS.items() if type(values.layout) is cls)
        for f in fields(values.layout):
            data = getattr(values.layout, f.name)
            if data is not None:
                group.create_dataset(f.name, data=data).attrs["units"] = _UNITS.get(f.name, "rad")
        file.flush()
        return bytes(file.id.get_file_image())


@contextmanager
def _opened(path: StrPath) -> Iterator[h5py.File]:
    """The open file, known to be of this format; what h5py finds wrong with it becomes an InputError."""
    with reading(path):  # missing, empty or unreadable files are worded there
        pass
    try:
        file = h5py.File(path, "r")
    except OSError as fault:
        raise InputError(f"{path}: is no HDF5 file or a damaged one ({fault}); copy or make it again") from fault
    with file:
        try:
            if file.attrs.get("format") != FORMAT:
                raise InputError(f"{path}: is HDF5 but not a {FORMAT}; write it with brdfit.save")
            if file.attrs["version"] != VERSION:
                version = file.attrs["version"]
                raise InputError(f"{path}: is a {FORMAT} of version {version}, this program reads {VERSION}; make it again")
            yield file
        except InputError:
            raise
        except (KeyError, OSError, RuntimeError, TypeError, ValueError) as fault:
            why = fault.args[0] if fault.args else fault
            raise _odd(path, f"it cannot be read as one ({why})") from fault


def _odd(path: StrPath, fault: str) -> InputError:
    return InputError(f"{path}: is a damaged {FORMAT}: {fault}; make it again")


def _array(path: StrPath, group: h5py.Group, name: str, dtype: type) -> NDArray[Any]:
    dataset = group[name]
    if not isinstance(dataset, h5py.Dataset):
        raise _odd(path, f"{name} is not a dataset")
    size = os.stat(path).st_size
    if dataset.nbytes > size:  # before any memory is taken
        raise _odd(path, f"{name} claims {dataset.nbytes} bytes and the whole file has {size}")
    return np.asarray(dataset[()], dtype)


def _read_layout(path: StrPath, file: h5py.File) -> Layout:
    group = file["layout"]
    kind = group.attrs["kind"]
    if kind not in _KINDS:
        raise _odd(path, f"the kind of its layout is {kind!r}, not one of {', '.join(_KINDS)}")
    cls = _KINDS[kind]
    found: dict[str, Any] = {}
    for f in fields(cls):
        if f.name == "isotropic":
            found[f.name] = bool(group[f.name][()])
        elif f.name in group or f.default is MISSING:
            found[f.name] = _array(path, group, f.name, float)
    if cls is not Scattered:
        _check_axes(path, found)
    try:
        return cls(**found)
    except ValueError as fault:
        raise _odd(path, str(fault)) from None


def _check_axes(path: StrPath, found: dict[str, NDArray[np.float64]]) -> None:
    """Every axis is a list of positions, and its edges are one more and ascend."""
    for name in {n.removesuffix("_edges") for n in found}:
        positions, edges = found.get(name), found.get(f"{name}_edges")
        if positions is None or edges is None:
            raise _odd(path, f"{name} has positions or edges but not both")
        if positions.ndim != 1 or edges.shape != (len(positions) + 1,):
            raise _odd(path, f"{name} has positions {positions.shape} and edges {edges.shape}, one more is needed")
        if not (np.isfinite(positions).all() and np.isfinite(edges).all() and (np.diff(edges) > 0).all()):
            raise _odd(path, f"{name} has angles that are not finite or edges that do not ascend")
        if edges.max() > (np.pi if name.startswith("theta") else 4 * np.pi) * (1 + 1e-6):
            raise InputError(f"{path}: {name} reaches {edges.max():.4g}, and angles are in radians; convert them")


__all__ = ["read_hdf5", "read_truth", "write_hdf5"]
