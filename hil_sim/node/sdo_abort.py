"""The SDO abort codes of CiA 301, table 22, that the devices use, and the exception that carries one."""

from enum import IntEnum


class AbortCode(IntEnum):
    """Why a transfer was refused or aborted."""

    TOGGLE_NOT_ALTERNATED = 0x0503_0000
    TIMED_OUT = 0x0504_0000
    INVALID_COMMAND = 0x0504_0001
    INVALID_BLOCK_SIZE = 0x0504_0002
    INVALID_SEQUENCE_NUMBER = 0x0504_0003
    CRC_ERROR = 0x0504_0004
    OUT_OF_MEMORY = 0x0504_0005
    READ_OF_WRITE_ONLY = 0x0601_0001
    WRITE_OF_READ_ONLY = 0x0601_0002
    NO_SUCH_OBJECT = 0x0602_0000
    CANNOT_BE_MAPPED = 0x0604_0041
    PDO_LENGTH_EXCEEDED = 0x0604_0042
    PARAMETER_INCOMPATIBLE = 0x0604_0043
    LENGTH_MISMATCH = 0x0607_0010
    TOO_LONG = 0x0607_0012
    TOO_SHORT = 0x0607_0013
    NO_SUCH_SUBINDEX = 0x0609_0011
    VALUE_OUT_OF_RANGE = 0x0609_0030
    VALUE_TOO_HIGH = 0x0609_0031
    VALUE_TOO_LOW = 0x0609_0032
    RESOURCE_NOT_AVAILABLE = 0x060A_0023
    GENERAL_ERROR = 0x0800_0000
    CANNOT_STORE = 0x0800_0020
    WRONG_DEVICE_STATE = 0x0800_0022
    NO_DATA = 0x0800_0024


class SdoAbort(Exception):  # noqa: N818  # the term of CiA 301: an answer to the client, no error of the program
    """Ends the transfer in progress with `code`; the owner of an object raises it to refuse an access."""

    def __init__(self, code: AbortCode) -> None:
        super().__init__(f"abort code {code:08X}h, {code.name.lower().replace('_', ' ')}")
        self.code = code


def wrong_length(found: int, wanted: int) -> SdoAbort:
    """Return the abort of a transfer with `found` bytes (or bits) instead of `wanted`."""
    return SdoAbort(AbortCode.TOO_LONG if found > wanted else AbortCode.TOO_SHORT)
