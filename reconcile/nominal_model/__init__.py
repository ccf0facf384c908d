"""The nominal model: its file, its axes, and its effects as terms of the catalogue."""
