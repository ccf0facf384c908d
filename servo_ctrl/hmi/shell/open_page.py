"""What a page works with: the services of the process, who has the page open, and what they may ask for."""

import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from servo_ctrl.commands.command import COMMANDS, Right
from servo_ctrl.commands.local_messages import Do, Hello, LocalAnswer, Who
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.hmi.access.control_right import ControlRight
from servo_ctrl.hmi.access.sessions import Sessions
from servo_ctrl.hmi.access.users import Access, Role
from servo_ctrl.hmi.link.machine_link import MachineLink
from servo_ctrl.hmi.shell.parts import notify
from servo_ctrl.hmi.shell.units import MM, UnitSystem

QUICK_STOP = "quick_stop"
"""The one command that needs neither a role above view nor the control right."""
ROLE_OF: dict[Right, Role] = {
    Right.STOP: Role.VIEW,
    Right.OPERATE: Role.OPERATE,
    Right.CONFIGURE: Role.CONFIGURE,
}
ROLE_FOR_REQUEST: dict[Do, Role] = {
    "jog": Role.OPERATE,
    "load_program": Role.OPERATE,
    "read_object": Role.VIEW,
    "write_object": Role.CONFIGURE,
    "clear_counters": Role.OPERATE,
    "take_control": Role.OPERATE,
    "release_control": Role.OPERATE,
}
"""For requests that are neither a command nor a setting; `commands.rights` has those, for MQTT as well."""
WITHOUT_CONTROL = frozenset({"read_object", "take_control", "release_control"})
"""Requests that change nothing on the machine and need no control right."""
LOGIN_ENDED = "Your login has ended. Log in again."


class Directories(NamedTuple):
    """Where the pages read and write files on the controller's computer."""

    recordings: Path
    """Captures and diagnoses are written here; recordings are searched here."""
    programs: Path | None = None
    """Motion programs; None: the directory `programs` beside the machine file."""


@dataclass
class PageServices:
    """What all pages of the process share."""

    link: MachineLink
    access: Access
    control: ControlRight
    directories: Directories
    sessions: Sessions = field(init=False)

    def __post_init__(self) -> None:
        """Start without anybody logged in."""
        self.sessions = Sessions(self.access)


@dataclass
class OpenPage:
    """One open page: who looks at it, how it is shown, and what they may ask the machine for."""

    services: PageServices
    user: str
    role: Role
    address: str
    browser: str
    """Cookie of the browser: all its pages share it, and the control right."""
    session: str = ""
    """Secret of the log-in; "" where none is needed."""
    units: UnitSystem = MM
    dark: bool = False

    @property
    def link(self) -> MachineLink:
        """The connection to the controller."""
        return self.services.link

    @property
    def status(self) -> MachineStatus | None:
        """The last status of the controller; None before the first."""
        return self.services.link.status

    @property
    def hello(self) -> Hello | None:
        """The controller's description of itself; None before the first connection."""
        return self.services.link.hello

    @property
    def who(self) -> Who:
        """The visitor as the controller records them."""
        return Who(user=self.user[:64], role=self.role.label, address=self.address[:64])

    def current_role(self) -> Role | None:
        """The visitor's role now; None when their login has ended or their token was revoked.

        A page may stay open for days, so the role at its opening does not count.
        """
        if self.services.access.login_needed:
            owner = self.services.sessions.owner_of(self.session, time.monotonic())
            if owner is None:
                return None
            self.role = owner.role
        return self.role

    def role_refusal(self, needed: Role) -> str:
        """Why the visitor's role does not allow this; "" when it does."""
        role = self.current_role()
        if role is None:
            return LOGIN_ENDED
        return f"This needs the role {needed.label}; yours is {role.label}." if role < needed else ""

    def refusal(self, do: Do, command: str = "") -> str:
        """Why the visitor may not send this request now; "" when they may."""
        if reason := self.role_refusal(needed_role(do, command)):
            return reason
        if do in WITHOUT_CONTROL or (do == "command" and command == QUICK_STOP):
            return ""
        now_s = time.monotonic()
        holder = self.services.control.holder(now_s)
        if holder is not None and holder.browser == self.browser:
            return ""
        return f"{holder.user if holder else 'Nobody'} has control. Take it first, in the head of the page."

    def permits(self, needed: Role) -> bool:
        """Whether the visitor has this role, for what does not go to the machine; notifies them if not."""
        reason = self.role_refusal(needed)
        if reason:
            notify(reason)
        return not reason

    async def ask(self, do: Do, *, quiet: bool = False, **fields: Any) -> LocalAnswer | None:
        """Send a request to the controller; notify the visitor of a refusal. None: it was not sent.

        `fields` are those of `commands.local_messages.LocalRequest`. `quiet` leaves the notice to the caller.
        """
        if reason := self.refusal(do, str(fields.get("command") or "")):
            if not quiet:
                notify(reason)
            return None
        answer = await self.link.request(self.who, do, **fields)
        if not answer.accepted and not quiet:
            notify(answer.reason or f"Refused: {answer.refusal}.")
        return answer

    async def command(self, command: str, axis: str = "") -> None:
        """Send a command, for one axis or for all."""
        await self.ask("command", command=command, axis=axis)


def needed_role(do: Do, command: str = "") -> Role:
    """The role that a request needs; an unknown command needs operate, and the controller refuses it."""
    match do:
        case "setting":
            return ROLE_OF[Right.CONFIGURE]
        case "command":
            known = COMMANDS.get(command)
            return Role.OPERATE if known is None else ROLE_OF[known.right]
    return ROLE_FOR_REQUEST[do]
