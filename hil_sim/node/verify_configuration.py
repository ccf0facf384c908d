"""Verify configuration 1020h (CiA 301, 7.5.2.23): date and time of the present configuration.

A configuration tool writes both, stores them with 1010h, and compares them after a reset. Any later write of
a stored object resets them to 0.
"""

from hil_sim.node.dictionary import Dictionary

VERIFY = 0x1020
NO_CONFIGURATION = frozenset({VERIFY, 0x1003, 0x1010})
"""Objects whose write changes no configuration; restoring defaults (1011h) does."""


def verify_configuration(dictionary: Dictionary) -> None:
    """Reset 1020h of a node whenever a client changes the configuration."""

    def on_write(index: int, subindex: int) -> None:
        if index not in NO_CONFIGURATION and dictionary.variables[index, subindex].access_type == "rw":
            for member in (1, 2):
                dictionary.put(VERIFY, member, 0)

    dictionary.on_write = on_write
