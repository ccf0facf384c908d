"""The published studies: plan, run, figures, plots. They see everything, and nothing imports them.

`servo-ctrl experiment` finds them by the entry-point group `servo_ctrl.studies`. They share `twin_axis`.
"""
