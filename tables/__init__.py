"""Measured BRDF tables: what they hold, and the files they come in."""

from .hdf5 import read_hdf5, read_truth, write_hdf5
from .layout import HalfDifferenceGrid, Layout, Scattered, SphericalGrid
from .load import load, save
from .measurements import measurements
from .merl import merl_grid, read_merl, write_merl
from .table import Convention, Table, table

__all__ = [
    "Convention",
    "HalfDifferenceGrid",
    "Layout",
    "Scattered",
    "SphericalGrid",
    "Table",
    "load",
    "measurements",
    "merl_grid",
    "read_hdf5",
    "read_merl",
    "read_truth",
    "save",
    "table",
    "write_hdf5",
    "write_merl",
]
