"""Any table file: the reader is chosen by content, the writer by name."""

from __future__ import annotations

import os
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..files import StrPath, reading
from .hdf5 import read_hdf5, write_hdf5
from .merl import Angles, Period, read_merl, write_merl
from .table import Table

_HDF5_SIGNATURE = b"\x89HDF\r\n\x1a\n"


def load(path: StrPath, *, angles: Angles = "edge", phi_period: Period | None = None) -> Table:
    """The measured table in a MERL .binary or brdfit .h5 file, whatever its name; values in 1/sr, angles in radians.

    Args:
        path: the file.
        angles: where in a cell of a MERL file its value holds, at the lower "edge" or at the "centre". A .h5 table says
            so itself.
        phi_period: range of phi_d in a MERL file in degrees, 180 or 360; by default 360 if n_phi = 4 n_theta_d.

    Raises:
        InputError: the file cannot be used, or holds nothing to fit (no measured cell, or only zeros).
        ValueError: ``angles`` or ``phi_period`` is none of the above.
    """
    start = time.perf_counter()
    with reading(path) as file:
        hdf5 = file.read(len(_HDF5_SIGNATURE)) == _HDF5_SIGNATURE
    found = read_hdf5(path) if hdf5 else read_merl(path, angles=angles, phi_period=phi_period)
    if not found.mask.any():
        raise InputError(f"{path}: no cell is measured: all {found.mask.size} are negative or not finite; check the file")
    if all(np.max(plane, where=found.mask, initial=0) == 0 for plane in found.planes):
        raise InputError(f"{path}: every measured value is zero: nothing to fit; check the file")
    return replace(found, seconds=time.perf_counter() - start)


def save(values: Table, path: StrPath) -> None:
    """Write a table as a MERL file (.binary) or as HDF5 (.h5), which keeps everything.

    Raises InputError if the suffix is neither, the table does not fit the format, or the file cannot be written.
    """
    suffix = Path(path).suffix
    if suffix == ".binary":
        write_merl(path, values)
    elif suffix == ".h5":
        write_hdf5(path, values)
    else:
        raise InputError(f"{os.fspath(path)}: no table is written under the suffix {suffix!r}; use .binary or .h5")


__all__ = ["load", "save"]
