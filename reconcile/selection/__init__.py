"""Which terms a residual channel needs: cross-validation, stepwise selection, acceptance, unnamed terms.

Decisions are made here and nowhere else; parameters and names follow in `identification`.
"""
