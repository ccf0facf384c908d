"""Experiments: the daemon against a simulated machine, held against published or measured figures."""
