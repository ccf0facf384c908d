"""Values of status fields in the words of `servo-ctrl ask status`."""

from servo_ctrl.units import MM, UM


def on_off(on: bool) -> str:
    """A switch."""
    return "on" if on else "off"


def yes_no(yes: bool) -> str:
    """A fact."""
    return "yes" if yes else "no"


def micrometres(value_m: float) -> str:
    """A deviation."""
    return f"{value_m / UM:.2f}"


def millimetres(value: float) -> str:
    """A length, velocity or acceleration."""
    return f"{value / MM:g}"


def version(number: int) -> str:
    """A version of what was learned; 0 is none."""
    return f"version {number}" if number else "none"


def minute(date: str) -> str:
    """An ISO 8601 date without its seconds."""
    return date[:16]
