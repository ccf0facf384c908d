"""Units of files and of the command line, in SI."""

import re

MM = 1e-3
"""Metres in a millimetre."""
UM = 1e-6
"""Metres in a micrometre."""
MM_MIN = 1e-3 / 60.0
"""Metres per second in a millimetre per minute."""
_MICROMETRES = re.compile(r"(?<=\d )um\b")


def with_signs(text: str) -> str:
    """Return a message with the signs of its units: a log has um and /s^2, a reader µm and /s²."""
    return _MICROMETRES.sub("\N{MICRO SIGN}m", text).replace("/s^2", "/s\N{SUPERSCRIPT TWO}")
