"""Tables with known parameters: materials by name, noise in parts, and files with the truth beside them.

table, truth = generate("gtr-03", noise=[Relative(0.01), Missing(0.05)], seed=1)
"""

from .draws import ANISOTROPIC_RANGES, RANGES, Range
from .generate import ANISOTROPIC_GRID, GRID, Truth, evaluate, generate
from .layouts import grid, scattered
from .materials import DEFAULT_NAMES, FORMULAS, Material, from_truth, material, names
from .misfits import Coated, Retro, TwoLobes
from .noise import Floor, Grazing, Missing, Noise, Outliers, Relative
from .write import write

__all__ = [
    "ANISOTROPIC_GRID",
    "ANISOTROPIC_RANGES",
    "DEFAULT_NAMES",
    "FORMULAS",
    "GRID",
    "RANGES",
    "Coated",
    "Floor",
    "Grazing",
    "Material",
    "Missing",
    "Noise",
    "Outliers",
    "Range",
    "Relative",
    "Retro",
    "Truth",
    "TwoLobes",
    "evaluate",
    "from_truth",
    "generate",
    "grid",
    "material",
    "names",
    "scattered",
    "write",
]
