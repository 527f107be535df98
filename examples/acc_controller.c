/* The built-in controller `acc` (cruise control and emergency braking) as a shared library, to the last bit.
 *
 *   cc -std=c11 -O2 -ffp-contract=off -shared -fPIC -I controllers/include -o acc_controller.so examples/acc_controller.c -lm
 *   closecall run low-thw-overtake --controller lib:./acc_controller.so
 *
 * Without -ffp-contract=off, compilers for processors with fused multiply-add round differently, and so the last bits differ. */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "closecall_controller.h"

/* The constants of the built-in controller, which are no settings. */
#define COMFORT_BRAKING_MPS2 1.5
#define GAP_GAIN_PER_S 0.3
#define MAX_ACCELERATION_MPS2 1.5

typedef struct {
    double limit_mps;                              /* speed without a lead vehicle (m/s) */
    double time_gap_s, standstill_gap_m;           /* of the cruise control */
    int has_aeb;                                   /* whether there is emergency braking */
    double trigger_mps2, max_deceleration_mps2;    /* of the emergency braking */
    double aeb_standstill_gap_m;
    double braked;                                 /* deceleration of the emergency braking in the last step (m/s^2) */
    double comfort;                                /* acceleration of the cruise control in the last step (m/s^2) */
    int has_stepped;
    int64_t before_ns;                             /* time of the last step (ns) */
} acc;

static double least(double a, double b) { return a < b ? a : b; }
static double most(double a, double b) { return a > b ? a : b; }

/* Returns a setting of the scenario, or `absent`. */
static double setting(const closecall_setup *setup, const char *name, double absent) {
    for (uint64_t i = 0; i < setup->setting_count; i++) {
        if (strcmp(setup->settings[i].name, name) == 0) return setup->settings[i].value;
    }
    return absent;
}

/* Returns the constant deceleration (m/s^2) that keeps a distance of `left_m` to the vehicle ahead, if that vehicle keeps its
 * deceleration. */
static double required(double v, const closecall_input *in, double left_m) {
    double room = most(in->front_gap_m - left_m, 0.1), lead = in->front_speed_mps, braking = -in->front_acceleration_mps2;
    double removing = v > lead ? (v - lead) * (v - lead) / (2.0 * room) : 0.0;
    if (braking <= 0.0 || lead <= 0.0) return removing;
    double to_stop = v * v / (2.0 * (room + lead * lead / (2.0 * braking)));
    if (v * braking >= lead * to_stop) return to_stop;
    return v > lead ? braking + removing : 0.0;
}

/* Returns a limit that has the value `slow` up to 5 m/s, the value `fast` from 20 m/s on, and is linear in between. */
static double limited(double slow, double fast, double v) {
    return slow + least(most((v - 5.0) / 15.0, 0.0), 1.0) * (fast - slow);
}

/* Returns the acceleration (m/s^2) of the cruise control, without its jerk limit. It controls the closing speed that the error
 * of the gap allows. */
static double cruise(const acc *own, const closecall_input *in) {
    double v = in->speed_mps, a = (own->limit_mps - v) / 2.0;
    if (in->has_front) {
        double error = in->front_gap_m - most(own->time_gap_s * v, own->standstill_gap_m);
        double touch = COMFORT_BRAKING_MPS2 / (GAP_GAIN_PER_S * GAP_GAIN_PER_S);
        double allowed = error < touch ? GAP_GAIN_PER_S * error : sqrt(2.0 * COMFORT_BRAKING_MPS2 * (error - 0.5 * touch));
        double gain = most(own->time_gap_s, 0.45), opening = in->front_speed_mps - v;
        double slower = (allowed + opening) / gain, faster = (least(allowed, 4.0) + opening) / gain;
        double needed = required(v, in, own->standstill_gap_m);
        a = least(a, slower < 0.0 ? slower : most(faster, 0.0));
        if (needed > limited(5.0, 3.5, v)) a = least(a, -needed);
    }
    return least(most(a, -limited(5.0, 3.5, v)), MAX_ACCELERATION_MPS2);
}

/* Returns the deceleration (m/s^2) of the emergency braking, or 0 if none is needed. */
static double emergency(const acc *own, const closecall_input *in) {
    double v = in->speed_mps;
    int has_braked = own->braked > 0.0;
    if (has_braked && v < 0.1) return in->has_front && in->front_speed_mps < 1.0 ? 2.0 : 0.0;
    double needed = in->has_front ? required(v, in, own->aeb_standstill_gap_m) : 0.0;
    return needed > (has_braked ? 1.5 : own->trigger_mps2) ? least(1.15 * needed, own->max_deceleration_mps2) : 0.0;
}

uint32_t closecall_controller_abi(void) { return CLOSECALL_CONTROLLER_ABI; }
const char *closecall_controller_name(void) { return "acc in C"; }
const char *closecall_controller_version(void) { return "1"; }

void *closecall_controller_create(const closecall_setup *setup) {
    acc *own = calloc(1, sizeof *own);
    if (!own) return NULL;
    own->limit_mps = setting(setup, "acc.set_speed_mps", setup->speed_limit_mps);
    own->time_gap_s = setting(setup, "acc.time_gap_s", NAN);
    own->standstill_gap_m = setting(setup, "acc.standstill_gap_m", NAN);
    own->trigger_mps2 = setting(setup, "aeb.trigger_mps2", NAN);
    own->has_aeb = !isnan(own->trigger_mps2);
    own->max_deceleration_mps2 = setting(setup, "aeb.max_deceleration_mps2", NAN);
    own->aeb_standstill_gap_m = setting(setup, "aeb.standstill_gap_m", NAN);
    return own;
}

int32_t closecall_controller_step(void *controller, const closecall_input *in, closecall_command *command) {
    acc *own = controller;
    double v = in->speed_mps;
    own->braked = own->has_aeb ? emergency(own, in) : 0.0;
    double step_s = own->has_stepped ? 1e-9 * (double)(in->time_ns - own->before_ns) : 0.0;
    own->has_stepped = 1;
    own->before_ns = in->time_ns;
    double change = limited(5.0, 2.5, v) * step_s, wanted = cruise(own, in);
    own->comfort = least(most(wanted, own->comfort - change), own->comfort + change);
    command->acceleration_mps2 = own->braked > 0.0 ? least(own->comfort, -own->braked) : own->comfort;
    command->state = own->braked > 0.0 ? CLOSECALL_STATE_EMERGENCY_BRAKING : CLOSECALL_STATE_FOLLOWING;
    return 0;
}

void closecall_controller_destroy(void *controller) { free(controller); }
