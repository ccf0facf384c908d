"""The Reconcile page: starts the program `reconcile diagnose`, shows its verdict, and accepts its model."""
