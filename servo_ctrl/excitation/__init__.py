"""Motions that excite an axis within its limits, as steps of a program: to measure it, to try a setting."""
