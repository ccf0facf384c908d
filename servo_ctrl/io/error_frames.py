"""Error frames of SocketCAN (linux/can/error.h): what they say of frames and of the interface."""

from typing import NamedTuple

BUS_OFF = 0x040
CONTROLLER_CLASS = 0x004
RESTARTED, ERROR_ACTIVE = 0x100, 0x40
"""A class, and a bit in byte 1 of class 4, by which an interface reports its return after bus-off."""
ERROR_CLASSES: tuple[tuple[int, str], ...] = (
    (RESTARTED, "controller restarted"),
    (0x020, "no acknowledge on transmission"),
    (0x001, "transmission timed out"),
    (0x002, "arbitration lost"),
    (0x008, "protocol violation"),
    (0x010, "transceiver fault"),
)
"""Error classes, the most severe first."""
OVERRUNS = 0x03
"""Bits in byte 1 of class 4 that mean lost frames."""
CONTROLLER_PROBLEMS: tuple[tuple[int, str], ...] = (
    (0x01, "receive overrun: frames were lost"),
    (0x02, "transmit overrun: frames were lost"),
    (0x30, "error passive"),
    (0x0C, "error warning"),
    (ERROR_ACTIVE, "back to error active"),
)
"""Controller problems, byte 1 of an error frame of class 4, the most severe first."""


class BusNews(NamedTuple):
    """Text for an error frame, and what it says of frames and of the interface."""

    text: str
    frames_lost: bool
    down: bool
    """Bus-off: the interface has left the bus until it is restarted."""
    restarted: bool = False
    """The interface has returned to the bus."""


def describe_error_frame(error_class: int, payload: bytes | bytearray) -> BusNews:
    """Describe an error frame by its most severe part.

    `error_class`: bits of its identifier; `payload`: its eight data bytes.
    """
    if error_class & BUS_OFF:
        return BusNews("bus-off", frames_lost=True, down=True)
    if error_class & CONTROLLER_CLASS and len(payload) > 1:
        for bits, text in CONTROLLER_PROBLEMS:
            if payload[1] & bits:
                lost, active = bool(payload[1] & OVERRUNS), bool(payload[1] & ERROR_ACTIVE)
                return BusNews(text, lost, down=False, restarted=active)
    for bit, text in ERROR_CLASSES:
        if error_class & bit:
            return BusNews(text, frames_lost=False, down=False, restarted=bit == RESTARTED)
    return BusNews(f"error frame of class 0x{error_class:X}", frames_lost=False, down=False)
