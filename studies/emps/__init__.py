"""EMPS (Janot, Gautier, Brunot 2019): the reference of a real axis, run by our law on the simulated axis."""
