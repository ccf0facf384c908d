"""Evaluates machine errors from recordings: circles, contour error, and positioning by ISO 230-2.

May enter: evaluations of a recording or of measured deviations that give figures of the machine.
"""
