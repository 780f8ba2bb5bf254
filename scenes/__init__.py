"""What a scene calls for: its picture with the measured table, with models, and with no more of a model than it shows."""

from .illumination import illuminate
from .look import look, weighted
from .measured import Measured, measured
from .page import write_scene
from .read import load_scene
from .render import Rendered, render
from .scene import Scene
from .study import PIECES, Study, study
from .view import View, view

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
