"""Recordings of any format as one table of columns, and as channels of axes in SI; one library per file.

Nothing here checks or resamples values; an unreadable file raises ReconcileError with the remedy.
"""
