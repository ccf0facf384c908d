"""The Bus page: load, cycle times, nodes, emergency messages, and the object dictionary of each node."""
