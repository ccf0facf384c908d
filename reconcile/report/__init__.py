"""Verdicts as text and figures: on the terminal, and as HTML files that open without a network.

Everything here formats results of other rooms. The pages of `reconcile watch` and `reconcile fleet` consist
of the same figures, tables and page (`html_page`; the file is `servo_ctrl.report.html_file`).
"""
