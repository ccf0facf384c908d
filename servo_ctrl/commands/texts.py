"""Formats values of status fields for `servo-ctrl ask status`."""

from servo_ctrl.units import MM, UM


def on_off(on: bool) -> str:
    """Format a switch."""
    return "on" if on else "off"


def yes_no(yes: bool) -> str:
    """Format a condition."""
    return "yes" if yes else "no"


def micrometres(value_m: float) -> str:
    """Format a deviation in micrometres."""
    return f"{value_m / UM:.2f}"


def millimetres(value: float) -> str:
    """Format a length, velocity or acceleration in millimetres, mm/s or mm/s^2."""
    return f"{value / MM:g}"


def version(number: int) -> str:
    """Format the version of a learned result; 0 is none."""
    return f"version {number}" if number else "none"


def minute(date: str) -> str:
    """Format an ISO 8601 date without its seconds."""
    return date[:16]
