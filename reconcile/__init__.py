"""Find the physics that a simulation left out: recordings and a model in, a verdict and a repaired model out.

Each room may import the rooms below it: cli; examples, trials, fleet, watch, loop; diagnosis; report; design;
model_update; replay; location; identification; selection; regression; nominal_model; sensing; recording;
catalogue; formats.
"""
