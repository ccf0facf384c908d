"""Verdicts as text and figures: on the terminal, and as HTML files that open without a network.

Everything here formats results of other rooms and computes none. The pages of `reconcile watch` and
`reconcile fleet` are made of the same figures (`traces`), cards and page (`html_page`).
"""
