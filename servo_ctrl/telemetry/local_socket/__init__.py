"""The local socket: the page's and the CLI's way to the daemon."""
