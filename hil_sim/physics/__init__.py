"""The physics that a plant can have: one effect, one file, in the room of where it acts.

A file holds the law with its source, `Params` with units and bounds, `State` where it has memory, and its
neutral value; `kinds` says how the plant composes it. Values and compiled functions only.
"""
