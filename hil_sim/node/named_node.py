"""The node id that LSS has given: a small file per device, beside its stored parameters."""

import json
from pathlib import Path

from hil_sim.node.storage import StoredParametersError, replace_json

FORMAT = 1


def stored_node_id(file: Path | None) -> int | None:
    """The id in the file; None without one. Raises StoredParametersError for a file that holds none."""
    if file is None or not file.exists():
        return None
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
        found = (content["format"], content["node_id"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise StoredParametersError(file, f"no node id: {error}") from error
    if found[0] != FORMAT or type(found[1]) is not int or not (1 <= found[1] <= 127 or found[1] == 255):
        raise StoredParametersError(file, f"no node id: {content}")
    return found[1]


def store_node_id(file: Path, node_id: int) -> bool:
    """Write the file in one step; return whether that worked."""
    try:
        replace_json(file, {"format": FORMAT, "node_id": node_id})
    except OSError:
        return False
    return True
