"""brdfit: which analytic reflectance model is this material, with which parameters, how well, and at what cost?"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .data import preset as preset
    from .errors import InputError as InputError
    from .fitting import Effort as Effort
    from .fitting import Fit as Fit
    from .fitting import Loss as Loss
    from .fitting import evaluate as evaluate
    from .fitting import fit as fit
    from .fitting import fit_many as fit_many
    from .geometry import Geometry as Geometry
    from .models import BRDF as BRDF
    from .models import compose as compose
    from .models import model as model
    from .models import parameter as parameter
    from .models.factory import microfacet as microfacet
    from .reports import report as report
    from .tables import Table as Table
    from .tables import load as load
    from .tables import measurements as measurements
    from .tables import save as save
    from .tabulated import ready as ready

__version__ = "0.1.0"

# Public names and where they live. They are imported on first use, so that ``brdfit --help`` and a complaint about a bad
# file do not wait for JAX.
_PUBLIC = {
    "BRDF": "models",
    "Effort": "fitting",
    "Fit": "fitting",
    "Geometry": "geometry",
    "InputError": "errors",
    "Table": "tables",
    "Loss": "fitting",
    "compose": "models",
    "evaluate": "fitting",
    "fit": "fitting",
    "fit_many": "fitting",
    "load": "tables",
    "measurements": "tables",
    "microfacet": "models.factory",
    "model": "models",
    "parameter": "models",
    "preset": "data",
    "ready": "tabulated",
    "report": "reports",
    "save": "tables",
}
_MODULES = ("angles", "data", "fitting", "models", "reports", "scenes", "stored_programs", "tables", "tradeoff")


def __getattr__(name: str) -> Any:
    from importlib import import_module

    if name in _PUBLIC:
        return getattr(import_module(f".{_PUBLIC[name]}", __name__), name)
    if name in _MODULES:
        return import_module(f".{name}", __name__)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*_PUBLIC, *_MODULES, "__version__"])


__all__ = [*_PUBLIC, "__version__"]  # pyright: ignore[reportUnsupportedDunderAll]
