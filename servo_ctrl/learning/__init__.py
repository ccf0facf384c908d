"""Learning: pulse functions from reversals, screw tables from travels. Asks for strokes, moves no axis."""
