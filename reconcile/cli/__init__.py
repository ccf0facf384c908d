"""The command line of reconcile."""
