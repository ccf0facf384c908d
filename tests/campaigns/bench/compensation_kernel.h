/* The friction pulse and the disturbance observer in C: servo_ctrl/control/compensation/trapezoidal_pulse.py and
 * servo_ctrl/control/compensation/disturbance_observer.py. Include plant_kernel.h first. */

#define REST_M 1e-12

typedef struct {
    double duration_s, amplitude_m_s, trailing_start_s, trailing_duration_s, trailing_amplitude_m_s;
} PulseShape;

typedef struct {
    double position_command_m, direction, age_s;
    PulseShape shape;
} PulseState;

typedef struct {
    double disturbance_n, velocity_m_s, motor_force_n;
} ObserverState;

static double clamp(double value, double limit) { return lesser(greater(value, -limit), limit); }

static double between(const double *row, int64_t lower, int64_t upper, double share) {
    return row[lower] + share * (row[upper] - row[lower]);
}

static PulseShape shape_at(const double *learned, int64_t columns, double reverse_m_s2) {
    int64_t lower = 0, upper = columns - 1;
    while (upper - lower > 1) {
        int64_t middle = (lower + upper) / 2;
        if (learned[middle] <= reverse_m_s2)
            lower = middle;
        else
            upper = middle;
    }
    double span = learned[upper] - learned[lower];
    double share = span > 0.0 ? lesser(greater((reverse_m_s2 - learned[lower]) / span, 0.0), 1.0) : 0.0;
    return (PulseShape){
        between(learned + columns, lower, upper, share),     between(learned + 2 * columns, lower, upper, share),
        between(learned + 3 * columns, lower, upper, share), between(learned + 4 * columns, lower, upper, share),
        between(learned + 5 * columns, lower, upper, share),
    };
}

static void advance_pulse(const AxisControl *c, PulseState *state, double position_command_m,
                          double acceleration_m_s2) {
    double increment_m = position_command_m - state->position_command_m;
    state->position_command_m = position_command_m;
    state->age_s += c->period_s;
    if (fabs(increment_m) < REST_M) return;
    double before = state->direction;
    state->direction = increment_m > 0.0 ? 1.0 : -1.0;
    if (state->direction * before >= 0.0) return;
    state->age_s = 0.0;
    state->shape = (PulseShape){0};
    const double *learned = (const double *)(intptr_t)c->pulse.learned.address;
    if (c->pulse.enabled) state->shape = shape_at(learned, c->pulse.learned.columns, fabs(acceleration_m_s2));
}

static double trapezoid(double age_s, double duration_s, double rise_s) {
    return lesser(greater(lesser(age_s, duration_s - age_s) / rise_s, 0.0), 1.0);
}

static double pulse_m_s(const AxisControl *c, const PulseState *state) {
    const PulseShape *shape = &state->shape;
    double main_m_s = shape->amplitude_m_s * trapezoid(state->age_s, shape->duration_s, c->pulse.rise_s);
    double trailing_m_s =
        shape->trailing_amplitude_m_s *
        trapezoid(state->age_s - shape->trailing_start_s, shape->trailing_duration_s, c->pulse.rise_s);
    return state->direction * clamp(main_m_s + trailing_m_s, c->pulse.amplitude_max_m_s);
}

static void observe_disturbance(const AxisControl *c, ObserverState *state, double motor_force_n,
                                double velocity_m_s) {
    ObserverState before = *state;
    state->velocity_m_s = velocity_m_s;
    state->motor_force_n = motor_force_n;
    if (!c->observer.enabled) state->disturbance_n = 0.0;
    if (!c->observer.enabled || !isfinite(motor_force_n)) return;
    if (!isfinite(before.velocity_m_s)) state->motor_force_n = NAN;
    if (!isfinite(before.velocity_m_s) || !isfinite(before.motor_force_n)) return;
    double force_n = 0.5 * (motor_force_n + before.motor_force_n);
    double middle_m_s = 0.5 * (velocity_m_s + before.velocity_m_s);
    double model_n = c->observer.mass_kg * (velocity_m_s - before.velocity_m_s) / c->period_s +
                     c->observer.viscous_n_s_m * middle_m_s;
    state->disturbance_n += c->observer.filter_blend * (force_n - model_n - before.disturbance_n);
}
