/* What leads the motor beside the command, in C: servo_ctrl/control/offset_motion.py, sampled_dual_loop.py, and
 * screw_error.py and backlash.py of servo_ctrl/control/compensation. Include compensation_kernel.h first. */

typedef struct {
    double from_m, to_m, elapsed_s, duration_s;
    bool smooth;
} OffsetMotion;

typedef struct {
    double rest_s;
    int64_t corrections;
    OffsetMotion motion;
} SampledState;

static OffsetMotion begun(double from_m, double to_m, bool smooth, double acceleration_m_s2, double jerk_m_s3) {
    double way_m = fabs(to_m - from_m), duration_s = 2.0 * sqrt(way_m / acceleration_m_s2);
    if (smooth)
        duration_s = 4.0 * greater(pow(way_m / (2.0 * jerk_m_s3), 1.0 / 3.0),
                                   sqrt(way_m / (2.0 * acceleration_m_s2)));
    return (OffsetMotion){from_m, to_m, 0.0, duration_s, smooth};
}

static void advance_motion(OffsetMotion *s, double period_s) {
    s->elapsed_s = lesser(s->elapsed_s + period_s, s->duration_s);
}

static bool over(const OffsetMotion *s) { return s->elapsed_s >= s->duration_s; }

static double offset_m(const OffsetMotion *s) {
    if (over(s)) return s->to_m;
    double share = s->elapsed_s / s->duration_s, nearer = lesser(share, 1.0 - share), gone = 2.0 * nearer * nearer;
    if (s->smooth) {
        double u = 4.0 * nearer, v = 2.0 - u;
        gone = u < 1.0 ? u * u * u / 12.0 : 0.5 * (u - 1.0) + v * v * v / 12.0;
    }
    if (share > 0.5) gone = 1.0 - gone;
    return s->from_m + (s->to_m - s->from_m) * gone;
}

static double screw_error_m(const AxisControl *c, double position_m) {
    if (!c->screw.enabled) return 0.0;
    int64_t columns = c->screw.table.columns, lower = 0, upper = columns - 1;
    const double *at_m = (const double *)(intptr_t)c->screw.table.address;
    while (upper - lower > 1) {
        int64_t middle = (lower + upper) / 2;
        if (at_m[middle] <= position_m)
            lower = middle;
        else
            upper = middle;
    }
    double span_m = at_m[upper] - at_m[lower];
    double share = span_m > 0.0 ? lesser(greater((position_m - at_m[lower]) / span_m, 0.0), 1.0) : 0.0;
    return between(at_m + columns, lower, upper, share);
}

/* The take-up, from where the motor is led by now although the table may be another. */
static OffsetMotion led_in(const AxisControl *c, OffsetMotion take_up, double error_m, double position_m) {
    double by_m = screw_error_m(c, position_m) - error_m;
    take_up.from_m += by_m;
    take_up.to_m += by_m;
    return take_up;
}

static void advance_take_up(const AxisControl *c, OffsetMotion *state, double direction) {
    double wanted_m = c->take_up.enabled ? 0.5 * c->take_up.lost_motion_m * direction : 0.0;
    if (over(state) && wanted_m != state->to_m)
        *state = begun(state->to_m, wanted_m, true, c->take_up.acceleration_m_s2, c->take_up.jerk_m_s3);
    advance_motion(state, c->period_s);
}

static void advance_sampled(const AxisControl *c, SampledState *state, double deviation_m, bool moving) {
    bool smooth = c->sampled.smooth != 0;
    double acceleration_m_s2 = c->sampled.acceleration_m_s2, jerk_m_s3 = c->sampled.jerk_m_s3;
    double rest_s = state->rest_s + c->period_s;
    advance_motion(&state->motion, c->period_s);
    state->rest_s = 0.0;
    if (!c->sampled.enabled && over(&state->motion) && state->motion.to_m != 0.0)
        state->motion = begun(state->motion.to_m, 0.0, smooth, acceleration_m_s2, jerk_m_s3);
    if (!c->sampled.enabled || moving) {
        state->corrections = 0;
        return;
    }
    if (!over(&state->motion)) return;
    state->rest_s = rest_s;
    if (rest_s < c->sampled.settle_s || state->corrections >= c->sampled.corrections || !isfinite(deviation_m))
        return;
    if (fabs(deviation_m) <= c->sampled.tolerance_m + REST_M) {
        state->corrections = c->sampled.corrections;
        return;
    }
    double wanted_m = clamp(state->motion.to_m + deviation_m, c->sampled.limit_m);
    state->motion = begun(state->motion.to_m, wanted_m, smooth, acceleration_m_s2, jerk_m_s3);
    state->rest_s = 0.0;
    state->corrections++;
}
