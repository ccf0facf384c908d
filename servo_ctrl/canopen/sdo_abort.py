"""SDO abort codes of CiA 301 (table 22) as our server uses them."""

from enum import IntEnum


class AbortCode(IntEnum):
    """Why a transfer was refused or broken off."""

    TOGGLE_NOT_ALTERNATED = 0x0503_0000
    INVALID_COMMAND = 0x0504_0001
    """Command specifier not valid, also block transfer, which we do not have."""
    READ_OF_WRITE_ONLY = 0x0601_0001
    WRITE_OF_READ_ONLY = 0x0601_0002
    NO_SUCH_OBJECT = 0x0602_0000
    TOO_LONG = 0x0607_0012
    TOO_SHORT = 0x0607_0013
    NO_SUCH_SUBINDEX = 0x0609_0011
    INVALID_VALUE = 0x0609_0030
    VALUE_TOO_HIGH = 0x0609_0031
    VALUE_TOO_LOW = 0x0609_0032
    CANNOT_STORE = 0x0800_0020
    WRONG_DEVICE_STATE = 0x0800_0022
    NO_DATA = 0x0800_0024
    """An empty string or table: SDO has no upload of nothing."""


class SdoAbort(Exception):  # noqa: N818  # CiA 301 calls it so; it is an answer, not an error of ours
    """Ends the transfer in progress with `code`."""

    def __init__(self, code: AbortCode) -> None:
        self.code = code
        super().__init__(f"{code:08X}h {code.name}")
