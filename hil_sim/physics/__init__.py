"""The physical effects of a plant: one effect a file, in the room of its place in the axis.

A file holds the law with its source, `Params` with units and bounds, `State` if the effect has memory, and
its neutral value; `kinds` says how the plant composes it. Only values and compiled functions may enter.
"""
