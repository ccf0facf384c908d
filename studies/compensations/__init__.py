"""Every compensation on every machine: the figures of the decision table."""
