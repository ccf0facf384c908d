"""Friction: levels, damping, and the presliding laws that distribute them. One effect, one file."""
