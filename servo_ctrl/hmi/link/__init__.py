"""The page's end of the local socket: the connection, and the newest rows. No NiceGUI here."""
