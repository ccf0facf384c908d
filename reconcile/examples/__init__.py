"""`reconcile example`: diagnose data sets that others have published: EMPS and ODrive."""
