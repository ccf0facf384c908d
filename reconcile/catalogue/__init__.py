"""The catalogue of physics that a simulation may have left out: one effect, one file."""
