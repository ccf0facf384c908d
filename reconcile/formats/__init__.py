"""Recordings of any origin as one table of columns, and as channels of axes in SI; one library a file.

Nothing is judged or resampled here; a file that cannot be read raises ReconcileError with the remedy.
"""
