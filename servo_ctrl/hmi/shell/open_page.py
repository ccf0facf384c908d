"""What a page works with: the services of the process, who has the page open, and what they may ask for."""

import time
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from servo_ctrl.commands.command import Command, Right
from servo_ctrl.commands.local_messages import Do, LocalAnswer, Requester, right_for
from servo_ctrl.hmi.access.control_right import ControlRight
from servo_ctrl.hmi.access.sessions import Sessions
from servo_ctrl.hmi.access.users import Access, Role
from servo_ctrl.hmi.languages.controller_messages import controller_text
from servo_ctrl.hmi.languages.texts import ENGLISH, tr, word
from servo_ctrl.hmi.link.machine_link import MachineLink
from servo_ctrl.hmi.shell.parts import notify
from servo_ctrl.hmi.shell.plots import DARK, LIGHT, Look
from servo_ctrl.hmi.shell.units import MM, UnitSystem

ROLE_OF = dict(zip(Right, Role, strict=True))
"""The role that a right needs: both are declared from the least to the greatest."""
CONTROL_CHANGES = frozenset({"take_control", "release_control"})
"""Requests about the control right, which nobody needs to have it for."""
LOGIN_ENDED = word("Your login has ended. Log in again.")


@dataclass
class PageServices:
    """What all pages of the process share."""

    link: MachineLink
    access: Access
    control: ControlRight
    recordings: Path
    """Directory where captures and diagnoses are written, and recordings are searched."""
    programs: Path | None = None
    """Directory of motion programs; None: `programs` beside the machine file."""

    language: str | None = None
    """Language of visitors who have chosen none; None: that of their browser."""

    @cached_property
    def sessions(self) -> Sessions:
        """Return the log-in sessions; nobody is logged in at first."""
        return Sessions(self.access)


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
    language: str = ENGLISH

    @property
    def look(self) -> Look:
        """The units and colours of its figures."""
        return Look(self.units, DARK if self.dark else LIGHT)

    @property
    def link(self) -> MachineLink:
        """The connection to the controller."""
        return self.services.link

    @property
    def who(self) -> Requester:
        """The visitor as the controller records them."""
        return Requester(user=self.user[:64], role=self.role.label, address=self.address[:64])

    def current_role(self) -> Role | None:
        """Return the visitor's role now; None when their login has ended or their token was revoked.

        A page may stay open for days, so the role at its opening does not count.
        """
        if self.services.access.login_needed:
            owner = self.services.sessions.owner_of(self.session, time.monotonic())
            if owner is None:
                return None
            self.role = owner.role
        return self.role

    def role_refusal(self, needed: Role) -> str:
        """Return why the visitor's role does not allow this; "" when it does."""
        role = self.current_role()
        if role is None:
            return tr(LOGIN_ENDED)
        return (
            tr("This needs the role {needed}; yours is {role}.", needed=needed.label, role=role.label)
            if role < needed
            else ""
        )

    def refusal(self, do: Do, command: str = "", setting: str = "") -> str:
        """Return why the visitor may not send this request now; "" when they may."""
        right = right_for(do, command, setting)
        if reason := self.role_refusal(ROLE_OF[right]):
            return reason
        if right is Right.STOP or do in CONTROL_CHANGES:
            return ""
        holder = self.services.control.holder(time.monotonic())
        if holder is not None and holder.browser == self.browser:
            return ""
        if holder is None:
            return tr("Nobody has control. Take it first, in the head of the page.")
        return tr("{user} has control. Take it first, in the head of the page.", user=holder.user)

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
        answer = None
        reason = self.refusal(do, *(str(fields.get(key) or "") for key in ("command", "setting")))
        if not reason:
            answer = await self.link.request(self.who, do, **fields)
            reason = "" if answer.accepted else refusal_text(answer)
        if reason and not quiet:
            notify(reason)
        return answer

    async def command(self, command: Command, axis: str = "") -> None:
        """Send a command, for one axis or for all."""
        await self.ask("command", command=command.name.lower(), axis=axis)


def refusal_text(answer: LocalAnswer) -> str:
    """Return why the controller refused, in the language of the page."""
    return controller_text(answer.reason) or tr("Refused: {refusal}.", refusal=answer.refusal)
