"""What people look at: figures and the one-page report. Nothing is computed here that is not in a run."""

from asperity.report.figures import surface_map
from asperity.report.page import write_report

__all__ = ["surface_map", "write_report"]
