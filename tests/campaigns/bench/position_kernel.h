/* The position loop in C: servo_ctrl/control/position_loop.py and fuzzy_pd.py. Include compensation_kernel.h first. */

typedef struct {
    double error_m, change_m_s, integral_m_s;
} PositionState;

static int64_t cell(double place, int64_t steps) {
    int64_t below = (int64_t)place;
    return below > steps - 1 ? steps - 1 : below;
}

static double interpolated(const double *surface, int64_t nodes, double first, double second) {
    int64_t steps = nodes - 1;
    double x = 0.5 * (lesser(greater(first, -1.0), 1.0) + 1.0) * (double)steps;
    double y = 0.5 * (lesser(greater(second, -1.0), 1.0) + 1.0) * (double)steps;
    int64_t i = cell(x, steps), j = cell(y, steps);
    double low = between(surface + i * nodes, j, j + 1, y - (double)j);
    double high = between(surface + (i + 1) * nodes, j, j + 1, y - (double)j);
    return low + (x - (double)i) * (high - low);
}

static double pd_share(const AxisControl *c, double error_m) {
    double size_m = fabs(error_m), fine_m = c->fuzzy.fine_m, weight_1_m = c->fuzzy.weight_1_m;
    if (size_m <= fine_m) return 0.0;
    if (size_m >= c->fuzzy.coarse_m) return 1.0;
    double way = weight_1_m * (size_m - fine_m), whole = weight_1_m * (c->fuzzy.coarse_m - fine_m);
    return exp(way - whole) * expm1(-way) / expm1(-whole);
}

static double fuzzy_setpoint(const AxisControl *c, double error_m, double change_m_s, double pd_m_s) {
    double share = pd_share(c, error_m);
    if (share >= 1.0) return pd_m_s;
    const double *surface = (const double *)(intptr_t)c->fuzzy.surface.address;
    double fuzzy_m_s = c->fuzzy.output_m_s * interpolated(surface, c->fuzzy.surface.columns,
                                                          c->fuzzy.error_1_m * error_m,
                                                          c->fuzzy.change_s_m * change_m_s);
    return share * pd_m_s + (1.0 - share) * fuzzy_m_s;
}

static double velocity_setpoint(const AxisControl *c, PositionState *state, double error_m, double added_m_s) {
    double change_m_s = state->change_m_s, gain_1_s2 = c->position_loop.ki_1_s2, held_m_s = state->integral_m_s;
    if (isfinite(state->error_m)) {
        double difference_m_s = (error_m - state->error_m) / c->period_s;
        change_m_s += c->position_loop.derivative_blend * (difference_m_s - state->change_m_s);
    }
    double wanted_m_s = c->position_loop.kp_1_s * error_m + c->position_loop.kd * change_m_s;
    if (c->fuzzy.enabled) {
        wanted_m_s = fuzzy_setpoint(c, error_m, change_m_s, wanted_m_s);
        gain_1_s2 = c->fuzzy.ki_1_s2;
        if (fabs(error_m) > c->fuzzy.fine_m) gain_1_s2 = held_m_s = 0.0;
    }
    wanted_m_s += added_m_s;
    double stepped_m_s = held_m_s + gain_1_s2 * c->period_s * error_m, sum_m_s = wanted_m_s + stepped_m_s;
    if (fabs(sum_m_s) > c->limits.velocity_m_s && sum_m_s * error_m > 0.0) stepped_m_s = held_m_s;
    *state = (PositionState){error_m, change_m_s, stepped_m_s};
    return wanted_m_s + stepped_m_s;
}
