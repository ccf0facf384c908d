"""Learning of pulse functions and waveforms from reversals, and of screw tables from travels.

Functions and generators request strokes and receive results; the daemon or the batch twin makes the strokes.
"""
