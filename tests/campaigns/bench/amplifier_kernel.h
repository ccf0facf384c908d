/* The amplifier of one axis and the advance by a number of substeps in C: hil_sim/plant/amplifier.py and
 * integrate.py. Include plant_kernel.h first. */

static void estimate_velocity(AxisPlantState *s, double resolution_m, int64_t counts, double filter_gain,
                              double dt_s) {
    double raw_m_s = (double)(counts - s->encoder_counts) * resolution_m / dt_s;
    s->encoder_velocity_m_s =
        standing_if_slow(s->encoder_velocity_m_s + filter_gain * (raw_m_s - s->encoder_velocity_m_s));
    s->encoder_counts = counts;
}

static void enter_loop(AxisPlantState *s, const SetPoint *sp, double force_constant_n_a) {
    s->position_setpoint_m = sp->position_m;
    s->velocity_setpoint_m_s = sp->velocity_m_s;
    if (sp->loop <= LOOP_CURRENT || s->loop <= LOOP_CURRENT)
        s->velocity_integral_n = s->current_a * force_constant_n_a;
    if (sp->loop == LOOP_OFF)
        s->current_a = s->current_integral_v = s->voltage_v = s->velocity_integral_n = 0.0;
    s->loop = sp->loop;
}

static double current_reference_a(const AxisPlant *p, AxisPlantState *s, const SetPoint *sp, double resolution_m,
                                  double force_constant_n_a, double fraction, double dt_s, double span_s) {
    double limit_a = lesser(sp->current_limit_a, p->amplifier.peak_current_a);
    double high_a = limit_a - sp->limit_reduction_positive_a, low_a = sp->limit_reduction_negative_a - limit_a;
    if (sp->loop == LOOP_CURRENT)
        return greater(low_a, lesser(high_a, sp->current_a + sp->current_offset_a));
    double velocity_m_s = sp->velocity_offset_m_s;
    if (sp->loop == LOOP_POSITION) {
        double step_m = sp->position_m - s->position_setpoint_m;
        double error_m = s->position_setpoint_m + fraction * step_m - (double)s->encoder_counts * resolution_m;
        velocity_m_s +=
            p->amplifier.position_gain_1_s * error_m + p->amplifier.velocity_feedforward * step_m / span_s;
    } else {
        velocity_m_s += s->velocity_setpoint_m_s + fraction * (sp->velocity_m_s - s->velocity_setpoint_m_s);
    }
    double error_m_s = velocity_m_s - s->encoder_velocity_m_s;
    double integral_n = s->velocity_integral_n + p->amplifier.velocity_integral_n_m * error_m_s * dt_s;
    double wanted_a = (p->amplifier.velocity_gain_n_s_m * error_m_s + integral_n) / force_constant_n_a +
                      sp->current_offset_a;
    double limited_a = greater(low_a, lesser(high_a, wanted_a));
    if (limited_a == wanted_a || (wanted_a - limited_a) * error_m_s < 0.0) s->velocity_integral_n = integral_n;
    return limited_a;
}

static void flow(const AxisPlant *p, AxisPlantState *s, double back_emf_v, double decay) {
    double final_a = (s->voltage_v - back_emf_v) / p->winding.resistance_v_a;
    s->current_a = final_a + (s->current_a - final_a) * decay;
}

static void drive_current(const AxisPlant *p, AxisPlantState *s, double reference_a, double back_emf_v,
                          double decay, double dt_s) {
    if (!p->winding.enabled) {
        s->current_a = reference_a;
        return;
    }
    double limit_v = p->amplifier.voltage_limit_v, gain_v_a = p->amplifier.current_gain_v_a;
    if (gain_v_a > 0.0) {
        double proportional_v = gain_v_a * (reference_a - s->current_a);
        s->voltage_v = greater(-limit_v, lesser(limit_v, proportional_v));
        flow(p, s, back_emf_v, decay);
        return;
    }
    double bandwidth_1_s = 2.0 * PI * p->amplifier.current_bandwidth_hz;
    double proportional_v_a = p->winding.inductance_h * bandwidth_1_s;
    double integral_gain_v_a = p->winding.resistance_v_a * bandwidth_1_s * dt_s;
    double error_a = reference_a - s->current_a;
    double wanted_v = proportional_v_a * error_a + s->current_integral_v;
    s->voltage_v = greater(-limit_v, lesser(limit_v, wanted_v));
    s->current_integral_v += integral_gain_v_a * (error_a + (s->voltage_v - wanted_v) / proportional_v_a);
    flow(p, s, back_emf_v, decay);
}

static int64_t nearest_count(double position_m, double resolution_m) {
    return (int64_t)floor(position_m / resolution_m + 0.5);
}

static void advance_axis(const AxisPlant *p, AxisPlantState *s, const SetPoint *sp, int64_t substeps,
                         double dt_s) {
    double force_constant_n_a = p->mechanics.force_constant_n_a, resolution_m = p->encoder.resolution_m;
    double span_s = (double)substeps * dt_s;
    double decay =
        p->winding.enabled ? exp(-p->winding.resistance_v_a * dt_s / p->winding.inductance_h) : 0.0;
    double w_dt = 2.0 * PI * p->amplifier.velocity_filter_hz * dt_s, filter_gain = w_dt / (1.0 + w_dt);
    if (sp->loop != s->loop) enter_loop(s, sp, force_constant_n_a);
    for (int64_t index = 0; index < substeps; index++) {
        if (sp->loop != LOOP_OFF) {
            double fraction = (double)(index + 1) / (double)substeps;
            double reference_a =
                current_reference_a(p, s, sp, resolution_m, force_constant_n_a, fraction, dt_s, span_s);
            drive_current(p, s, reference_a, force_constant_n_a * s->motor_velocity_m_s, decay, dt_s);
        }
        mechanics_step(p, s, dt_s);
        int64_t counts = nearest_count(s->motor_position_m, resolution_m) - s->encoder_origin_counts;
        estimate_velocity(s, resolution_m, counts, filter_gain, dt_s);
        s->substeps += 1;
        s->time_s = (double)s->substeps * dt_s;
    }
    s->position_setpoint_m = sp->position_m;
    s->velocity_setpoint_m_s = sp->velocity_m_s;
    s->current_measured_a = s->current_a;
    if (p->scale.enabled)
        s->scale_counts = nearest_count(measured_point_m(p, s), p->scale.resolution_m) - s->scale_origin_counts;
}
