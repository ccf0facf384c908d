"""One step of time of the concealed axis: position Verlet, with half a step of position before the forces."""

from typing import NamedTuple

from tests.campaigns.blind.axis.bodies import Bodies, half_moved, one_body, two_bodies
from tests.campaigns.blind.axis.drive import CurrentLoopState, DriveForce, clutter_n, cogging_n, drive_force
from tests.campaigns.blind.axis.friction import Friction, FrictionState, friction
from tests.campaigns.blind.axis.load import Load, LoadState, load
from tests.campaigns.blind.compiled import compiled
from tests.campaigns.blind.plant import Plant


class AxisState(NamedTuple):
    """Everything that a step changes."""

    bodies: Bodies
    current_loop: CurrentLoopState
    friction: FrictionState
    load: LoadState


class Forces(NamedTuple):
    """The forces of a step, newtons, by what makes them."""

    drive: DriveForce
    cogging_n: float
    clutter_n: float
    friction: Friction
    load: Load
    added_mass_n: float
    """Force of inertia of the mass that was added on the way."""


class Surroundings(NamedTuple):
    """What acts on the axis from outside during a control period."""

    rise_share: float
    """Share of the temperature rise."""
    noise_n: float
    """Force on the table."""
    coupled_m_s2: float
    """Acceleration of the other axis."""


@compiled
def at_rest(position_m: float) -> AxisState:
    """Return the axis at rest; the contact was last slid a second ago."""
    return AxisState(
        Bodies(position_m, 0.0, position_m, 0.0),
        CurrentLoopState(0.0, 0.0),
        FrictionState(0.0, 0.0, 1.0),
        LoadState(0.0, position_m, 0.0),
    )


@compiled
def step(
    p: Plant, state: AxisState, command_n: float, around: Surroundings, start_m: float, now_s: float, h: float
) -> tuple[AxisState, Forces]:
    """Return the axis after `h` seconds under a delayed command, and the forces that acted."""
    b = state.bodies
    drive, current_loop = drive_force(p, state.current_loop, command_n, b.motor_m + start_m, b.motor_m_s, h)
    b = half_moved(p, b, h)
    turn_m, before_m_s = b.motor_m + start_m, b.motor_m_s
    rubbing, contact = friction(
        p, state.friction, b.motor_m_s, b.table_m, b.table_m_s, around.rise_share, now_s, h
    )
    cogging, clutter = cogging_n(p, turn_m), clutter_n(p, turn_m)
    on_table, moved_parts = load(
        p, state.load, b.table_m, b.table_m_s, around.coupled_m_s2, around.noise_n, now_s, h
    )
    added_kg = p.mass_step_kg if now_s >= p.mass_step_at_s else 0.0
    force = drive.force_n - cogging - clutter - rubbing.motor_n
    if p.has_compliance == 0.0:
        b = one_body(p, b, force, rubbing.table_n + on_table.load_n, start_m, p.table_kg + added_kg, h)
    else:
        b = two_bodies(p, b, force, rubbing.table_n, on_table.load_n, start_m, p.table_kg + added_kg, h)
    added_mass_n = added_kg * (b.motor_m_s - before_m_s) / h
    return (
        AxisState(b, current_loop, contact, moved_parts),
        Forces(drive, cogging, clutter, rubbing, on_table, added_mass_n),
    )
