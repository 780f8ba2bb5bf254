"""From fits to pages: the evidence behind the plots, fits.json, and the one self-contained report.html."""

from .evidence import save_evidence
from .gather import gather
from .write import read_fits, rebuild_report, write_fits, write_report

__all__ = ["gather", "read_fits", "rebuild_report", "save_evidence", "write_fits", "write_report"]
