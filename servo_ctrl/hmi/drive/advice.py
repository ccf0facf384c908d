"""Advice for faults: one table by error code, one by the controller's reason for a stop.

The codes are those of emergency messages and of object 603Fh (CiA 301, CiA 402), by their first hexadecimal
digits: the longest entry that fits counts, so that a code without an entry gets the advice of its class.
"""

from typing import NamedTuple


class Advice(NamedTuple):
    """A problem in plain words, and what the operator can do about it."""

    problem: str
    remedy: str


CODES: dict[str, Advice] = {
    "1": Advice("Fault without further detail", "Read the drive's own display; then Enable."),
    "2": Advice(
        "Too much current",
        "Let the drive cool. Look for something that blocks the axis; check motor cable and connectors.",
    ),
    "231": Advice(
        "Overloaded for too long",
        "Let it cool. Look for heavy going: lubrication, way covers, clamping; then lower the acceleration.",
    ),
    "232": Advice(
        "Short circuit or earth fault",
        "Switch the mains off. Have motor and motor cable measured before Enable.",
    ),
    "3": Advice("Supply voltage out of range", "Check mains, fuses and supply; then Enable."),
    "321": Advice(
        "DC link voltage too high", "Check the brake resistor; brake more gently (acceleration limit)."
    ),
    "322": Advice(
        "DC link voltage too low", "Is the power supply on, the emergency stop released? Then Enable."
    ),
    "4": Advice("Too hot", "Let it cool. Check fan, filters and the room's temperature."),
    "5": Advice(
        "The drive's hardware", "Switch the drive off and on again. If it comes back, have it repaired."
    ),
    "6": Advice(
        "The drive's software or its parameters", "Switch the drive off and on again; compare its parameters."
    ),
    "7": Advice("A module at the drive", "Check the plug-in modules and their cables."),
    "712": Advice("The motor", "Check motor cable, brake and temperature sensor."),
    "73": Advice(
        "Position sensor",
        "Check the encoder's cable and connector. Home again afterwards; do not trust the position.",
    ),
    "75": Advice("Communication of a module", "Check its cable and its settings."),
    "8": Advice("The drive's monitoring", "See the line below for the detail; then Enable."),
    "81": Advice(
        "CAN communication", "Check bus cable, both terminating resistors (120 ohm) and the bus load."
    ),
    "811": Advice("CAN messages were lost", "Check the bus load (page Bus) and the cable's shield."),
    "812": Advice("Too many errors on the bus", "Check cable, terminating resistors, bit rate."),
    "813": Advice(
        "It does not hear the controller",
        "Did the controller restart? Else check the bus cable; then Enable.",
    ),
    "814": Advice(
        "It was thrown off the bus and has come back", "Check cable and terminating resistors; then Enable."
    ),
    "815": Advice("Two nodes use the same identifier", "Give each node a number of its own."),
    "82": Advice(
        "A message was not as agreed", "Compare the node's settings and firmware with the machine file."
    ),
    "825": Advice(
        "Set points did not come in time", "Check the load of the bus and of the controller's computer."
    ),
    "83": Advice("Torque control", "Look for something that blocks the axis; check the motor's data."),
    "84": Advice("Velocity control", "Check encoder and coupling; the axis may have been too fast."),
    "85": Advice("Position control", "Check coupling and encoder; then Enable."),
    "86": Advice("Positioning", "Check the travel and home again."),
    "8611": Advice(
        "The axis did not follow",
        "Is it blocked, clamped or too heavy? Move it free, then Enable. If it comes back, go more slowly.",
    ),
    "8612": Advice("A limit switch", "Enable, and jog away from the limit."),
    "9": Advice(
        "A fault from outside", "Check the devices wired to the drive's inputs: guards, enabling switch."
    ),
    "F": Advice("The maker's own fault", "Look the code up in the drive's manual."),
}
"""By the first hexadecimal digits of the error code."""
UNKNOWN_CODE = Advice("An error code that no standard has", "Look it up in the drive's manual.")

RUNS_AWAY = Advice(
    "An axis ran away",
    "Do not Enable. Check the signs of encoder, scale and motor phases, then restart the controller.",
)
SILENT_NODE = Advice("A node is silent", "Has it power? Check its bus cable and connector, then Enable.")
REASONS: tuple[tuple[str, Advice], ...] = (
    ("runs away", RUNS_AWAY),
    ("gets faster while its drive brakes", RUNS_AWAY),
    (
        "were missing just before",
        Advice(
            "The computer or the bus was too slow to lead the axis",
            "End other programs on the computer, look at the load on page Bus; then Enable.",
        ),
    ),
    ("following error", CODES["8611"]),
    (
        "beyond limits.position_mm",
        Advice(
            "The axis left its travel",
            "Enable, and jog it back. Then look at the program's start and extents.",
        ),
    ),
    (
        "limit switch",
        Advice(
            "The axis has reached a limit switch",
            "Home is not where it was, or the switch is faulty: find out why. Enable, jog away, home again.",
        ),
    ),
    (
        "encoder and scale are",
        Advice(
            "Encoder and scale do not agree",
            "Check the scale, its head and cable, and the coupling of the motor. Enable, then home again.",
        ),
    ),
    (
        "force at its limit",
        Advice(
            "The axis pushes with all its force",
            "Is something in its way, or is it too heavy? Free it, or go more slowly; then Enable.",
        ),
    ),
    (
        "answers a SYNC twice",
        Advice(
            "Two nodes use the same identifier",
            "Give each node a number of its own; disconnect what was added last. Then Enable.",
        ),
    ),
    (
        "which is not its mapping",
        Advice(
            "A node sends messages of another length",
            "Find who sends them. Enable; if it comes back, restart the controller, which sets nodes anew.",
        ),
    ),
    (
        "somebody else writes",
        Advice(
            "Somebody else has changed a node's settings",
            "Disconnect the other tool, then restart the controller, which sets the node anew.",
        ),
    ),
    ("cyclic inputs do not come", SILENT_NODE),
    ("no heartbeat", SILENT_NODE),
    (
        "has restarted",
        Advice("A node has restarted", "Check its supply. It lost its settings: restart the controller."),
    ),
    (
        "left NMT operational",
        Advice(
            "A node was taken out of operation", "Is another tool on the bus? Then restart the controller."
        ),
    ),
    (
        "ticks were missed",
        Advice(
            "The controller's computer was too busy", "End other programs on it; see page Bus. Then Enable."
        ),
    ),
    (
        "homing",
        Advice(
            "Homing did not come to its end", "Check the reference switch and that the axis moves freely."
        ),
    ),
    (
        "another controller",
        Advice(
            "Somebody else commands on this bus", "Disconnect the other controller, then restart this one."
        ),
    ),
    ("frames", Advice("Messages were lost", "Check the bus load (page Bus) and the interface; then Enable.")),
    (
        "bus",
        Advice(
            "The bus is down", "Check adapter, cable and terminating resistors, then restart the controller."
        ),
    ),
    (
        "set point is not a number",
        Advice("An error in the controller", "Keep the recording and report it. Enable starts anew."),
    ),
    (
        "beyond the limit",
        Advice("The program leaves the limits", "Change it on page Motion, then start again."),
    ),
    (
        "its axis moves",
        Advice("An axis does not come to rest", "Something moves it, or it sinks: see to that, then Enable."),
    ),
    (
        "the drive",
        Advice("A drive gave up", "Look at the drive's own display and the line below; then Enable."),
    ),
)
"""By a part of the controller's reason; the first entry whose part occurs in the reason counts."""
UNKNOWN_REASON = Advice(
    "The machine has stopped", "Read the events below; when the cause is removed, Enable."
)


def advice_for_code(code: int) -> Advice:
    """The advice for an error code of 16 bits."""
    digits = f"{code:04X}"
    found = (CODES.get(digits[:length]) for length in range(len(digits), 0, -1))
    return next((advice for advice in found if advice is not None), UNKNOWN_CODE)


def advice_for_reason(reason: str) -> Advice:
    """The advice for the reason of a stop, in the controller's words."""
    return next((advice for part, advice in REASONS if part in reason), UNKNOWN_REASON)
