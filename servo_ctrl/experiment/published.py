"""Published figures that the simulated table is held against."""

from __future__ import annotations

from typing import NamedTuple


class Figures(NamedTuple):
    """Indicators at the x axis' reversal over the monitoring time, micrometres."""

    contour_peak_um: float
    mean_um: float
    peak_um: float
    rms_um: float


FENG_2015_X_UNCOMPENSATED = {
    500: Figures(6.89, 3.33, 6.93, 3.84),
    1000: Figures(13.37, 4.70, 13.36, 6.25),
    2000: Figures(18.99, 6.26, 19.11, 8.56),
    3000: Figures(20.09, 7.46, 20.21, 9.66),
}
"""Feed (mm/min) to figures on a circle of R = 25 mm without compensation (Feng et al. 2015, table 3)."""


def relative_errors_percent(measured: dict[int, Figures]) -> dict[int, Figures]:
    """Relative error (%) of each indicator, per feed that has published figures."""
    errors = {}
    for feed, published in FENG_2015_X_UNCOMPENSATED.items():
        if feed in measured:
            pairs = zip(measured[feed], published, strict=True)
            errors[feed] = Figures(*(100.0 * (ours / theirs - 1.0) for ours, theirs in pairs))
    return errors
