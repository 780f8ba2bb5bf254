"""What accuracy costs in time, measured on the user's machine: settings of a fit, models to render with, approximations."""

from .page import write_tradeoff
from .survey import PIECES, Tradeoff, tradeoff

__all__ = ["PIECES", "Tradeoff", "tradeoff", "write_tradeoff"]
