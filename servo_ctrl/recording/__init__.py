"""Recordings: channels, recorder, reader, and the logs beside them. Files appear complete or not at all."""
