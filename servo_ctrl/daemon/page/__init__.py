"""The operator's page beside a run: its process, its local socket, and its data of bus and nodes."""
