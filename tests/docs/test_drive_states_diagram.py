"""docs/drive_states.md shows the transitions of the table, all of them and no others.

`python tests/docs/test_drive_states_diagram.py` prints the diagram to paste there.
"""

from pathlib import Path

from hil_sim.drive.cia402_device import TRANSITIONS, State

DOCUMENT = Path(__file__).parents[2] / "docs" / "drive_states.md"


def diagram() -> str:
    """Mermaid text of the state machine; one line for every transition."""
    lines = ["stateDiagram-v2", "    [*] --> NOT_READY_TO_SWITCH_ON: 0 power-up"]
    for (state, cause), found in sorted(
        TRANSITIONS.items(), key=lambda item: (item[1].number, item[0][0].name, item[0][1].name)
    ):
        label = cause.name.lower().replace("_", " ")
        lines.append(f"    {state.name} --> {found.target.name}: {found.number} {label}")
    return "\n".join(lines)


def test_the_diagram_is_that_of_the_table() -> None:
    text = DOCUMENT.read_text(encoding="utf-8")
    drawn = text.split("```mermaid\n")[1].split("\n```")[0]
    assert drawn == diagram()


def test_every_state_can_be_reached_and_left() -> None:
    assert {found.target for found in TRANSITIONS.values()} | {State.NOT_READY_TO_SWITCH_ON} == set(State)
    assert {state for state, _ in TRANSITIONS} == set(State)


def test_transitions_1_to_16_are_all_there() -> None:
    assert {found.number for found in TRANSITIONS.values()} == set(range(1, 17))


if __name__ == "__main__":
    print(diagram())
