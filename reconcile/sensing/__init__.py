"""Whether a recording is fit for use: quantisation, delays, filters, re-zeroed encoders, signs and units.

Here is what only looks like physics. Channels and the model's masses enter; no effect of the catalogue does.
"""
