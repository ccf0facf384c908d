"""Paths of lines and arcs with look-ahead: corners smoothed in a tolerance, as fast as the axes allow."""
