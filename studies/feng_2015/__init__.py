"""Feng et al. 2015: friction compensation by a learned trapezoidal pulse on an X-Y table."""
