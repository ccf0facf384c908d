"""The published studies: plan, run, figures, plots. They may import everything; no package imports them.

`servo-ctrl experiment` finds them by the entry-point group `servo_ctrl.studies`. They share `twin_axis`.
"""
