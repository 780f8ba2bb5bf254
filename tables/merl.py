"""The binary tables of the MERL database (Matusik et al. 2003).

Three little-endian int32, H, D and P, then the planes R, G, B of float64, each ``[H, D, P]``: 12 + 24 H D P bytes. The
BRDF in 1/sr is the stored value times (1, 1.15, 1.66)/1500. With i, j, k the indices,

    theta_h = (i/H)^2 90 deg,   theta_d = (j/D) 90 deg,   phi_d = (k/P) 180 deg.

The database has 90 x 90 x 180. Files with P = 4 D (90 x 90 x 360) do not assume reciprocity: their phi_d runs over 360 deg.
A cell spans the indices [i, i + 1). Whether its value holds at the lower edge or at the centre, in index, is not in the
file, and on a sharp lobe the two differ by up to 1.5 times. A negative value says that the cell was not measured.
"""

from __future__ import annotations

import hashlib
import os
import string
import struct
from pathlib import Path
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..files import StrPath, reading, replacing
from .layout import HalfDifferenceGrid
from .table import Table, table

Angles = Literal["edge", "centre"]
Period = Literal[180, 360]
Shape = tuple[int, int, int]

SCALE = np.array([1.0, 1.15, 1.66]) / 1500
"""1/sr per stored unit, of R, G and B."""

LARGEST = 1e20
"""1/sr beyond which a value is no measurement: the peak of a perfect lobe of 1e-10 radians."""

_HEADER = struct.Struct("<3i")
_LONGEST_AXIS = 10_000
"""Beyond any table that could be measured (a hundredth of a degree in theta_d)."""


def read_merl(path: StrPath, *, angles: Angles = "edge", phi_period: Period | None = None) -> Table:
    """The table in a MERL file: planes ``[3, H, D, P]`` in 1/sr; cells with a negative or non-finite channel are masked.

    Args:
        path: the file; its stem names the material.
        angles: where in a cell its value holds, at the lower "edge" or at the "centre".
        phi_period: range of phi_d in degrees, 180 or 360; by default 360 if P = 4 D and 180 otherwise.

    Raises:
        InputError: the file is missing, cut short, too long, or something else than a MERL table.
        ValueError: ``angles`` or ``phi_period`` is none of the above.
    """
    with reading(path) as file:
        header = file.read(_HEADER.size)
        shape = _shape(path, header, os.fstat(file.fileno()).st_size)
        layout = merl_grid(shape, angles=angles, phi_period=phi_period)
        stored = np.empty((3, *shape), "<f8")
        content = stored.reshape(-1).view(np.uint8).data
        if file.readinto(content) != content.nbytes:
            raise InputError(f"{path}: became shorter while it was read; wait until it is complete")
    digest = hashlib.sha256(header)
    digest.update(content)
    planes = stored.astype(np.float64, copy=False)
    with np.errstate(over="ignore", invalid="ignore"):  # of what is no number, and of what is none of a reflectance
        planes *= SCALE[:, None, None, None]
        largest = float(np.fmax.reduce(planes, axis=None))
    if largest == np.inf:
        largest = float(planes[np.isfinite(planes)].max(initial=0.0))
    if largest > LARGEST:
        raise InputError(f"{path}: values up to {largest:.0e}/sr are no reflectance; check its byte order and units")
    material = Path(path).stem
    return table(planes, layout, material, source=os.fspath(path), sha256=digest.hexdigest(), angles=angles)


def write_merl(path: StrPath, values: Table | NDArray[np.float64]) -> None:
    """Write a table, or planes ``[3, H, D, P]`` in 1/sr on the grid of :func:`merl_grid`, as a MERL file.

    Masked cells become -1 in every channel. Reading back gives the values to the last bit but one, as they are stored
    divided by the scale. The file does not say which angle convention or period it was made with.

    Raises:
        InputError: the table does not fit the format, or the file cannot be written; nothing is left behind.
    """
    given = values if isinstance(values, Table) else _on_merl_grid(path, values)
    _check_fits(path, given)
    with replacing(path) as temporary, temporary.open("wb") as file:
        file.write(_HEADER.pack(*given.layout.shape))
        for plane, scale in zip(given.planes, SCALE, strict=True):
            file.write(np.where(given.mask, plane / scale, -1.0).astype("<f8").tobytes())


def merl_grid(
    shape: Shape = (90, 90, 180), *, angles: Angles = "edge", phi_period: Period | None = None
) -> HalfDifferenceGrid:
    """The grid of a MERL file with ``shape`` = (H, D, P) cells; the arguments are those of :func:`read_merl`.

    Raises ValueError if ``angles`` or ``phi_period`` is none of the choices.
    """
    if angles not in get_args(Angles):
        raise ValueError(f"angles must be 'edge' or 'centre', not {angles!r}")
    if phi_period not in (None, *get_args(Period)):
        raise ValueError(f"phi_period must be 180 or 360 degrees, not {phi_period!r}")
    h, d, p = shape
    period = np.radians(phi_period or _period(shape))
    offset = 0.0 if angles == "edge" else 0.5

    def at(index: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
        return (index[: h + 1] / h) ** 2 * (np.pi / 2), index[: d + 1] / d * (np.pi / 2), index[: p + 1] / p * period

    index = np.arange(max(shape) + 1.0)
    edges, positions = at(index), at(index + offset)
    return HalfDifferenceGrid(*(x[:-1] for x in positions), *edges)


def _period(shape: Shape) -> Period:
    return 360 if shape[2] == 4 * shape[1] else 180


def _shape(path: StrPath, header: bytes, size: int) -> Shape:
    """(H, D, P) of a header that agrees with the ``size`` of its file; everything else raises InputError."""
    if all(byte in string.printable.encode() for byte in header.removeprefix(b"\xef\xbb\xbf")):
        raise InputError(f"{path}: is a text file, neither a MERL .binary nor a brdfit .h5 table; name the table itself")
    if len(header) < _HEADER.size:
        raise InputError(f"{path}: is cut short: {size} bytes, less than the 12 of a MERL header; copy or download it again")
    h, d, p = _HEADER.unpack(header)
    swapped = struct.unpack(">3i", header)
    words = f"{h} x {d} x {p}"
    if not _sane(h, d, p) and _sane(*swapped):
        was = "{} x {} x {}".format(*swapped)
        raise InputError(f"{path}: is big-endian (its header is {was} with the bytes swapped); convert it to little-endian")
    if min(h, d, p) <= 0:
        raise InputError(f"{path}: is no MERL table: its header says {words} cells, which must be positive; check the file")
    if not _sane(h, d, p):
        raise InputError(f"{path}: is no MERL table: its header says {words} cells, an absurd number; check the file")
    expected = _HEADER.size + 24 * h * d * p
    if size < expected:
        raise InputError(
            f"{path}: is cut short: {size} bytes of the {expected} of a {words} MERL table; copy or download it again"
        )
    if size > expected:
        raise InputError(
            f"{path}: has {size - expected} bytes too many: {size} where a {words} MERL table has {expected}; "
            "copy or download it again"
        )
    return h, d, p


def _sane(*shape: int) -> bool:
    return all(0 < n <= _LONGEST_AXIS for n in shape)


def _on_merl_grid(path: StrPath, planes: NDArray[np.float64]) -> Table:
    if planes.ndim != 4:
        raise InputError(f"{path}: values of shape {planes.shape} are no MERL table; give planes [3, H, D, P]")
    return table(planes, merl_grid(planes.shape[1:]), Path(path).stem)


def _check_fits(path: StrPath, given: Table) -> None:
    """Raise InputError where reading the file back would give another table."""
    if given.channels != 3:
        raise InputError(f"{path}: a MERL table has 3 channels and this one {given.channels}; save it as .h5")
    layout = given.layout
    if not isinstance(layout, HalfDifferenceGrid) or not layout.isotropic:
        raise InputError(f"{path}: a MERL table is an isotropic half/difference grid and this one is not; save it as .h5")
    shape = (len(layout.theta_h), len(layout.theta_d), len(layout.phi_d))
    if not any(_same(layout, merl_grid(shape, angles=angles)) for angles in get_args(Angles)):
        raise InputError(f"{path}: the angles of this table are not those of the MERL grid; save it as .h5")


def _same(a: HalfDifferenceGrid, b: HalfDifferenceGrid) -> bool:
    names = ("theta_h", "theta_d", "phi_d", "theta_h_edges", "theta_d_edges", "phi_d_edges")
    # 1e-9 rad: angles that took another road through degrees agree to 1e-15, other grids are off by a part of a cell
    return all(np.allclose(getattr(a, n), getattr(b, n), rtol=0, atol=1e-9) for n in names)


__all__ = ["SCALE", "merl_grid", "read_merl", "write_merl"]
