"""Blind trials: diagnose generated cases whose truth is sealed, score the verdicts, publish a page."""
