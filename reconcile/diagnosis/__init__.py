"""`reconcile diagnose`: call the rooms below in order, from files to verdict; no inference of its own."""
