"""Friction: levels, damping, their change, and the presliding laws. One effect, one file."""
