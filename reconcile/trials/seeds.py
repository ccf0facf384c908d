"""The seeds of blind trials: those that calibrate, and those that are scored."""

FIRST_SCORED_SEED = 100_600
"""Below it are seeds that were looked at: thresholds and calibration come from some of them, and
earlier engines were scored on 100000 to 100599. They are not scored again."""
