"""From selected terms to identified effects: refined shape parameters, intervals, rivals, two-mass fit.

Everything here estimates; what is selected is decided in `selection`, what is written in `model_update`.
"""
