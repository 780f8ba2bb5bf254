"""Published fits to measured materials, and tables made from known parameters (:mod:`.synthetic`)."""

from .presets import preset, published_abc, published_sgd, published_sgd_smith, published_start
from .published import NGAN_SCALE, forms, formula, published_materials, raw, source
from .published_sgd import PublishedSGD

__all__ = [
    "NGAN_SCALE",
    "PublishedSGD",
    "forms",
    "formula",
    "preset",
    "published_abc",
    "published_materials",
    "published_sgd",
    "published_sgd_smith",
    "published_start",
    "raw",
    "source",
]
