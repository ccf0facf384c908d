/* One axis of the plant in C: hil_sim/plant/{step,amplifier,integrate}.py with the effects of
 * hil_sim/physics that are read here (batch.py refuses a plant with others), the same operations on doubles in
 * the same order. AxisPlant, AxisPlantState and SetPoint are the simulator's own records; c_records.py writes
 * their declarations. Units are in the names, as there. */
#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#define PI 3.14159265358979311600
#define NEGLIGIBLE_M_S 1e-15
#define NEGLIGIBLE_N 1e-9
#define NEGLIGIBLE_EXPONENT 36.0
enum { LOOP_OFF, LOOP_CURRENT, LOOP_VELOCITY, LOOP_POSITION };
enum { GMS_ELEMENTS = 8, COGGING_TERMS = 6 };

static inline double lesser(double a, double b) { return b < a ? b : a; }
static inline double greater(double a, double b) { return b > a ? b : a; }
static inline double standing_if_slow(double m_s) { return fabs(m_s) > NEGLIGIBLE_M_S ? m_s : 0.0; }

static double friction_level_n(const AxisPlant *p, double speed_m_s) {
    double level = 0.0;
    if (p->coulomb_friction.enabled) level += p->coulomb_friction.coulomb_n;
    if (p->stribeck_friction.enabled) {
        double ratio = speed_m_s / p->stribeck_friction.stribeck_m_s;
        double exponent = ratio * ratio;
        level += exponent < NEGLIGIBLE_EXPONENT ? p->stribeck_friction.stribeck_n * exp(-exponent) : 0.0;
    }
    return level;
}

typedef struct {
    double level, damping;
} FrictionFactors;

static FrictionFactors friction_factors(const AxisPlant *p, const AxisPlantState *s) {
    FrictionFactors f = {1.0, 1.0};
    if (p->temperature_dependent_friction.enabled) {
        double level = p->temperature_dependent_friction.warm_level_share, damping = p->temperature_dependent_friction.warm_damping_share;
        double cold = exp(-s->temperature_dependent_friction.temperature_rise_k / p->temperature_dependent_friction.warmth_scale_k);
        f.level *= level + (1.0 - level) * cold;
        f.damping *= damping + (1.0 - damping) * cold;
    }
    if (p->lubrication_loss.enabled) {
        double since_s = s->time_s - p->lubrication_loss.start_s;
        double passed = lesser(1.0, greater(0.0, since_s / p->lubrication_loss.transition_s));
        f.level *= 1.0 + (p->lubrication_loss.level_factor - 1.0) * passed;
        f.damping *= 1.0 + (p->lubrication_loss.damping_factor - 1.0) * passed;
    }
    if (p->friction_ageing.enabled) {
        f.level *= greater(0.0, 1.0 + p->friction_ageing.level_1_m * s->friction_ageing.travelled_m);
        f.damping *= greater(0.0, 1.0 + p->friction_ageing.damping_1_m * s->friction_ageing.travelled_m);
    }
    return f;
}

static double cogging_n(const AxisPlant *p, double position_m, double turn_rad_m) {
    double force = 0.0, turn_rad = position_m * turn_rad_m;
    for (int k = 0; k < COGGING_TERMS && p->cogging.amplitude_n[k] != 0.0; k++)
        force += p->cogging.amplitude_n[k] * sin(p->cogging.harmonic[k] * turn_rad + p->cogging.phase_rad[k]);
    return force;
}

static double screw_error(const AxisPlant *p, double position_m, double turn_rad_m, double temperature_k,
                            double *slope) {
    double error_m = 0.0;
    *slope = 0.0;
    if (p->lead_error_cumulative.enabled) {
        error_m += p->lead_error_cumulative.relative_error * position_m;
        *slope += p->lead_error_cumulative.relative_error;
    }
    if (p->lead_error_periodic.enabled) {
        double harmonic = p->lead_error_periodic.harmonic, amplitude_m = p->lead_error_periodic.amplitude_m;
        double phase = harmonic * turn_rad_m * position_m + p->lead_error_periodic.phase_rad;
        error_m += amplitude_m * sin(phase);
        *slope += amplitude_m * harmonic * turn_rad_m * cos(phase);
    }
    if (p->thermal_expansion.enabled) {
        double growth = p->thermal_expansion.expansion_1_k * (temperature_k - p->thermal_expansion.reference_k);
        error_m += growth * (position_m - p->thermal_expansion.fixed_end_m);
        *slope += growth;
    }
    return error_m;
}

static void lugre_slide(const AxisPlant *p, AxisPlantState *s, double velocity_m_s, double level, double dt_s) {
    if (level < NEGLIGIBLE_N) {
        s->presliding_lugre.bristle_m = 0.0;
        return;
    }
    double reach_m = level / p->presliding_lugre.stiffness_n_m;
    double final_m = copysign(reach_m, velocity_m_s);
    s->presliding_lugre.bristle_m = final_m + (s->presliding_lugre.bristle_m - final_m) * exp(-fabs(velocity_m_s) * dt_s / reach_m);
}

static double gms_dragged(double before, double stuck, double bound, double direction) {
    if ((before - bound) * direction > 0.0) return before;
    return (stuck - bound) * direction > 0.0 ? bound : stuck;
}

static void gms_slide(const AxisPlant *p, AxisPlantState *s, double velocity_m_s, double level, double dt_s) {
    if (level < NEGLIGIBLE_N) {
        for (int i = 0; i < GMS_ELEMENTS; i++) s->presliding_gms.element_n[i] = 0.0;
        return;
    }
    if (velocity_m_s == 0.0) return;
    double direction = velocity_m_s > 0.0 ? 1.0 : -1.0;
    bool reversed_motion = direction != s->presliding_gms.slip_direction;
    s->presliding_gms.slip_direction = direction;
    double travel_m = velocity_m_s * dt_s;
    double follow_n = p->presliding_gms.attraction_n_s * dt_s;
    double blend = follow_n / (level + follow_n);
    for (int i = 0; i < GMS_ELEMENTS && p->presliding_gms.share[i] != 0.0; i++) {
        double bound = p->presliding_gms.share[i] * level * direction;
        double stuck = s->presliding_gms.element_n[i] + p->presliding_gms.stiffness_n_m[i] * travel_m;
        if (reversed_motion || s->presliding_gms.slipping[i] == 0) {
            bool over = (stuck - bound) * direction > 0.0;
            s->presliding_gms.slipping[i] = over;
            s->presliding_gms.element_n[i] = over ? gms_dragged(s->presliding_gms.element_n[i], stuck, bound, direction) : stuck;
        } else {
            double relaxed = s->presliding_gms.element_n[i] + blend * (bound - s->presliding_gms.element_n[i]);
            s->presliding_gms.element_n[i] = (stuck - relaxed) * direction > 0.0 ? relaxed : stuck;
        }
    }
}

static double gms_force_and_damping(const AxisPlant *p, const AxisPlantState *s, double *extra) {
    double force = 0.0, sticking = 0.0;
    for (int i = 0; i < GMS_ELEMENTS && p->presliding_gms.share[i] != 0.0; i++) {
        force += s->presliding_gms.element_n[i];
        if (s->presliding_gms.slipping[i] == 0) sticking += p->presliding_gms.share[i];
    }
    *extra = p->presliding_gms.micro_damping_n_s_m * sticking;
    return force;
}

static double lugre_force_and_damping(const AxisPlant *p, const AxisPlantState *s, double velocity_m_s,
                                      double level, double *extra) {
    *extra = 0.0;
    if (level < NEGLIGIBLE_N) return 0.0;
    double share = p->presliding_lugre.stiffness_n_m * s->presliding_lugre.bristle_m / level;
    double creep = 1.0 - copysign(share, share * velocity_m_s);
    *extra = p->presliding_lugre.bristle_damping_n_s_m * greater(0.0, creep);
    return p->presliding_lugre.stiffness_n_m * s->presliding_lugre.bristle_m;
}

static double slide(const AxisPlant *p, AxisPlantState *s, double mass_kg, double velocity_m_s, double force_n,
                    double dt_s) {
    FrictionFactors changed = friction_factors(p, s);
    double level_n = changed.level * friction_level_n(p, fabs(velocity_m_s)), damping = 0.0, after_m_s, extra;
    if (p->viscous_friction.enabled) damping += p->viscous_friction.viscous_n_s_m;
    damping *= changed.damping;
    if (p->presliding_lugre.enabled) {
        double bristle_n = lugre_force_and_damping(p, s, velocity_m_s, level_n, &extra);
        double free_m_s = velocity_m_s + (force_n - bristle_n) * dt_s / mass_kg;
        after_m_s = free_m_s / (1.0 + (damping + extra) * dt_s / mass_kg);
        lugre_slide(p, s, after_m_s, level_n, dt_s);
    } else if (p->presliding_gms.enabled) {
        double elements_n = gms_force_and_damping(p, s, &extra);
        double free_m_s = velocity_m_s + (force_n - elements_n) * dt_s / mass_kg;
        after_m_s = free_m_s / (1.0 + (damping + extra) * dt_s / mass_kg);
        gms_slide(p, s, after_m_s, level_n, dt_s);
    } else {
        double free_m_s = velocity_m_s + force_n * dt_s / mass_kg;
        double remaining = fabs(free_m_s) - level_n * dt_s / mass_kg;
        double sliding_m_s = remaining > 0.0 ? copysign(remaining, free_m_s) : 0.0;
        after_m_s = sliding_m_s / (1.0 + damping * dt_s / mass_kg);
    }
    s->friction_n = force_n - mass_kg * (after_m_s - velocity_m_s) / dt_s;
    return standing_if_slow(after_m_s);
}

static double coupling_n(const AxisPlant *p, double deflection_m, double rate_m_s) {
    return p->drive_compliance.stiffness_n_m * deflection_m + p->drive_compliance.damping_n_s_m * rate_m_s;
}

static double transmitted_force_n(const AxisPlant *p, double gap_m, double rate_m_s) {
    if (!p->backlash.enabled) return coupling_n(p, gap_m, rate_m_s);
    double play_m = p->backlash.play_m;
    double deflection_m = gap_m > play_m ? gap_m - play_m : gap_m < -play_m ? gap_m + play_m : 0.0;
    if (deflection_m == 0.0 && play_m > 0.0) return 0.0;
    double force = coupling_n(p, deflection_m, rate_m_s);
    return play_m > 0.0 && force * deflection_m <= 0.0 ? 0.0 : force;
}

static double swing(const AxisPlant *p, AxisPlantState *s, double dt_s) {
    double deflection_m = s->carried_position_m - s->table_position_m;
    double rate_m_s = s->carried_velocity_m_s - s->table_velocity_m_s;
    double w = 2.0 * PI * p->structural_mode.frequency_hz;
    double force = p->structural_mode.mass_kg *
                   (w * w * deflection_m + 2.0 * p->structural_mode.damping_ratio * w * rate_m_s);
    s->carried_velocity_m_s =
        standing_if_slow(s->carried_velocity_m_s - force * dt_s / p->structural_mode.mass_kg);
    return force;
}

static double measured_point_m(const AxisPlant *p, const AxisPlantState *s) {
    return p->structural_mode.enabled ? s->carried_position_m : s->table_position_m;
}

static void mechanics_step(const AxisPlant *p, AxisPlantState *s, double dt_s) {
    double turn_rad_m = 2.0 * PI / p->mechanics.lead_m, slope, error_m;
    double motor_n = p->mechanics.force_constant_n_a * s->current_a, load_n = 0.0;
    if (p->cogging.enabled) motor_n += cogging_n(p, s->motor_position_m, turn_rad_m);
    if (p->constant_force.enabled) load_n += p->constant_force.force_n;
    if (p->structural_mode.enabled) load_n += swing(p, s, dt_s);
    if (p->drive_compliance.enabled) {
        error_m = screw_error(p, s->motor_position_m, turn_rad_m, s->thermal_expansion.temperature_k, &slope);
        double gap_m = s->motor_position_m + error_m - s->table_position_m;
        double rate_m_s = s->motor_velocity_m_s * (1.0 + slope) - s->table_velocity_m_s;
        s->transmitted_n = transmitted_force_n(p, gap_m, rate_m_s);
        s->motor_velocity_m_s += (motor_n - s->transmitted_n * (1.0 + slope)) * dt_s / p->mechanics.motor_mass_kg;
        double table_n = s->transmitted_n + load_n;
        s->table_velocity_m_s = slide(p, s, p->mechanics.table_mass_kg, s->table_velocity_m_s, table_n, dt_s);
        s->motor_position_m += dt_s * s->motor_velocity_m_s;
        s->table_position_m += dt_s * s->table_velocity_m_s;
    } else {
        double mass_kg = p->mechanics.motor_mass_kg + p->mechanics.table_mass_kg;
        double velocity_m_s = slide(p, s, mass_kg, s->motor_velocity_m_s, motor_n + load_n, dt_s);
        s->transmitted_n = motor_n - p->mechanics.motor_mass_kg * (velocity_m_s - s->motor_velocity_m_s) / dt_s;
        s->motor_velocity_m_s = velocity_m_s;
        s->motor_position_m += dt_s * velocity_m_s;
        error_m = screw_error(p, s->motor_position_m, turn_rad_m, s->thermal_expansion.temperature_k, &slope);
        s->table_position_m = s->motor_position_m + error_m;
        s->table_velocity_m_s = velocity_m_s * (1.0 + slope);
    }
    if (p->structural_mode.enabled) s->carried_position_m += dt_s * s->carried_velocity_m_s;
    double friction_w = s->friction_n * s->table_velocity_m_s;
    if (p->thermal_expansion.enabled) {
        double lost_w = (s->thermal_expansion.temperature_k - p->thermal_expansion.ambient_k) / p->thermal_expansion.resistance_k_w;
        double flow_w = p->thermal_expansion.heat_share * friction_w - lost_w;
        s->thermal_expansion.temperature_k = s->thermal_expansion.temperature_k + flow_w * dt_s / p->thermal_expansion.heat_capacity_j_k;
    }
    if (p->temperature_dependent_friction.enabled) {
        double flow_w = friction_w - s->temperature_dependent_friction.temperature_rise_k / p->temperature_dependent_friction.resistance_k_w;
        double stepped_k = s->temperature_dependent_friction.temperature_rise_k + flow_w * dt_s / p->temperature_dependent_friction.heat_capacity_j_k;
        s->temperature_dependent_friction.temperature_rise_k = greater(0.0, stepped_k);
    }
    if (p->friction_ageing.enabled) s->friction_ageing.travelled_m += fabs(s->table_velocity_m_s) * dt_s;
}
