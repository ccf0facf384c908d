"""Channels and states of drives in the operator's words, with the name of CiA 402 or 406 in small print."""

from typing import NamedTuple

from servo_ctrl.hmi.languages.texts import tr, word


class ChannelTitle(NamedTuple):
    """What an operator calls a channel."""

    words: str
    standard: str = ""
    """Name and object of CiA 402 or CiA 406; "" where a channel is our own."""


TITLES = {
    "time_s": ChannelTitle(word("time of the run")),
    "cycle": ChannelTitle(word("cycle number")),
    "segment": ChannelTitle(word("step of the program")),
    "position_command_m": ChannelTitle(word("commanded position"), "position demand value, 6062h"),
    "velocity_command_m_s": ChannelTitle(word("commanded velocity"), "velocity demand value, 606Bh"),
    "motor_position_m": ChannelTitle(word("motor position"), "position actual value, 6064h"),
    "scale_position_m": ChannelTitle(word("scale position"), "position value, 6004h"),
    "motor_velocity_m_s": ChannelTitle(word("motor velocity"), "velocity actual value, 606Ch"),
    "force_command_n": ChannelTitle(word("commanded force"), "target torque, 6071h"),
    "motor_current_a": ChannelTitle(word("motor current"), "current actual value, 6078h"),
    "position_error_m": ChannelTitle(word("following error"), "following error actual value, 60F4h"),
    "pulse_m_s": ChannelTitle(word("friction pulse")),
    "disturbance_n": ChannelTitle(word("observed disturbance")),
    "correction_m": ChannelTitle(word("screw correction")),
    "statusword": ChannelTitle(word("state of the drive"), "statusword, 6041h"),
}
"""By the channel's name without its axis; a test holds them against `recording.channels`."""

DRIVE_STATES = {
    "not ready to switch on": word("starts up"),
    "switch on disabled": word("off, locked"),
    "ready to switch on": word("off"),
    "switched on": word("on, without control"),
    "operation enabled": word("under control"),
    "quick stop active": word("quick stop"),
    "fault reaction active": word("fault, brakes"),
    "fault": word("fault"),
}
"""By the state of CiA 402; a test holds them against `cyclic.cia402.DriveState`."""
PHASES = {
    "taking over": word("taken over"),
    "waiting for rest": word("comes to rest"),
    "switching on": word("switches on"),
    "homing": word("homing"),
    "settling": word("settles"),
    "servo": word("controlled"),
    "quick stopping": word("brakes"),
    "disabling": word("switches off"),
    "off": word("off"),
    "lost": word("lost"),
}
"""By the phase of a drive's sequence; a test holds them against `cyclic.drive_phases.PHASE_TEXTS`."""


def channel_title(name: str) -> str:
    """Return the words for a channel, as `X following error`; its name where it has none."""
    axis, _, ending = name.rpartition(".")
    title = TITLES.get(ending)
    if title is None:
        return name
    return f"{axis.upper()} {tr(title.words)}".strip()


def channel_small_print(name: str) -> str:
    """Return a channel's standard name and column in recordings, as `statusword, 6041h; x.statusword`."""
    title = TITLES.get(name.rpartition(".")[2])
    return f"{title.standard}; {name}" if title and title.standard else name


def drive_state(state: str) -> str:
    """Return the words for a state of CiA 402; the state itself where it is none of them."""
    return tr(DRIVE_STATES.get(state, state))
