"""What all pages share: head and foot, what a visitor may ask for, cards, tables, plots, units and colours.

Nothing of a single page enters here.
"""
