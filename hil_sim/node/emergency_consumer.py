"""Emergency consumer 1028h: an error that a consumed node reports counts like the loss of that node.

CiA 301 leaves the reaction to the device: a drive must not continue when the scale of its axis has an error.
"""

from collections.abc import Callable

from hil_sim.node.dictionary import Dictionary
from hil_sim.node.identifiers import check_identifier
from hil_sim.node.sdo_abort import AbortCode, SdoAbort

CONSUMED = 0x1028
NOT_CONSUMED = 0x8000_0000
CODE = slice(0, 2)
FRAME_BYTES = 8


class EmergencyConsumer:
    """Calls `on_error(node_id, code)` for each consumed error, `on_end()` once no node has one."""

    def __init__(
        self, dictionary: Dictionary, on_error: Callable[[int, int], None], on_end: Callable[[], None]
    ) -> None:
        self._dictionary = dictionary
        self._on_error = on_error
        self._on_end = on_end
        self._in_error: set[int] = set()
        dictionary.checks[CONSUMED] = self._check

    def follow(self) -> None:
        """Apply 1028h: end the errors of nodes that are no longer consumed."""
        self._keep(set(self.cob_ids.values()))

    @property
    def cob_ids(self) -> dict[int, int]:
        """Identifiers of the consumed EMCYs, each with the node that sends it (the subindex)."""
        value = self._dictionary.value
        entries = {value(CONSUMED, node): node for node in range(1, value(CONSUMED) + 1)}
        return {cob_id & 0x7FF: node for cob_id, node in entries.items() if not cob_id & NOT_CONSUMED}

    def on_emergency(self, node_id: int, data: bytes) -> None:
        """Receive an EMCY of `node_id`: an error, or its end. A frame of another length is ignored."""
        if len(data) != FRAME_BYTES:
            return
        if code := int.from_bytes(data[CODE], "little"):
            self._in_error.add(node_id)
            self._on_error(node_id, code)
        else:
            self._keep(self._in_error - {node_id})

    def _keep(self, nodes: set[int]) -> None:
        if self._in_error and not self._in_error & nodes:
            self._on_end()
        self._in_error &= nodes

    def _check(self, node_id: int, cob_id: int) -> None:
        if cob_id & NOT_CONSUMED:
            return
        check_identifier(cob_id)
        if node_id == self._dictionary.node_id:
            raise SdoAbort(AbortCode.PARAMETER_INCOMPATIBLE)  # a node does not consume its own EMCY
