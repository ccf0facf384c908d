"""Tuning of an axis: excite, measure the frequency response, propose gains and filters, prove them.

What computes takes arrays and gives arrays; `session` alone runs the machine. It sees the controller's side
only: the machine file, and what came over the bus.
"""
