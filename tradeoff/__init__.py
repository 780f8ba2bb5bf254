"""What accuracy costs in time, measured on the user's machine: settings of a fit, models to render with, approximations."""

from .page import write_tradeoff
from .survey import Tradeoff, pieces, tradeoff

__all__ = ["Tradeoff", "pieces", "tradeoff", "write_tradeoff"]
