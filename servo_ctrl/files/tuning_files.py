"""Names in the directory of a tuning, and bounds of its Ms, for `servo-ctrl tune` and the page."""

REPORT_FILE = "report.html"
MACHINE_SECTIONS_FILE = "tuned.toml"
FIGURES_FILE = "tune.json"
BODE_FILE = "bode.json"
VELOCITY_LOOP = "velocity loop, after"
"""The curve of BODE_FILE that is a part of the loop only, so that its 1 / (1 + L) is not a sensitivity."""
LEAST_MS, MOST_MS, USUAL_MS = 1.2, 3.0, 2.0
"""Bounds of the sensitivity peak that a tuning may be stated for, and the usual one; 1.4 is cautious."""
