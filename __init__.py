"""brdfit: which analytic reflectance model is this material, with which parameters, how well, and at what cost?"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .errors import InputError as InputError
    from .models import BRDF as BRDF
    from .models import model as model
    from .models import parameter as parameter
    from .tables import Table as Table
    from .tables import load as load
    from .tables import save as save

__version__ = "0.1.0"

# Public names and where they live. They are imported on first use, so that ``brdfit --help`` and a complaint about a bad
# file do not wait for JAX.
_PUBLIC = {
    "BRDF": "models",
    "InputError": "errors",
    "Table": "tables",
    "load": "tables",
    "model": "models",
    "parameter": "models",
    "save": "tables",
}


def __getattr__(name: str) -> Any:
    from importlib import import_module

    if name in _PUBLIC:
        return getattr(import_module(f".{_PUBLIC[name]}", __name__), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*_PUBLIC, "__version__"])


__all__ = [*_PUBLIC, "__version__"]  # pyright: ignore[reportUnsupportedDunderAll]
