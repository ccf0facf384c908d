"""Motion: set points as functions of time, from rest to rest. Pure functions of SI arrays."""
