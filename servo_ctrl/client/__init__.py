"""A running controller from another program: commands, settings and status by SDO, asynchronous and blocking.

May enter: what a caller uses; the objects themselves are declared in `servo_ctrl.commands`.
"""
