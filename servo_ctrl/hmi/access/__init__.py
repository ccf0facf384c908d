"""Who may see the page and who may act: tokens, roles, log-in, and the right to control. No NiceGUI here."""
