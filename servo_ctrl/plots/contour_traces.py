"""Curves of a reversal and of a turn of a circle, for pictures and pages."""

from typing import NamedTuple

import numpy as np

from kernels.arrays import Array


class ErrorTrace(NamedTuple):
    """Tracking error of one axis around one reversal; `since_reversal_s` and `error_m` have one length."""

    label: str
    since_reversal_s: Array
    error_m: Array


class ContourTrace(NamedTuple):
    """One turn of a circle: command angle and radial error (actual minus commanded radius), one length."""

    label: str
    angle_rad: Array
    radial_error_m: Array


def round_division(largest: float, least: float = 1e-9) -> float:
    """Half the largest error, or `least`, rounded up to 1, 2 or 5 times a power of ten; in any unit."""
    division = max(largest / 2.0, least)
    power = 10.0 ** np.floor(np.log10(division))
    return float(next(step * power for step in (1.0, 2.0, 5.0, 10.0) if step * power >= division))
