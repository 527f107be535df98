/* The built-in controller `acc` as an FMU for co-simulation, to the last bit: FMI 2.0 with -DFMI=2, FMI 3.0 with -DFMI=3.
 *
 *   python3 examples/fmu/build.py 2 acc.fmu
 *   closecall run low-thw-overtake --controller fmu:./acc.fmu
 *
 * The headers that the FMI standard publishes have the same types. The controller itself is examples/acc_controller.c. */
#include <stdbool.h>
#include <stddef.h>

#include "../acc_controller.c"

/* The value references of modelDescription-fmi2.xml and modelDescription-fmi3.xml. */
enum {
    EGO_SPEED, FRONT_PRESENT, FRONT_GAP, FRONT_SPEED, FRONT_ACCELERATION,
    ROAD_SPEED_LIMIT, TIME_GAP, STANDSTILL_GAP, SET_SPEED, TRIGGER, MAX_DECELERATION, AEB_STANDSTILL_GAP,
    ACCELERATION, STATE, TIME, VARIABLES
};

/* An instance. */
typedef struct {
    double values[VARIABLES];
    acc own;
} unit;

static const double START[VARIABLES] = {
    [ROAD_SPEED_LIMIT] = 36.1, [TIME_GAP] = 1.0, [STANDSTILL_GAP] = 2.0,
    /* Negative: no set speed and no emergency braking. */
    [SET_SPEED] = -1.0, [TRIGGER] = -1.0,
};

static void unit_reset(unit *u) {
    memset(u, 0, sizeof *u);
    memcpy(u->values, START, sizeof START);
}

static void unit_initialize(unit *u) {
    const double *v = u->values;
    memset(&u->own, 0, sizeof u->own);
    u->own.limit_mps = v[SET_SPEED] >= 0.0 ? v[SET_SPEED] : v[ROAD_SPEED_LIMIT];
    u->own.time_gap_s = v[TIME_GAP];
    u->own.standstill_gap_m = v[STANDSTILL_GAP];
    u->own.has_aeb = v[TRIGGER] >= 0.0;
    u->own.trigger_mps2 = v[TRIGGER];
    u->own.max_deceleration_mps2 = v[MAX_DECELERATION];
    u->own.aeb_standstill_gap_m = v[AEB_STANDSTILL_GAP];
}

static void unit_step(unit *u, double time_s) {
    double *v = u->values;
    closecall_input in = {0};
    closecall_command command = {NAN, 0, 0};
    in.time_ns = llround(1e9 * time_s);
    in.speed_mps = v[EGO_SPEED];
    in.has_front = v[FRONT_PRESENT] != 0.0;
    in.front_gap_m = v[FRONT_GAP];
    in.front_speed_mps = v[FRONT_SPEED];
    in.front_acceleration_mps2 = v[FRONT_ACCELERATION];
    closecall_controller_step(&u->own, &in, &command);
    v[ACCELERATION] = command.acceleration_mps2;
    v[STATE] = command.state;
    v[TIME] = time_s;
}

#if FMI == 2
typedef void *fmi2Component;
typedef int fmi2Status;
enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal };

const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }

fmi2Component fmi2Instantiate(const char *name, int type, const char *guid, const char *resources, const void *callbacks,
                              int visible, int logging) {
    (void)name, (void)type, (void)resources, (void)callbacks, (void)visible, (void)logging;
    if (strcmp(guid, "{closecall-acc}") != 0) return NULL;
    unit *u = malloc(sizeof *u);
    if (u) unit_reset(u);
    return u;
}

void fmi2FreeInstance(fmi2Component c) { free(c); }
fmi2Status fmi2Reset(fmi2Component c) { unit_reset(c); return fmi2OK; }
fmi2Status fmi2Terminate(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2SetDebugLogging(fmi2Component c, int on, size_t n, const char *const *categories) {
    (void)c, (void)on, (void)n, (void)categories;
    return fmi2OK;
}

fmi2Status fmi2SetupExperiment(fmi2Component c, int has_tolerance, double tolerance, double start, int has_stop, double stop) {
    (void)c, (void)has_tolerance, (void)tolerance, (void)start, (void)has_stop, (void)stop;
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { unit_initialize(c); return fmi2OK; }

#define ACCESS(NAME, TYPE, OF_TYPE)                                                                            \
    fmi2Status fmi2Set##NAME(fmi2Component c, const unsigned *vr, size_t n, const TYPE *value) {               \
        for (size_t i = 0; i < n; i++) {                                                                       \
            if (vr[i] >= VARIABLES || !(OF_TYPE)) return fmi2Error;                                            \
            ((unit *)c)->values[vr[i]] = (double)value[i];                                                     \
        }                                                                                                      \
        return fmi2OK;                                                                                         \
    }                                                                                                          \
    fmi2Status fmi2Get##NAME(fmi2Component c, const unsigned *vr, size_t n, TYPE *value) {                     \
        for (size_t i = 0; i < n; i++) {                                                                       \
            if (vr[i] >= VARIABLES || !(OF_TYPE)) return fmi2Error;                                            \
            value[i] = (TYPE)((unit *)c)->values[vr[i]];                                                       \
        }                                                                                                      \
        return fmi2OK;                                                                                         \
    }
ACCESS(Real, double, vr[i] != FRONT_PRESENT && vr[i] != STATE)
ACCESS(Integer, int, vr[i] == STATE)
ACCESS(Boolean, int, vr[i] == FRONT_PRESENT)

fmi2Status fmi2SetString(fmi2Component c, const unsigned *vr, size_t n, const char *const *value) {
    (void)c, (void)vr, (void)value;
    return n ? fmi2Error : fmi2OK;
}
fmi2Status fmi2GetString(fmi2Component c, const unsigned *vr, size_t n, const char **value) {
    (void)c, (void)vr, (void)value;
    return n ? fmi2Error : fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component c, double time_s, double step_s, int no_set_state) {
    (void)step_s, (void)no_set_state;
    unit_step(c, time_s);
    return fmi2OK;
}
#endif

#if FMI == 3
typedef void *fmi3Instance;
typedef int fmi3Status;
enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal };

const char *fmi3GetVersion(void) { return "3.0"; }

fmi3Instance fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources, bool visible, bool logging,
                                         bool events, bool early, const unsigned *intermediate, size_t n, void *environment,
                                         void (*log)(void *, fmi3Status, const char *, const char *), void (*update)(void)) {
    (void)name, (void)resources, (void)visible, (void)logging, (void)events, (void)early, (void)intermediate, (void)n;
    (void)environment, (void)log, (void)update;
    if (strcmp(token, "{closecall-acc}") != 0) return NULL;
    unit *u = malloc(sizeof *u);
    if (u) unit_reset(u);
    return u;
}

void fmi3FreeInstance(fmi3Instance c) { free(c); }
fmi3Status fmi3Reset(fmi3Instance c) { unit_reset(c); return fmi3OK; }
fmi3Status fmi3Terminate(fmi3Instance c) { (void)c; return fmi3OK; }

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, bool has_tolerance, double tolerance, double start, bool has_stop,
                                       double stop) {
    (void)c, (void)has_tolerance, (void)tolerance, (void)start, (void)has_stop, (void)stop;
    return fmi3OK;
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { unit_initialize(c); return fmi3OK; }

#define ACCESS(NAME, TYPE, OF_TYPE)                                                                                   \
    fmi3Status fmi3Set##NAME(fmi3Instance c, const unsigned *vr, size_t n, const TYPE *value, size_t count) {         \
        for (size_t i = 0; i < n && i < count; i++) {                                                                 \
            if (vr[i] >= VARIABLES || !(OF_TYPE)) return fmi3Error;                                                   \
            ((unit *)c)->values[vr[i]] = (double)value[i];                                                            \
        }                                                                                                             \
        return fmi3OK;                                                                                                \
    }                                                                                                                 \
    fmi3Status fmi3Get##NAME(fmi3Instance c, const unsigned *vr, size_t n, TYPE *value, size_t count) {               \
        for (size_t i = 0; i < n && i < count; i++) {                                                                 \
            if (vr[i] >= VARIABLES || !(OF_TYPE)) return fmi3Error;                                                   \
            value[i] = (TYPE)((unit *)c)->values[vr[i]];                                                              \
        }                                                                                                             \
        return fmi3OK;                                                                                                \
    }
ACCESS(Float64, double, vr[i] != FRONT_PRESENT && vr[i] != STATE)
ACCESS(Int32, int32_t, vr[i] == STATE)
ACCESS(Boolean, bool, vr[i] == FRONT_PRESENT)

fmi3Status fmi3DoStep(fmi3Instance c, double time_s, double step_s, bool no_set_state, bool *event, bool *terminate,
                      bool *early, double *reached_s) {
    (void)no_set_state;
    unit_step(c, time_s);
    *event = *terminate = *early = false;
    *reached_s = time_s + step_s;
    return fmi3OK;
}
#endif
