"""The seeds of blind trials: those that calibrate, and those that are scored."""

FIRST_SCORED_SEED = 100_000
"""Below it are the seeds that thresholds and calibration come from; they are never scored."""
