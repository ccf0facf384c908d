"""Tuning of an axis: excite it, measure its frequency response, propose gains and filters, verify them.

Computations take arrays and return arrays. Only `machine_runs` moves the machine. The room sees the machine
file and the recordings of its own runs; it never sees the simulated plant.
"""
