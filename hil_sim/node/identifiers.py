"""CAN identifiers that a client may write to COB-ID objects of PDO, SYNC, TIME and EMCY (CiA 301)."""

from hil_sim.node.sdo_abort import AbortCode, SdoAbort

EXTENDED_FRAME = 0x2000_0000
PRODUCES_SYNC = 0x4000_0000
RESTRICTED = (
    range(0x080),  # NMT and reserved
    range(0x101, 0x181),
    range(0x581, 0x600),  # SDO responses
    range(0x601, 0x680),  # SDO requests
    range(0x6E0, 0x800),  # heartbeats and reserved
)


def check_identifier(cob_id: int) -> None:
    """Refuse extended frames and identifiers that belong to other services. Raises SdoAbort."""
    if cob_id & EXTENDED_FRAME or any(cob_id & 0x7FF in span for span in RESTRICTED):
        raise SdoAbort(AbortCode.VALUE_OUT_OF_RANGE)


def check_sync(_subindex: int, cob_id: int) -> None:
    """Refuse what `check_identifier` refuses, and to produce the SYNC: the master does. Raises SdoAbort."""
    check_identifier(cob_id)
    if cob_id & PRODUCES_SYNC:
        raise SdoAbort(AbortCode.VALUE_OUT_OF_RANGE)
