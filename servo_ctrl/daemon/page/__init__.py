"""The operator's page beside a run: its process, its local socket, and what it sees of bus and nodes."""
