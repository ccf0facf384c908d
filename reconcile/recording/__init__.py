"""Recordings as evenly sampled, complete pieces: time column, gaps, jumps, and the kinematics of the motion.

Files enter through `formats`; this room uses no physics and no model.
"""
