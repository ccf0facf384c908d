"""Published figures with which the simulated table is compared."""

from servo_ctrl.metrology.circles import ReversalFigures

FENG_2015_X_UNCOMPENSATED = {
    500: ReversalFigures(6.89, 3.33, 6.93, 3.84),
    1000: ReversalFigures(13.37, 4.70, 13.36, 6.25),
    2000: ReversalFigures(18.99, 6.26, 19.11, 8.56),
    3000: ReversalFigures(20.09, 7.46, 20.21, 9.66),
}
"""Feed (mm/min) to figures on a circle of R = 25 mm without compensation (Feng et al. 2015, table 3)."""

FENG_2015_X_PULSE = {
    500: ReversalFigures(2.50, 1.54, 2.53, 1.61),
    1000: ReversalFigures(2.06, 0.81, 2.07, 0.97),
    2000: ReversalFigures(4.15, 1.36, 4.09, 1.72),
    3000: ReversalFigures(5.30, 2.09, 5.29, 2.46),
}
"""The same with the learned pulse."""

FENG_2015_X_OBSERVER = {
    500: ReversalFigures(4.96, 2.24, 4.73, 2.62),
    1000: ReversalFigures(10.56, 3.19, 10.01, 2.92),
    2000: ReversalFigures(17.09, 4.63, 16.79, 5.70),
    3000: ReversalFigures(18.95, 5.84, 17.95, 8.15),
}
"""The same with the disturbance observer."""

FENG_2015_CLAIMS_PERCENT = {
    "x": ReversalFigures(63.0, 54.0, 63.0, 58.0),
    "y": ReversalFigures(71.0, 62.0, 71.0, 69.0),
    "S": ReversalFigures(76.0, 71.0, 76.0, 75.0),
}
"""Least reduction of each indicator by the pulse, per cent: circles of x, of y, S-shaped motions."""


def relative_errors_percent(measured: dict[int, ReversalFigures]) -> dict[int, ReversalFigures]:
    """Return the relative error (%) of each indicator, by feed (mm/min) with published figures."""
    errors = {}
    for feed, published in FENG_2015_X_UNCOMPENSATED.items():
        if feed in measured:
            pairs = zip(measured[feed], published, strict=True)
            errors[feed] = ReversalFigures(*(100.0 * (ours / theirs - 1.0) for ours, theirs in pairs))
    return errors
