"""Paths of lines and arcs with look-ahead: corners rounded within a tolerance, as fast as the axes allow."""
