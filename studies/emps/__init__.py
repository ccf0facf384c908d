"""EMPS (Janot, Gautier, Brunot 2019): a real axis' reference through our law and the simulated axis."""
