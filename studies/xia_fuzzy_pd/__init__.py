"""Xia et al.: PID against fuzzy-PD position control of a table."""
