"""Units of files and of the command line, in SI."""

MM = 1e-3
"""Metres in a millimetre."""
UM = 1e-6
"""Metres in a micrometre."""
MM_MIN = 1e-3 / 60.0
"""Metres per second in a millimetre per minute."""
