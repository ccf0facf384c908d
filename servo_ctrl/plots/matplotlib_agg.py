"""Matplotlib behind one file, for every picture that becomes a file: no screen is needed.

Without pyplot: a figure on its own is drawn by Agg and leaves the backend of a user's notebook as it is.
"""

import os

from servo_ctrl.plots.notebook_backend import forget_missing_backend

forget_missing_backend(os.environ)
from matplotlib.axes import Axes  # noqa: E402  # behind what makes it importable
from matplotlib.backends.backend_pdf import FigureCanvasPdf, PdfPages  # noqa: E402
from matplotlib.collections import LineCollection  # noqa: E402
from matplotlib.figure import Figure  # noqa: E402
from matplotlib.lines import Line2D  # noqa: E402
from matplotlib.projections.polar import PolarAxes  # noqa: E402
from matplotlib.ticker import LogLocator, NullFormatter  # noqa: E402

__all__ = [
    "Axes",
    "Figure",
    "FigureCanvasPdf",
    "Line2D",
    "LineCollection",
    "LogLocator",
    "NullFormatter",
    "PdfPages",
    "PolarAxes",
]
