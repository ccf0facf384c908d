"""Evaluates machine errors from recordings: circles, contour error, ISO 230-2, and loop margins."""
