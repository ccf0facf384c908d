"""The next experiment: the motion with the largest expected evidence on the open questions of a diagnosis.

Motions are planned as servo_ctrl plans them, within the limits of the axis; nothing here moves it.
"""
