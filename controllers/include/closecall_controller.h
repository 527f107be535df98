/* The interface between Closecall and a controller that is a shared library: closecall run SCENARIO --controller lib:PATH
 *
 * Build:  cc -std=c11 -O2 -ffp-contract=off -shared -fPIC -o my_controller.so my_controller.c
 *
 * The library exports four functions:
 *
 *   closecall_controller_abi      returns CLOSECALL_CONTROLLER_ABI
 *   closecall_controller_create   creates a controller; called once for each run
 *   closecall_controller_step     answers one control step
 *   closecall_controller_destroy  frees the controller at the end of the run
 *
 * and may export three more: closecall_controller_error, closecall_controller_name, closecall_controller_version.
 *
 * All functions are called by one thread at a time. Each run has a controller of its own. Several runs follow each other in one
 * process: what the library keeps in variables of its own outlives a run, and makes outcomes depend on the order of the
 * samples. All pointers that Closecall passes are valid during the call only.
 *
 * An exception of C++ must not leave a function: it would abort the process, which costs the sample (SIGABRT). A function catches it,
 * answers NULL or another number than 0, and gives its text to closecall_controller_error.
 *
 * Times are in s, lengths in m, speeds in m/s, accelerations in m/s^2, angles in rad. x points ahead of the ego, y to its left.
 *
 * CLOSECALL_CONTROLLER_ABI is the version of the interface. A structure may grow at its end; any other change changes it, and
 * Closecall refuses a library of a number that it does not know. */
#ifndef CLOSECALL_CONTROLLER_H
#define CLOSECALL_CONTROLLER_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Version of this interface. */
#define CLOSECALL_CONTROLLER_ABI 1u

#if defined(_WIN32)
#define CLOSECALL_EXPORT __declspec(dllexport)
#else
#define CLOSECALL_EXPORT __attribute__((visibility("default")))
#endif

/* The side on which others are overtaken. */
enum { CLOSECALL_SIDE_LEFT = 0, CLOSECALL_SIDE_RIGHT = 1 };

/* The sensors that a track comes from. */
enum { CLOSECALL_SOURCE_FRONT = 0, CLOSECALL_SOURCE_SURROUND = 1, CLOSECALL_SOURCE_REAR = 2 };

/* The status of a track. A coasting track is predicted, and has no measurement of this step. */
enum { CLOSECALL_TRACK_TENTATIVE = 0, CLOSECALL_TRACK_CONFIRMED = 1, CLOSECALL_TRACK_COASTING = 2 };

/* The states that a controller may answer. They make the summary of the margin increase system. */
enum {
    CLOSECALL_STATE_FOLLOWING = 0,         /* cruise control only */
    CLOSECALL_STATE_INCREASING = 1,        /* slows down to raise the time headway to the lead vehicle */
    CLOSECALL_STATE_HOLDING = 2,           /* uses up the margin instead of braking */
    CLOSECALL_STATE_RELEASING = 3,         /* returns the margin */
    CLOSECALL_STATE_EMERGENCY_BRAKING = 4
};

/* A number of the scenario's table `ego-stack`, such as "acc.time_gap_s", "aeb.trigger_mps2" or "mis.critical_gap_m". The name
 * ends with the unit. A truth value is 0 or 1. A value or table that the scenario leaves out has no setting. */
typedef struct {
    const char *name;
    double value;
} closecall_setting;

/* The data that a controller receives when it is created. */
typedef struct {
    double control_step_s;   /* time between two steps (s): 0.04 */
    double lane_width_m;     /* width of the ego's lane (m) */
    double curvature_per_m;  /* curvature of the road (1/m), positive to the left; NaN if it changes along the road */
    double speed_limit_mps;  /* (m/s) */
    uint32_t lanes;          /* number of lanes; lane 1 is the leftmost */
    int32_t overtaking_side; /* CLOSECALL_SIDE_... */
    const closecall_setting *settings;
    uint64_t setting_count;
    const char *settings_json; /* the same settings as JSON, with the texts among them; UTF-8 */
    const double *lane_widths_m; /* width of each lane, from lane 1 on (m): `lanes` numbers */
} closecall_setup;

/* The perceived state of another vehicle. */
typedef struct {
    uint32_t id;       /* number of the track, the same as long as it lives */
    int32_t source;    /* CLOSECALL_SOURCE_... */
    int32_t status;    /* CLOSECALL_TRACK_... */
    uint32_t reserved; /* 0 */
    double time_s;     /* time of the state (s) */
    double x_m;        /* centre of the vehicle ahead of the ego's centre (m) */
    double y_m;        /* centre of the vehicle to the left of the ego's centre (m) */
    double vx_mps;     /* speed over ground along x (m/s) */
    double vy_mps;     /* speed over ground along y (m/s) */
    double covariance[16]; /* of x, y, vx, vy; row by row; units m^2, m^2/s, m^2/s^2 */
    double heading_rad;    /* relative to the ego (rad) */
    double length_m;       /* (m) */
    double width_m;        /* (m) */
    double car;            /* probabilities of the class; their sum is 1 */
    double truck;
    double motorcycle;
    double background;
    double existence;      /* probability that there is a vehicle at all */
    double lane_left;      /* probabilities of the lane relative to the ego's lane */
    double lane_own;
    double lane_right;
} closecall_track;

/* The input of one control step: what a vehicle can know, never the truth. */
typedef struct {
    int64_t time_ns;          /* time of the step (ns) */
    double time_s;            /* the same (s) */
    double speed_mps;         /* odometry of the ego: speed (m/s) */
    double acceleration_mps2; /* longitudinal acceleration (m/s^2) */
    double yaw_rate_radps;    /* (rad/s) */
    double lane_offset_m;     /* from the centre of the lane (m), positive to the left */
    double length_m;          /* length of the ego (m) */
    double width_m;           /* width of the ego (m) */
    double front_gap_m;       /* lead vehicle: gap from bumper to bumper (m); 0 without a lead vehicle */
    double front_speed_mps;   /* (m/s) */
    double front_acceleration_mps2; /* smoothed (m/s^2) */
    uint32_t lane;            /* lane of the ego; 1 is the leftmost */
    uint32_t has_front;       /* 1 if there is a lead vehicle, selected as in the built-in controllers; otherwise 0 */
    uint32_t front_track;     /* its track */
    uint32_t front_works;     /* 1 if the front radar works, otherwise 0 */
    uint32_t surround_works;  /* the short-range sensors on both sides */
    uint32_t rear_works;      /* the rear sensors */
    uint64_t track_count;
    const closecall_track *tracks; /* all tracks, including tentative ones */
} closecall_input;

/* The answer to one control step. Closecall sets the acceleration to NaN before the call. */
typedef struct {
    double acceleration_mps2; /* commanded acceleration (m/s^2), until the next step; -100 to 100 */
    int32_t state;            /* CLOSECALL_STATE_... */
    uint32_t reserved;        /* 0 */
} closecall_command;

/* Returns CLOSECALL_CONTROLLER_ABI. */
CLOSECALL_EXPORT uint32_t closecall_controller_abi(void);

/* Creates a controller. Returns NULL if that fails. */
CLOSECALL_EXPORT void *closecall_controller_create(const closecall_setup *setup);

/* Answers a control step. Returns 0, or another number if it fails: the sample then ends in an error. */
CLOSECALL_EXPORT int32_t closecall_controller_step(void *controller, const closecall_input *input,
                                                   closecall_command *command);

/* Frees a controller. */
CLOSECALL_EXPORT void closecall_controller_destroy(void *controller);

/* Optional: returns why the last call for this controller failed, or NULL. The controller is NULL if it could not be created. */
CLOSECALL_EXPORT const char *closecall_controller_error(void *controller);

/* Optional: the name and the version of the controller. A campaign keeps them, and is not resumed with others. */
CLOSECALL_EXPORT const char *closecall_controller_name(void);
CLOSECALL_EXPORT const char *closecall_controller_version(void);

#if UINTPTR_MAX == UINT64_MAX && defined(__STDC_VERSION__) && __STDC_VERSION__ >= 201112L
_Static_assert(sizeof(closecall_setup) == 72, "layout of closecall_setup");
_Static_assert(sizeof(closecall_track) == 272, "layout of closecall_track");
_Static_assert(sizeof(closecall_input) == 128, "layout of closecall_input");
_Static_assert(sizeof(closecall_command) == 16, "layout of closecall_command");
#endif

#ifdef __cplusplus
}
#endif
#endif
