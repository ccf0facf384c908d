"""Makes the objects of a run from a machine file: axes, machine, cycle, and the handler of every frame."""

from collections.abc import Callable, Sequence
from functools import partial

from servo_ctrl.axis.axis_parts import axis_parts
from servo_ctrl.axis.cycle_memory import CycleMemory
from servo_ctrl.axis.fault_bounds import GAP_TOLERATED_S
from servo_ctrl.axis.fault_policy import Event
from servo_ctrl.axis.servo import AxisServo
from servo_ctrl.canopen.node import ControllerNode
from servo_ctrl.canopen.node_plan import LIMIT_SWITCHES, NodePlan, PdoPlan
from servo_ctrl.canopen.watch import HeartbeatWatch, emcy_handler
from servo_ctrl.config.contour import couplings
from servo_ctrl.config.kernel_params import axis_params, input_shaper
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.daemon.cycle.cycle import Cycle
from servo_ctrl.daemon.cycle.drives import AxisNodes
from servo_ctrl.daemon.cycle.event_timer import EventTimer
from servo_ctrl.daemon.cycle.machine import MachineController
from servo_ctrl.daemon.cycle.missing_inputs import Tolerance
from servo_ctrl.daemon.cycle.stand_by import StandbyNodes, with_error_code
from servo_ctrl.daemon.run.foreign_frames import SYNC_COB_ID, report_masters, report_writes
from servo_ctrl.daemon.run.own_node import fault_reporter
from servo_ctrl.io.can_port import BusError, CanPort
from servo_ctrl.io.error_frames import BusNews
from servo_ctrl.units import MM

RESTART = "the interface restarts by itself where restart-ms is set (ip link), or when you restart it"


def build_axes(config: MachineConfig, plans: Sequence[NodePlan]) -> list[AxisNodes]:
    """Make the axes of a machine and compile their kernels; inputs are numbered like the plans."""
    index = {plan.key: place for place, plan in enumerate(plans)}
    further = {key: place for place, (key, _) in enumerate(further_inputs(plans), start=len(plans))}
    parts, rpdos, nodes = [], [], []
    for name, axis in config.axes.items():
        drive, scale = index[f"axis.{name}.drive"], index.get(f"axis.{name}.scale")
        plan = plans[drive]
        cyclic = [pdo for pdo in plan.further_tpdos if pdo.cyclic]
        others = [further[f"{plan.name}, {pdo.name}"] for pdo in cyclic]
        inputs = {
            drive: plan.tpdo.codec,
            **{place: pdo.codec for place, pdo in zip(others, cyclic, strict=True)},
        }
        rpdos.append([rpdo.codec for rpdo in plan.rpdos])
        scale_input = None if scale is None else (scale, plans[scale].tpdo.codec)
        parts.append(axis_parts(axis, axis_params(config, name), rpdos[-1], inputs, scale_input))
        nodes.append((drive, scale, axis.limits.acceleration_mm_s2 * MM, tuple(others)))
    memory = CycleMemory(parts, rpdos, len(plans) + len(further), couplings(config))
    return [
        AxisNodes(AxisServo(name, axis, memory, place), *nodes[place])
        for place, (name, axis) in enumerate(config.axes.items())
    ]


def further_inputs(plans: Sequence[NodePlan]) -> list[tuple[str, PdoPlan]]:
    """Return the cyclic TPDOs besides the first of each node; their inputs follow those of the nodes."""
    return [(f"{plan.name}, {pdo.name}", pdo) for plan in plans for pdo in plan.further_tpdos if pdo.cyclic]


def input_names(plans: Sequence[NodePlan]) -> list[str]:
    """Return the names of a cycle's inputs for messages: the nodes, then their further TPDOs."""
    return [plan.name for plan in plans] + [name for name, _ in further_inputs(plans)]


def build_machine(
    config: MachineConfig, plans: Sequence[NodePlan], places: list[AxisNodes], *, lockstep: bool
) -> MachineController:
    """Make the machine of these axes. Lockstep waits for each input and tolerates no missing one."""
    gap_cycles = 0 if lockstep else round(GAP_TOLERATED_S / config.period_s)
    tolerance = Tolerance(gap_cycles, config.bus.missed_per_1000)
    machine = MachineController(places, input_names(plans), config.period_s, tolerance)
    machine.shape_set_points([input_shaper(config, name) for name in config.axes])
    return machine


def connect(
    config: MachineConfig,
    plans: Sequence[NodePlan],
    places: list[AxisNodes],
    machine: MachineController,
    port: CanPort,
    node: ControllerNode,
    *,
    lockstep: bool,
    on_end: Callable[[], None],
) -> Cycle:
    """Connect the machine to the bus: make its cycle, and turn reports of nodes and bus into events."""
    heartbeat_cycles = round(config.controller.heartbeat_ms * 1e-3 / config.period_s)
    if config.controller.heartbeat_ms:
        heartbeat_cycles = max(heartbeat_cycles, 1)
    watch = HeartbeatWatch(plans, heartbeat_cycles, partial(machine.event, Event.LOST_HEARTBEAT))

    def on_begin(elapsed: int) -> None:
        machine.cycles = cycle.number + 1
        try:
            node.count_cycles(elapsed)
        except BusError as error:
            port.fail(error)
        for text in watch.advance(cycle.number):
            machine.event(Event.LOST_HEARTBEAT, text)
        for timed in timers:
            if text := timed.advance(cycle.number):
                machine.event(Event.LOST_TPDO, text)

    further = further_inputs(plans)
    timers: list[EventTimer] = []
    cycle = Cycle(
        machine,
        sync=port.frame(SYNC_COB_ID),
        rpdos=[port.frame(rpdo.cob_id) for plan in plans for rpdo in plan.rpdos],
        sizes=[plan.tpdo.codec.size for plan in plans] + [pdo.codec.size for _, pdo in further],
        flush=port.flush,
        read=port.read_arrived,
        lockstep=lockstep,
        on_begin=on_begin,
        on_end=on_end,
    )
    machine.on_fault = fault_reporter(node)
    sender = [place for place, plan in enumerate(plans) for pdo in plan.further_tpdos if pdo.cyclic]
    names = input_names(plans)
    machine.nodes = StandbyNodes(
        cycle, watch, names, lambda place: node.start(plans[place].node_id), [*range(len(plans)), *sender]
    )
    _register_handlers(
        plans, places, machine, port, cycle=cycle, watch=watch, timers=timers, period_s=config.period_s
    )
    report_masters(config, plans, port, partial(machine.event, Event.FOREIGN_MASTER))
    report_writes(plans, port, machine.object_changed)
    _watch_bus(port, machine, cycle, lockstep=lockstep)
    return cycle


def _register_handlers(
    plans: Sequence[NodePlan],
    places: list[AxisNodes],
    machine: MachineController,
    port: CanPort,
    *,
    cycle: Cycle,
    watch: HeartbeatWatch,
    timers: list[EventTimer],
    period_s: float,
) -> None:
    """Register a handler for every frame of the nodes."""
    servo_of = {place.drive: place.servo for place in places}
    inputs_of = [
        (axis.drive, *axis.further_tpdos)
        if axis.scale is None
        else (axis.drive, *axis.further_tpdos, axis.scale)
        for axis in places
    ]
    machine.age_inputs(
        lambda: [cycle.input_age(*inputs) for inputs in inputs_of] if cycle.inputs_late else ()
    )
    for place, (_, pdo) in enumerate(further_inputs(plans), start=len(plans)):
        port.handlers[pdo.cob_id] = cycle.handler(place)
    for place, plan in enumerate(plans):
        port.handlers[plan.tpdo.cob_id] = cycle.handler(place)
        port.handlers[0x700 + plan.node_id] = watch.handler(place)
        on_emcy = emcy_handler(plan, partial(machine.event, Event.EMCY))
        servo = servo_of.get(place)
        for pdo in plan.further_tpdos:
            if servo is not None and not pdo.cyclic:
                timer = EventTimer(f"{plan.name}, {pdo.name}", pdo, period_s, cycle)
                timers.append(timer)
                port.handlers[pdo.cob_id] = _event_handler(machine, place, servo, pdo, timer)
        port.handlers[0x080 + plan.node_id] = on_emcy if servo is None else with_error_code(servo, on_emcy)


def _watch_bus(port: CanPort, machine: MachineController, cycle: Cycle, *, lockstep: bool) -> None:
    """Turn reports of the bus itself, down, off or frames lost, into events.

    In lockstep no time passes without the nodes, so that bus-off ends the run.
    """

    def on_down(error: BusError) -> None:
        machine.event(Event.BUS_DOWN, str(error))
        cycle.stop()

    def on_error_frame(news: BusNews) -> None:
        text = f"bus {port.name}: {news.text}"
        if news.down and lockstep:
            machine.event(Event.BUS_DOWN, text)
            cycle.stop()
        elif news.down:
            machine.bus_off = f"{text}; {RESTART}"
            machine.event(Event.BUS_OFF, text)
        elif news.restarted and machine.bus_off:
            machine.bus_off = ""
            machine.note(f"{text}: the drives have braked by themselves; Enable configures the nodes again")
            machine.on_fault(Event.BUS_OFF, text)
        elif news.frames_lost:
            machine.event(Event.FRAMES_LOST, text)
        else:
            machine.note(text)

    port.on_down, port.on_error_frame = on_down, on_error_frame


def _event_handler(
    machine: MachineController, place: int, servo: AxisServo, pdo: PdoPlan, timer: EventTimer
) -> Callable[[bytes, float], None]:
    """Make the handler of an event-driven TPDO of the drive at `place`: values and limit switches."""
    switches_at = pdo.codec.position(LIMIT_SWITCHES)

    def on_event(payload: bytes, _timestamp_s: float) -> None:
        timer.received()
        if len(payload) != pdo.codec.size:
            machine.wrong_input_length(place, len(payload))
            return
        values = pdo.codec.unpack(payload)
        servo.take_event_tpdo(pdo.codec, values)
        if switches_at is not None and (text := servo.closed_switch(values[switches_at])):
            machine.event(Event.LIMIT_SWITCH, text, servo)

    return on_event
