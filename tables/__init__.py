"""Measured BRDF tables: what they hold, and the files they come in."""

from .layout import HalfDifferenceGrid, Layout, Scattered, SphericalGrid
from .table import Convention, Table, table

__all__ = ["Convention", "HalfDifferenceGrid", "Layout", "Scattered", "SphericalGrid", "Table", "table"]
