"""What a scene calls for: its picture with the measured table, with models, and with no more of a model than it shows."""

from .appearance import look, weighted
from .illumination import illuminate
from .interpolated import Measured, measured
from .page import write_scene
from .pixels import View, view
from .read import load_scene
from .rendering import Rendered, render
from .scene import Scene
from .survey import PIECES, Study, study

__all__ = [
    "PIECES",
    "Measured",
    "Rendered",
    "Scene",
    "Study",
    "View",
    "illuminate",
    "load_scene",
    "look",
    "measured",
    "render",
    "study",
    "view",
    "weighted",
    "write_scene",
]
