"""Which terms a residual channel needs: cross-validation, stepwise selection, acceptance, unnamed terms.

`stepwise_selection` adds and drops terms by the tests of `acceptance`; `predictive_terms` withdraws effects
that do not predict a recording that was left out. Parameters and intervals follow in `identification`.
"""
