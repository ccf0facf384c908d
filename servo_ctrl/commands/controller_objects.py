"""Objects of the controller's own node besides status fields: commands, and the reason of a refusal."""

from servo_ctrl.commands.command import Command
from servo_ctrl.commands.field import AXES, DataType, Entry, Field

PRODUCT_CODE = (0x1018, 2)
STATUS_TPDO, STATUS_MAPPING = 0x1800, 0x1A00
LAST_ERROR, LEARNING = 0x2001, 0x2110
COMMAND, AXIS_SELECTION, SETTINGS, REFUSAL, AXIS_COMMAND = 0x2100, 0x2101, 0x2104, 0x2105, 0x2106
SWITCHES = {
    0x2102: (Command.DISABLE_COMPENSATION, Command.ENABLE_COMPENSATION),
    0x2103: (Command.DISABLE_OBSERVER, Command.ENABLE_OBSERVER),
    0x2107: (Command.DISABLE_SCREW, Command.ENABLE_SCREW),
    0x2108: (Command.DISABLE_WAVEFORM, Command.ENABLE_WAVEFORM),
}
"""The commands that a write of 0 and of 1 to the subindex of an axis gives."""
RECORDS = {
    0x2102: "Compensation enabled",
    0x2103: "Observer enabled",
    0x2104: "Settings",
    0x2107: "Screw compensation enabled",
    0x2108: "Waveform enabled",
    0x2110: "Learning",
    0x2113: "Summary of monitoring",
    0x2121: "Monitoring",
    0x2131: "Result",
    0x2141: "Functions",
    0x2151: "Screw",
    0x2161: "Screw table",
    0x2171: "Waveform",
}
"""Titles of the objects that have subindices; those of axis 1 represent those of every axis."""

_WORDS = ", ".join(f"{command.value} {command.word}" for command in Command)
FIELDS = (
    Field("Controller error", Entry(LAST_ERROR, 0, DataType.TEXT), "The last error, as in the log."),
    Field(
        "Command", Entry(COMMAND, 0, DataType.U8, writable=True), f"{_WORDS}. Reads as the last one accepted."
    ),
    Field(
        "Axis selection",
        Entry(AXIS_SELECTION, 0, DataType.U8, writable=True, low=0, high=AXES),
        "The axis of the commands that follow, 0 = all.",
    ),
    Field("Reason of the last refusal", Entry(REFUSAL, 0, DataType.TEXT), "In words."),
    Field(
        "Axis and command",
        Entry(AXIS_COMMAND, 0, DataType.U16, writable=True),
        "A command and its axis in one transfer: the axis in the upper byte, 0 = all, the command of 2100h "
        "in the lower. Reads as the last one accepted.",
    ),
)
