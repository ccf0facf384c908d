"""Recordings: channels, recorder, reader, and the logs beside them. Files appear whole or not at all."""
