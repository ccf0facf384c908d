"""What every page of the operator's bench has in hand: the machine, who may do what, and where files are."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

from servo_ctrl.config.desk import COMMANDS
from servo_ctrl.config.desk_rights import Right, needed_for
from servo_ctrl.config.local_messages import Answer, Who
from servo_ctrl.hmi.access import Role
from servo_ctrl.hmi.notices import tell
from servo_ctrl.hmi.sessions import Sessions
from servo_ctrl.hmi.units import MM, Units

if TYPE_CHECKING:
    from pathlib import Path

    from servo_ctrl.config.local_messages import Do
    from servo_ctrl.hmi.access import Access
    from servo_ctrl.hmi.control_right import ControlRight
    from servo_ctrl.hmi.machine_link import MachineLink

QUICK_STOP = "quick_stop"
"""The one command that needs neither a role above view nor the control right."""
ROLE_OF: dict[Right, Role] = {
    Right.STOP: Role.VIEW,
    Right.OPERATE: Role.OPERATE,
    Right.CONFIGURE: Role.CONFIGURE,
}
NEEDED_BESIDE: dict[Do, Role] = {
    "jog": Role.OPERATE,
    "load_program": Role.OPERATE,
    "read_object": Role.VIEW,
    "write_object": Role.CONFIGURE,
    "clear_counters": Role.OPERATE,
    "take_control": Role.OPERATE,
    "release_control": Role.OPERATE,
}
"""Of what is neither a command nor a setting: those are in `config.desk_rights`, for MQTT as well."""
WITHOUT_CONTROL = frozenset({"read_object", "take_control", "release_control"})
"""What only looks, or tells who has it."""


LOGIN_ENDED = "Your login has ended. Log in again."


class Directories(NamedTuple):
    """Where the page finds and leaves files, on the controller's side."""

    recordings: Path
    """Captures and jobs of the page are written here, and recordings are looked for."""
    programs: Path | None = None
    """Motion programs; None: `programs` beside the machine file."""


@dataclass
class Visitor:
    """Who looks at a page; one for every page that is open."""

    user: str
    role: Role
    address: str
    browser: str
    """Of the browser: all its pages have the same one, and share the control right."""
    session: str = ""
    """Secret of their login; "" where none is needed."""
    units: Units = field(default=MM)
    dark: bool = False

    @property
    def who(self) -> Who:
        """As the machine notes them."""
        return Who(user=self.user[:64], role=self.role.word, address=self.address[:64])


@dataclass
class Bench:
    """One for the whole process."""

    link: MachineLink
    access: Access
    control: ControlRight
    directories: Directories
    sessions: Sessions = field(init=False)

    def __post_init__(self) -> None:
        """Nobody is logged in yet."""
        self.sessions = Sessions(self.access)


def role_of(bench: Bench, visitor: Visitor) -> Role | None:
    """What a visitor may do now; None when their login has ended or their token was taken away.

    Not what they might when their page was built: a page may stay open for days.
    """
    if bench.access.login_needed:
        entry = bench.sessions.entry_of(visitor.session, time.monotonic())
        if entry is None:
            return None
        visitor.role = entry.role
    return visitor.role


def needed_role(do: Do, command: str = "") -> Role:
    """Who may ask for this; a command that does not exist is refused by the machine, in its words."""
    match do:
        case "setting":
            return ROLE_OF[needed_for(None)]
        case "command":
            known = COMMANDS.get(command)
            return Role.OPERATE if known is None else ROLE_OF[needed_for(known)]
    return NEEDED_BESIDE[do]


def refusal(bench: Bench, visitor: Visitor, do: Do, fields: dict[str, Any]) -> str:
    """Why this visitor may not ask for this now; "" when they may."""
    command = str(fields.get("command") or "")
    role = role_of(bench, visitor)
    if role is None:
        return LOGIN_ENDED
    needed = needed_role(do, command)
    if role < needed:
        return f"This needs the role {needed.word}; yours is {role.word}."
    if do in WITHOUT_CONTROL or (do == "command" and command == QUICK_STOP):
        return ""
    now_s = time.monotonic()
    if not bench.control.held_by(visitor.browser, now_s):
        holder = bench.control.holder(now_s)
        where = "Take it first, in the head of the page."
        return f"{holder.user} has control. {where}" if holder else f"Nobody has control. {where}"
    return ""


async def ask(bench: Bench, visitor: Visitor, do: Do, *, quiet: bool = False, **fields: Any) -> Answer | None:
    """Ask the machine for something, and tell the visitor why it was refused. None: it was not sent.

    `fields` are those of `config.local_messages.Request`. `quiet` leaves the telling to the caller.
    """
    if reason := refusal(bench, visitor, do, fields):
        if not quiet:
            tell(reason)
        return None
    answer = await bench.link.request(visitor.who, do, **fields)
    if not answer.accepted and not quiet:
        tell(answer.reason or f"Refused: {answer.refusal}.")
    return answer
