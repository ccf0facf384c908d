"""Recordings as evenly sampled, complete pieces: time column, gaps, jumps, and the kinematics of the motion.

Files enter through `formats`; no physics and no model enters here.
"""
