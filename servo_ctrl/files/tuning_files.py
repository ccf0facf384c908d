"""Names in the directory of a tuning, which `servo-ctrl tune` writes and the page reads."""

REPORT_FILE = "report.html"
MACHINE_SECTIONS_FILE = "tuned.toml"
FIGURES_FILE = "tune.json"
BODE_FILE = "bode.json"
VELOCITY_LOOP = "velocity loop, after"
"""The curve of BODE_FILE that is a part of the loop only, so that its 1 / (1 + L) is no sensitivity."""
