"""From fits to pages: the evidence behind the plots, fits.json, and the one self-contained report.html."""

from .evidence import save_evidence
from .gather import Views, gather
from .write import read_fits, rebuild_report, report, write_fits, write_report


def preload() -> None:
    """Import what drawing needs, when there is time for it."""
    import matplotlib.backends.backend_agg  # noqa: F401

    from ..colours import library

    library()


__all__ = [
    "Views",
    "gather",
    "preload",
    "read_fits",
    "rebuild_report",
    "report",
    "save_evidence",
    "write_fits",
    "write_report",
]
