"""`reconcile fleet` on a scheduler and workers of their own, reading from an S3 server: `make test-fleet`."""
