"""From a table and a model to a fit: losses, blocks of cells, coordinates, starts, solver, error bars."""

from .batch import fit_many
from .effort import Effort
from .fit_table import evaluate, fit
from .losses import LOSSES, Loss
from .result import Fit, Optimum

__all__ = ["LOSSES", "Effort", "Fit", "Loss", "Optimum", "evaluate", "fit", "fit_many"]
