"""The next experiment: the motion with the largest expected evidence on what a diagnosis left open.

Motions are planned as servo_ctrl would and stay within the limits of the axis; nothing here moves it.
"""
