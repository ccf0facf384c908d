"""The proof of a diagnosis: how well its written model predicts recordings that took no part in it.

`prove` leaves recordings out and chooses among `model_variants`; `written_model` gives the residual of a file
as it is read; `simulated_model` drops terms that a fit finds in a simulation of the nominal model itself.
"""
