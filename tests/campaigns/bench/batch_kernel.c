/* The batch twin's loop in C: servo_ctrl/control/tick.py and twin/axis_rollout.py, the same operations on doubles
 * in the same order; what the twin's supervision finds is left out. batch.py writes batch_records.h, compiles this and holds its trajectory against ours. */
#include "batch_records.h"

#include "plant_kernel.h"

#include "amplifier_kernel.h"

#include "compensation_kernel.h"

#include "motor_leading_kernel.h"

#include "position_kernel.h"

enum { OUTPUT_FORCE, OUTPUT_VELOCITY };
enum { BAD_COMMAND = 1, BAD_MOTOR_SAMPLE = 2, BAD_SCALE_SAMPLE = 4, FOLLOWING_ERROR = 8 };
enum { COLUMNS = 11, REFERENCE_FIELDS = 4 };

typedef struct {
    double motor_position_1_m, motor_position_2_m, velocity_m_s, integral_n, velocity_command_m_s, force_n;
    PositionState position_loop;
    PulseState pulse;
    ObserverState observer;
    double screw_error_m;
    OffsetMotion take_up;
    SampledState sampled;
} TickState;

typedef struct {
    double position_m, velocity_m_s, force_n, force_offset_n, position_error_m, motor_velocity_m_s,
        pulse_m_s, disturbance_n, correction_m;
    bool saturated;
    int64_t status;
} Command;

typedef struct {
    int64_t origin, torque, torque_offset, position, velocity, velocity_offset;
} BufferedSetPoints;

static TickState at_rest(double motor_m) {
    return (TickState){.motor_position_1_m = motor_m,
                       .motor_position_2_m = motor_m,
                       .pulse.position_command_m = motor_m,
                       .observer.motor_force_n = NAN,
                       .take_up.smooth = true,
                       .sampled.motion.smooth = true};
}

static int64_t sample_status(const AxisControl *c, const double *command, double motor_m, double scale_m) {
    int64_t status = 0;
    if (!(isfinite(command[0]) && isfinite(command[1]) && isfinite(command[2]) && isfinite(command[3])))
        status |= BAD_COMMAND;
    if (!isfinite(motor_m)) status |= BAD_MOTOR_SAMPLE;
    if (c->position_loop.scale_feedback && !isfinite(scale_m)) status |= BAD_SCALE_SAMPLE;
    return status;
}

static Command held(const AxisControl *c, TickState *state, const double *command, double motor_m,
                    int64_t status) {
    state->take_up = led_in(c, state->take_up, state->screw_error_m, state->pulse.position_command_m);
    double position_m = status & BAD_COMMAND ? state->pulse.position_command_m : command[0];
    if (status & BAD_COMMAND)
        state->pulse.age_s += c->period_s;
    else
        advance_pulse(c, &state->pulse, command[0], command[2]);
    state->observer.velocity_m_s = state->observer.motor_force_n = state->position_loop.error_m = NAN;
    if (status & BAD_MOTOR_SAMPLE) motor_m = state->motor_position_1_m + state->velocity_m_s * c->period_s;
    state->motor_position_2_m = state->motor_position_1_m;
    state->motor_position_1_m = motor_m;
    double offset_n = isfinite(command[3]) ? command[3] : 0.0;
    state->screw_error_m = screw_error_m(c, position_m);
    double led_m = offset_m(&state->take_up) + offset_m(&state->sampled.motion) - state->screw_error_m;
    return (Command){position_m, state->velocity_command_m_s, state->force_n, offset_n, NAN,
                     state->velocity_m_s, 0.0, 0.0, led_m, false, status};
}

static double force_setpoint(const AxisControl *c, double *integral_n, double error_m_s, double feedforward_n) {
    double limit_n = c->limits.force_n, kv_n_s_m = c->velocity_loop.kv_n_s_m;
    double stepped_n = clamp(*integral_n + c->velocity_loop.ki_n_m * c->period_s * error_m_s, limit_n);
    double wanted_n = kv_n_s_m * error_m_s + stepped_n + feedforward_n;
    double force_n = clamp(wanted_n, limit_n);
    if ((wanted_n - force_n) * error_m_s > 0.0) {
        stepped_n = clamp(*integral_n, limit_n);
        force_n = clamp(kv_n_s_m * error_m_s + stepped_n + feedforward_n, limit_n);
    }
    *integral_n = stepped_n;
    return force_n;
}

static Command axis_tick(const AxisControl *c, TickState *state, const double *command, double motor_m,
                         double scale_m, double motor_force_n) {
    int64_t status = sample_status(c, command, motor_m, scale_m);
    if (status != 0) return held(c, state, command, motor_m, status);
    bool moving = fabs(command[0] - state->pulse.position_command_m) >= REST_M;
    state->take_up = led_in(c, state->take_up, state->screw_error_m, state->pulse.position_command_m);
    advance_pulse(c, &state->pulse, command[0], command[2]);
    state->screw_error_m = screw_error_m(c, command[0]);
    advance_take_up(c, &state->take_up, state->pulse.direction);
    advance_sampled(c, &state->sampled, command[0] - scale_m, moving || !over(&state->take_up));
    double led_m = offset_m(&state->take_up) + offset_m(&state->sampled.motion) - state->screw_error_m;
    double error_m = command[0] - (c->position_loop.scale_feedback ? scale_m : motor_m);
    if (!c->position_loop.scale_feedback) error_m += led_m;
    if (fabs(error_m) > c->limits.following_error_m) status |= FOLLOWING_ERROR;
    double friction_m_s = pulse_m_s(c, &state->pulse);
    double wanted_m_s =
        velocity_setpoint(c, &state->position_loop, error_m, c->feedforward.velocity * command[1] + friction_m_s);
    double velocity_command_m_s = clamp(wanted_m_s, c->limits.velocity_m_s);
    double difference_m_s = c->velocity_loop.window_samples == 1
                                ? (motor_m - state->motor_position_1_m) / c->period_s
                                : (motor_m - state->motor_position_2_m) / (2.0 * c->period_s);
    double velocity_m_s =
        state->velocity_m_s + c->velocity_loop.filter_blend * (difference_m_s - state->velocity_m_s);
    observe_disturbance(c, &state->observer, motor_force_n, velocity_m_s);
    double feedforward_n = c->feedforward.acceleration_kg * command[2], offset_n = command[3], force_n = 0.0;
    if (c->output == OUTPUT_FORCE) {
        force_n = force_setpoint(c, &state->integral_n, velocity_command_m_s - velocity_m_s,
                                 feedforward_n + state->observer.disturbance_n);
    } else {
        state->integral_n = 0.0;
        offset_n += clamp(feedforward_n, c->limits.force_n);
    }
    bool saturated = fabs(wanted_m_s) > c->limits.velocity_m_s || fabs(force_n) >= c->limits.force_n;
    state->motor_position_2_m = state->motor_position_1_m;
    state->motor_position_1_m = motor_m;
    state->velocity_m_s = velocity_m_s;
    state->velocity_command_m_s = velocity_command_m_s;
    state->force_n = force_n;
    return (Command){command[0], velocity_command_m_s, force_n, offset_n, error_m, velocity_m_s,
                     friction_m_s, state->observer.disturbance_n, led_m, saturated, status};
}

static int64_t integer_of(double value, double unit, double largest) {
    double multiple = value / unit;
    return isnan(multiple) ? 0 : (int64_t)lesser(greater(rint(multiple), -largest), largest);
}

static void apply_set_points(int64_t output, const BusScaling *scaling, SetPoint *sp, const BufferedSetPoints *b) {
    sp->loop = output + 1;
    if (output == OUTPUT_FORCE) {
        int64_t total = b->torque + b->torque_offset;
        if (total < -scaling->max_torque) total = -scaling->max_torque;
        if (total > scaling->max_torque) total = scaling->max_torque;
        sp->current_a = (double)total * scaling->drive_ampere_per_torque;
        sp->current_offset_a = 0.0;
        return;
    }
    sp->current_offset_a = (double)b->torque_offset * scaling->drive_ampere_per_torque;
    if (output == OUTPUT_VELOCITY) {
        sp->velocity_m_s = (double)b->velocity * scaling->drive_metre_per_count;
        sp->velocity_offset_m_s = 0.0;
    } else {
        sp->position_m = (double)(b->position + b->origin) * scaling->drive_metre_per_count;
        sp->velocity_offset_m_s = (double)b->velocity_offset * scaling->drive_metre_per_count;
    }
}

void run_axis(const AxisControl *c, const BusScaling *scaling, const AxisPlant *p, AxisPlantState *s, SetPoint *sp,
              int64_t substeps, double dt_s, const double *reference, int64_t cycles, int64_t off_cycles,
              double *rows) {
    TickState state = at_rest(0.0);
    BufferedSetPoints buffered = {0};
    bool engaged = false;
    double scale_offset_m = 0.0;
    for (int64_t k = 0; k < cycles; k++) {
        double *row = rows + k * COLUMNS;
        const double *command = reference + k * REFERENCE_FIELDS;
        advance_axis(p, s, sp, substeps, dt_s);
        if (engaged && !scaling->immediate) apply_set_points(c->output, scaling, sp, &buffered);
        bool engages = !engaged && k >= off_cycles;
        if (engages) buffered.origin = s->encoder_counts;
        double motor_m = (double)(s->encoder_counts - buffered.origin) * scaling->metre_per_count;
        double scale_m = NAN;
        if (engages) {
            engaged = true;
            scale_offset_m = motor_m - (double)s->scale_counts * scaling->scale_metre_per_count;
            state = at_rest(motor_m);
        }
        if (p->scale.enabled) scale_m = (double)s->scale_counts * scaling->scale_metre_per_count + scale_offset_m;
        row[2] = motor_m;
        row[3] = scale_m;
        row[6] = rint(s->current_measured_a * scaling->drive_permille_per_ampere) * scaling->ampere_per_permille;
        if (!engaged) continue;
        Command out = axis_tick(c, &state, command, motor_m, scale_m, row[6] * scaling->newton_per_ampere);
        row[0] = out.position_m;
        row[1] = command[1];
        row[4] = out.motor_velocity_m_s;
        row[5] = out.force_n;
        row[7] = out.position_error_m;
        row[8] = out.pulse_m_s;
        row[9] = out.disturbance_n;
        row[10] = out.correction_m;
        double force_n = out.force_n, offset_n = out.force_offset_n;
        if (!scaling->torque_offset_mapped) force_n += offset_n, offset_n = 0.0;
        buffered.torque = integer_of(force_n, scaling->newton_per_permille, INT16_MAX);
        buffered.torque_offset = integer_of(offset_n, scaling->newton_per_permille, INT16_MAX);
        buffered.position = integer_of(out.position_m + out.correction_m, scaling->metre_per_count, INT32_MAX);
        buffered.velocity = integer_of(out.velocity_m_s, scaling->metre_per_count, INT32_MAX);
        double feedforward = scaling->velocity_offset_mapped ? c->feedforward.velocity : 0.0;
        buffered.velocity_offset = integer_of(feedforward * command[1], scaling->metre_per_count, INT32_MAX);
        if (scaling->immediate) apply_set_points(c->output, scaling, sp, &buffered);
    }
}
