"""`reconcile example`: diagnoses published data sets of real axes."""
