"""Matplotlib behind one file, for every picture that becomes a file: no screen is needed."""

import matplotlib as mpl

mpl.use("Agg")  # the daemon's machine may have no screen
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.backends.backend_pdf import FigureCanvasPdf, PdfPages
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.projections.polar import PolarAxes
from matplotlib.ticker import LogLocator, NullFormatter

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
    "mpl",
    "plt",
]
