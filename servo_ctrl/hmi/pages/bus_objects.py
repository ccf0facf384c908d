"""The object browser of the Bus page: the tree of a node's EDS; entries are read and written one by one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from nicegui import run, ui

from servo_ctrl.config.errors import ServoCtrlError
from servo_ctrl.hmi.access import Role
from servo_ctrl.hmi.bench import ask
from servo_ctrl.hmi.object_tree import entries_of
from servo_ctrl.hmi.object_tree_values import parsed, shown, to_send
from servo_ctrl.hmi.parts import card, confirmed

if TYPE_CHECKING:
    from servo_ctrl.config.local_messages import Hello
    from servo_ctrl.hmi.bench import Bench, Visitor
    from servo_ctrl.hmi.object_tree import Entry, IndexRange

TREE_CSS = """
.q-tree__node--selected .q-tree__node-header-content { color: var(--accent) !important; font-weight: 600; }
@media (pointer: coarse), (max-width: 700px) {
  .q-tree__node-header { min-height: 44px; }
}
"""


class ObjectBrowser:
    """The card of a node's objects."""

    def __init__(self, bench: Bench, visitor: Visitor, hello: Hello) -> None:
        self._bench, self._visitor = bench, visitor
        self._nodes = {node.node_id: node for node in hello.nodes}
        self._entries: dict[str, Entry] = {}
        self._entry: Entry | None = None
        self._open: set[str] = set()
        """Branches of the tree that were opened by their names."""
        ui.add_css(TREE_CSS)
        with card("Objects", "objects"):
            with ui.element("div").classes("bench-row"):
                names = {node.node_id: f"{node.name} ({node.node_id})" for node in hello.nodes}
                self._node = ui.select(names, value=next(iter(names), None), label="node").mark("object-node")
                self._node.props("outlined dense options-dense").style("min-width: 190px")
                self._node.on_value_change(self._load)
                self._filter = ui.input("filter: name or index").mark("object-filter")
                self._filter.props("outlined dense clearable").style("flex: 1 1 180px")
            with ui.element("div").classes("bench-wide"):
                self._place = (
                    ui.element("div").classes("bench-scroll").style("max-height: 420px; overflow: auto")
                )
                with ui.element("div").classes("bench-column").props("aria-live=polite"):
                    self._details()
        ui.timer(0.0, self._load, once=True)

    def _details(self) -> None:
        self._title = ui.label("Pick an object.").mark("object-title")
        self._title.style("font-size: 16px; font-weight: 600; overflow-wrap: anywhere")
        self._facts = ui.label().classes("bench-faint").mark("object-facts").style("white-space: pre-line")
        with ui.element("div").classes("bench-row") as self._reading:
            ui.button("Read", icon="download", on_click=self._read).props("outline").mark("object-read")
            self._value = ui.label().classes("num").mark("object-value").style("overflow-wrap: anywhere")
        with ui.element("div").classes("bench-row") as self._writing:
            self._text = ui.input("new value").mark("object-input").props("outlined dense")
            self._text.style("flex: 1 1 140px").on("keydown.enter", self._write)
            ui.button("Write", icon="upload", on_click=self._write).props("outline").mark("object-write")
        self._problem = ui.label().classes("bench-note warn").mark("object-problem").props("role=alert")
        self._show(None)

    async def _load(self) -> None:
        node = self._nodes.get(self._node.value)
        if node is None:
            return
        self._show(None)
        self._entries = {}
        self._place.clear()
        with self._place:
            ui.label(f"Reading {Path(node.eds).name} \N{HORIZONTAL ELLIPSIS}").classes("bench-faint")
        try:
            tree = await run.io_bound(tree_of, Path(node.eds), node.node_id) or ()
        except ServoCtrlError as error:
            tree = ()
            self._complain(str(error))
        if node.node_id != self._node.value:
            return  # another one was picked meanwhile
        self._entries = {entry.address: entry for entry in entries_of(tree)}
        self._place.clear()
        with self._place:
            self._tree = ui.tree(tree_nodes(tree), label_key="label", on_select=self._pick)
            self._tree.mark("object-tree").props("dense").bind_filter_from(self._filter, "value")
            self._open = set()

    def _pick(self, event: Any) -> None:
        """A leaf is shown; a branch opens or closes, and what was shown stays."""
        name = str(event.value or "")
        if name in self._entries:
            self._show(self._entries[name])
            return
        if name in self._open:
            self._tree.collapse([name])
        elif name:
            self._tree.expand([name])
        self._open ^= {name}
        if self._entry is not None:
            self._tree.select(self._entry.address)
        else:
            self._tree.deselect()

    def _show(self, entry: Entry | None) -> None:
        self._entry = entry
        self._complain("")
        self._value.set_text("")
        self._text.set_value("")
        self._reading.set_visibility(entry is not None and entry.readable)
        may = self._visitor.role >= Role.CONFIGURE
        self._writing.set_visibility(entry is not None and entry.writable and may)
        if entry is None:
            self._title.set_text("Pick an object.")
            self._facts.set_text("")
            return
        self._title.set_text(f"{entry.address} {entry.name}")
        facts = [f"{entry.type_name}, {entry.access}"]
        if entry.limits is not None:
            facts.append(f"{entry.limits[0]} \N{HORIZONTAL ELLIPSIS} {entry.limits[1]}")
        if entry.default:
            facts.append(f"as delivered {entry.default}")
        if entry.writable and not may:
            facts.append("Writing needs the role configure.")
        self._facts.set_text("\n".join(facts))

    def _complain(self, text: str) -> None:
        self._problem.set_text(text)
        self._problem.set_visibility(bool(text))

    async def _read(self) -> None:
        entry = self._entry
        if entry is None:
            return
        self._value.set_text("\N{HORIZONTAL ELLIPSIS}")
        answer = await ask(self._bench, self._visitor, "read_object", **self._address(entry))
        if entry is not self._entry:
            return
        read = answer is not None and answer.accepted
        self._value.set_text(shown(entry, answer.value) if answer is not None and read else "")
        self._complain("" if read or answer is None else f"Not read: {answer.reason or answer.refusal}")

    async def _write(self) -> None:
        entry = self._entry
        if entry is None:
            return
        try:
            value = parsed(entry, str(self._text.value or ""))
        except ValueError as error:
            self._complain(f"Not sent: {error}.")
            return
        self._complain("")
        node = self._nodes[self._node.value]
        details = (
            f"{entry.address} {entry.name} of {node.name} becomes {shown(entry, value)}.\n"
            "The drive acts on it at once, and nobody has checked what follows from it."
        )
        if not await confirmed("Write this object?", details, "Write"):
            return
        answer = await ask(
            self._bench, self._visitor, "write_object", value=to_send(entry, value), **self._address(entry)
        )
        if answer is not None and not answer.accepted:
            self._complain(f"Not written: {answer.reason or answer.refusal}")
        elif answer is not None and entry.readable:
            await self._read()

    def _address(self, entry: Entry) -> dict[str, Any]:
        return {"node": int(self._node.value), "index": entry.index, "subindex": entry.subindex}


def tree_of(eds: Path, node_id: int) -> tuple[IndexRange, ...]:
    """As `load_tree`; the CANopen library is imported here, for most processes never show a tree."""
    from servo_ctrl.hmi.object_tree_eds import load_tree  # noqa: PLC0415  # some 60 MB

    return load_tree(eds, node_id)


def tree_nodes(tree: tuple[IndexRange, ...]) -> list[dict[str, Any]]:
    """The tree as the library's element wants it; an object of one entry is a leaf itself."""
    return [
        {
            "id": part.name,
            "label": part.name,
            "children": [
                _leaf(one.entries[0])
                if len(one.entries) == 1 and one.entries[0].subindex == 0
                else {
                    "id": f"{one.index:04X}",
                    "label": f"{one.index:04X} {one.name}",
                    "children": [_leaf(entry) for entry in one.entries],
                }
                for one in part.objects
            ],
        }
        for part in tree
    ]


def _leaf(entry: Entry) -> dict[str, Any]:
    return {"id": entry.address, "label": f"{entry.address} {entry.name}"}
