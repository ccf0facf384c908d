"""Whether a temperature that was read can be trusted; where it cannot, what depends on it stands still."""

import math
from typing import NamedTuple

RANGE_DEGC = (-40.0, 150.0)
"""Plausible temperatures of a machine; chosen: beyond them a sensor or its wire is broken."""
JUMP_K = 3.0
"""Largest plausible change between two readings, a second apart; chosen: a guide weighs kilograms."""
AGREEING = 3
"""Readings without a jump after which a temperature is trusted again; chosen."""


class TemperatureInput(NamedTuple):
    """A temperature, as far as it is known."""

    degc: float = math.nan
    """The temperature; NaN while there is none that can be trusted."""
    reason: str = "has not been read yet"
    """Why there is none; "" if there is one."""
    last_degc: float = math.nan
    """The last reading within `RANGE_DEGC`; NaN before the first."""
    agreeing: int = AGREEING
    """Readings since the last jump."""


def after_reading(before: TemperatureInput, degc: float) -> TemperatureInput:
    """Input after a reading; NaN is no reading."""
    low_degc, high_degc = RANGE_DEGC
    if not low_degc <= degc <= high_degc:
        return without_reading(before, f"{degc:g} degC is not within {low_degc:g} to {high_degc:g}")
    if abs(degc - before.last_degc) > JUMP_K:
        reason = f"has jumped from {before.last_degc:.1f} to {degc:.1f} degC"
        return TemperatureInput(reason=reason, last_degc=degc, agreeing=0)
    agreeing = min(before.agreeing + 1, AGREEING)
    if agreeing < AGREEING:
        return before._replace(last_degc=degc, agreeing=agreeing)
    return TemperatureInput(degc, "", degc)


def without_reading(before: TemperatureInput, reason: str) -> TemperatureInput:
    """Input after a reading that failed for a reason."""
    return before._replace(degc=math.nan, reason=reason)
