"""The object browser of the Bus page: the tree of a node's EDS, and reading and writing its entries."""

from pathlib import Path
from typing import Any

from nicegui import run, ui

from servo_ctrl.commands.local_messages import Hello, LocalAnswer
from servo_ctrl.hmi.access.users import Role
from servo_ctrl.hmi.bus.object_tree import ObjectEntry, load_entries, tree_nodes
from servo_ctrl.hmi.bus.object_values import parse_value, request_value, value_text
from servo_ctrl.hmi.languages.texts import tr
from servo_ctrl.hmi.shell.open_page import OpenPage, refusal_text
from servo_ctrl.hmi.shell.parts import (
    ELLIPSIS,
    button,
    card,
    choice,
    confirmed,
    div,
    faint,
    note,
    problem_text,
)

TREE_CSS = """
.q-tree__node--selected .q-tree__node-header-content { color: var(--accent) !important; font-weight: 600; }
@media (pointer: coarse), (max-width: 700px) {
  .q-tree__node-header { min-height: 44px; }
}
"""


class ObjectBrowser:
    """The card of a node's objects."""

    def __init__(self, page: OpenPage, hello: Hello) -> None:
        self._page = page
        self._nodes = {node.node_id: node for node in hello.nodes}
        self._entries: dict[str, ObjectEntry] = {}
        """By address."""
        self._entry: ObjectEntry | None = None
        self._opened: set[str] = set()
        """Branches of the tree that were opened by clicking their names."""
        ui.add_css(TREE_CSS)
        with card(tr("Objects"), "objects"):
            with div("bench-row"):
                names = {node.node_id: f"{node.name} ({node.node_id})" for node in hello.nodes}
                first = next(iter(names), None)
                self._node = choice(names, tr("node"), "object-node", "min-width: 190px", value=first)
                self._node.on_value_change(self._load)
                self._filter = ui.input(tr("filter: name or index")).mark("object-filter")
                self._filter.props("clearable").style("flex: 1 1 180px")
            with div("bench-wide"):
                self._place = div("bench-scroll").style("max-height: 420px; overflow: auto")
                with div("bench-column").props("aria-live=polite"):
                    self._build_details()
        ui.timer(0.0, self._load, once=True)

    def _build_details(self) -> None:
        self._title = ui.label().mark("object-title")
        self._title.style("font-size: 16px; font-weight: 600; overflow-wrap: anywhere")
        self._facts = faint().mark("object-facts").style("white-space: pre-line")
        with div("bench-row") as self._reading:
            button(tr("Read value"), self._read, "object-read", icon="download")
            self._value = ui.label().classes("num").mark("object-value").style("overflow-wrap: anywhere")
        with div("bench-row") as self._writing:
            self._text = ui.input(tr("new value")).mark("object-input").style("flex: 1 1 140px")
            self._text.on("keydown.enter", self._write)
            button(tr("Write"), self._write, "object-write", icon="upload")
        self._problem = note("object-problem").props("role=alert")
        self._show(None)

    async def _load(self) -> None:
        node = self._nodes.get(self._node.value)
        if node is None:
            return
        self._show(None)
        self._entries = {}
        self._place.clear()
        with self._place:
            faint(tr("Reading {name} …", name=Path(node.eds).name))
        try:
            entries = await run.io_bound(load_entries, Path(node.eds), node.node_id) or []
        except Exception as error:  # noqa: BLE001  # any error ends the reading, and the page shows it
            entries = []
            self._problem.set_text(problem_text(error))
        if node.node_id != self._node.value:
            return  # another node was chosen meanwhile
        self._entries = {entry.address: entry for entry in entries}
        self._place.clear()
        with self._place:
            self._tree = ui.tree(tree_nodes(entries), label_key="label", on_select=self._select)
            self._tree.mark("object-tree").props("dense").bind_filter_from(self._filter, "value")
            self._opened = set()

    def _select(self, event: Any) -> None:
        """Show an entry; open or close a branch, and keep showing what was shown."""
        name = str(event.value or "")
        if name in self._entries:
            self._show(self._entries[name])
            return
        if name in self._opened:
            self._tree.collapse([name])
        elif name:
            self._tree.expand([name])
        self._opened ^= {name}
        self._tree.select(self._entry.address if self._entry is not None else None)

    def _show(self, entry: ObjectEntry | None) -> None:
        self._entry = entry
        for element in (self._problem, self._value, self._facts):
            element.set_text("")
        self._text.set_value("")
        self._reading.set_visibility(entry is not None and entry.readable)
        may_write = self._page.role >= Role.CONFIGURE
        self._writing.set_visibility(entry is not None and entry.writable and may_write)
        if entry is None:
            self._title.set_text(tr("Pick an object."))
            return
        self._title.set_text(f"{entry.address} {entry.name}")
        facts = (
            f"{entry.type_name}, {entry.access}",
            f"{entry.limits[0]} {ELLIPSIS} {entry.limits[1]}" if entry.limits is not None else "",
            tr("as delivered {default}", default=entry.default) if entry.default else "",
            "" if may_write or not entry.writable else tr("Writing needs the role configure."),
        )
        self._facts.set_text("\n".join(filter(None, facts)))

    async def _read(self) -> None:
        entry = self._entry
        if entry is None:
            return
        self._value.set_text(ELLIPSIS)
        shown = ""
        try:
            answer = await self._page.ask("read_object", **self._address(entry))
            if answer is not None and answer.accepted:
                shown = value_text(entry, answer.value)
            problem = _problem(tr("Not read"), answer)
        except Exception as error:  # noqa: BLE001  # any error ends the reading, and the page shows it
            problem = problem_text(error)
        if entry is self._entry:
            self._value.set_text(shown)
            self._problem.set_text(problem)

    async def _write(self) -> None:
        entry = self._entry
        if entry is None:
            return
        try:
            value = parse_value(entry, str(self._text.value or ""))
        except ValueError as error:
            self._problem.set_text(tr("Not sent: {error}.", error=error))
            return
        self._problem.set_text("")
        node = self._nodes[self._node.value]
        details = tr(
            "{address} {name} of {node} becomes {value}.\nThe drive acts on it at once, and nobody "
            "has checked what follows from it.",
            address=entry.address,
            name=entry.name,
            node=node.name,
            value=value_text(entry, value),
        )
        if not await confirmed(tr("Write this object?"), details, tr("Write")):
            return
        answer = await self._page.ask(
            "write_object", value=request_value(entry, value), **self._address(entry)
        )
        self._problem.set_text(_problem(tr("Not written"), answer))
        if answer is not None and answer.accepted and entry.readable:
            await self._read()

    def _address(self, entry: ObjectEntry) -> dict[str, Any]:
        return {"node": int(self._node.value), "index": entry.index, "subindex": entry.subindex}


def _problem(what: str, answer: LocalAnswer | None) -> str:
    """Return why the controller refused; "" when it did not, or when the request was not sent."""
    if answer is None or answer.accepted:
        return ""
    return f"{what}: {refusal_text(answer)}"
