"""Whether a recording is fit for use: quantisation, delays, filters, re-zeroed encoders, signs and units.

These artefacts look like physics. The room uses channels and the masses of the model, and no effect of the
catalogue.
"""
