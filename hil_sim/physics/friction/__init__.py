"""Friction: levels, damping, their change with use, and the presliding laws. One effect, one file."""
