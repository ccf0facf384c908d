"""The local socket, by which page and command line communicate with the daemon."""
