/* The interface between Closecall and a perception that is a shared library: sensors.perception = "lib:PATH" in a scenario file
 *
 * Build:  cc -std=c11 -O2 -ffp-contract=off -shared -fPIC -o my_perception.so my_perception.c
 *
 * The library exports five functions:
 *
 *   closecall_perception_abi      returns CLOSECALL_PERCEPTION_ABI
 *   closecall_perception_answers  returns what it answers: detections or tracks
 *   closecall_perception_create   creates a perception; called once for each run, with the first scans
 *   closecall_perception_step     answers one control step with scans
 *   closecall_perception_destroy  frees the perception at the end of the run
 *
 * and may export three more: closecall_perception_error, closecall_perception_name, closecall_perception_version.
 *
 * All functions are called by one thread at a time. Each run has a process of its own, with one perception. All pointers that
 * Closecall passes are valid during the call only.
 *
 * An exception of C++ must not leave a function: it would abort the process, which costs the sample (SIGABRT). A function catches it,
 * answers NULL or another number than 0, and gives its text to closecall_perception_error.
 *
 * Times are in s or ns, lengths in m, speeds in m/s, angles in rad. The frame of the ego has its origin in the middle of the ego on
 * the ground: x points ahead, y to its left, z up. docs/reference/perception.md explains every value.
 *
 * CLOSECALL_PERCEPTION_ABI is the version of the interface. A structure may grow at its end; any other change changes it, and
 * Closecall refuses a library of a number that it does not know. */
#ifndef CLOSECALL_PERCEPTION_H
#define CLOSECALL_PERCEPTION_H

/* CLOSECALL_EXPORT, CLOSECALL_SIDE_... and CLOSECALL_TRACK_... */
#include "closecall_controller.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Version of this interface. */
#define CLOSECALL_PERCEPTION_ABI 1u

/* What a perception answers. */
enum { CLOSECALL_ANSWERS_DETECTIONS = 0, CLOSECALL_ANSWERS_TRACKS = 1 };

/* The side of the mirror that deflected a scan. */
enum { CLOSECALL_MIRROR_NONE = 0, CLOSECALL_MIRROR_PLUS = 1, CLOSECALL_MIRROR_MINUS = -1 };

/* A LiDAR that looks back. */
typedef struct {
    const char *name;
    double x_m;            /* mounting, in the frame of the ego (m) */
    double y_m;
    double z_m;
    double azimuth_rad;    /* of the axis (rad): 0 is straight behind, positive to the left of the ego */
    double half_field_rad; /* half of the horizontal field of view (rad) */
    double range_m;        /* beyond it the sensor reports nothing of use (m) */
    double period_s;       /* time from a scan to the next (s) */
    uint32_t layers;       /* beam = column * layers + layer */
    uint32_t columns;
} closecall_lidar;

/* A rear radar. */
typedef struct {
    int32_t side;          /* CLOSECALL_SIDE_... */
    uint32_t reserved;     /* 0 */
    double x_m;            /* mounting, in the frame of the ego (m) */
    double y_m;
    double azimuth_rad;    /* of the axis (rad): 0 is straight behind, positive to the left of the ego */
    double half_field_rad; /* (rad) */
    double range_m;        /* (m) */
    double period_s;       /* (s) */
    double range_sd_m;     /* standard deviations of a detection (m, rad, m/s) */
    double azimuth_sd_rad;
    double radial_sd_mps;
} closecall_radar;

/* A rear camera, as its images have it. */
typedef struct {
    double x_m;          /* lens, in the frame of the ego (m); y_m is below */
    double z_m;
    double pitch_rad;    /* positive if it looks down (rad) */
    double yaw_rad;      /* from straight behind, positive if it looks to the left of the ego (rad) */
    double focal_px;     /* (px) */
    double distortion_k1;
    double distortion_k2;
    double period_s;     /* time from an image to the next (s) */
    uint32_t width;      /* (px) */
    uint32_t height;
    double y_m;          /* lens, to the left of the centre line (m) */
    const char *name;
} closecall_camera;

/* The data that a perception receives when it is created. */
typedef struct {
    double control_step_s;   /* time between two control steps (s): 0.04 */
    double latency_s;        /* time from a scan to the tracks that the controller gets (s) */
    double ego_length_m;     /* (m) */
    double ego_width_m;      /* (m) */
    double lane_width_m;     /* width of the ego's lane (m) */
    double curvature_per_m;  /* curvature of the road (1/m), positive to the left; NaN if it changes along the road */
    double speed_limit_mps;  /* (m/s) */
    uint32_t lanes;          /* number of lanes; lane 1 is the leftmost */
    int32_t overtaking_side; /* CLOSECALL_SIDE_... */
    const closecall_lidar *lidars;
    uint64_t lidar_count;
    const closecall_radar *radars; /* the left and the right rear radar, or none */
    uint64_t radar_count;
    const closecall_camera *camera; /* the first one; NULL without images */
    const closecall_camera *additional_cameras; /* further rear cameras; none without images */
    uint64_t additional_camera_count;
    const double *lane_widths_m; /* width of each lane, from lane 1 on (m): `lanes` numbers */
} closecall_perception_setup;

/* A complete scan of a LiDAR, with one element of each array for each point. */
typedef struct {
    uint32_t lidar;      /* index in the lidars of the setup */
    int32_t mirror_side; /* CLOSECALL_MIRROR_... */
    int64_t start_ns;    /* sweep (ns) */
    int64_t end_ns;
    uint64_t point_count;
    const float *x_m; /* in the frame of the ego at the end of the scan (m) */
    const float *y_m;
    const float *z_m;
    const float *intensity;    /* received power times the square of the range, with the losses of the window */
    const uint16_t *beam;      /* column * layers + layer */
    const uint32_t *offset_ns; /* time of the measurement after start_ns (ns) */
} closecall_scan;

/* A detection of a radar. */
typedef struct {
    double range_m;     /* from the radar (m) */
    double azimuth_rad; /* 0 is straight behind, positive to the left of the ego (rad) */
    double radial_mps;  /* rate of change of the range (m/s) */
} closecall_radar_detection;

/* A scan of a rear radar. */
typedef struct {
    int32_t side;      /* CLOSECALL_SIDE_... */
    uint32_t reserved; /* 0 */
    int64_t time_ns;   /* (ns) */
    uint64_t detection_count;
    const closecall_radar_detection *detections;
} closecall_radar_scan;

/* An image of a rear camera. */
typedef struct {
    int64_t time_ns; /* (ns) */
    uint32_t width;  /* (px) */
    uint32_t height;
    const uint8_t *rgb; /* red, green and blue of each pixel, row by row from the top left */
    uint32_t additional_camera; /* index in the additional cameras of the setup; 0 in the image of the first camera, too */
    uint32_t reserved;          /* 0 */
} closecall_image;

/* The question of one control step: what the sensors have measured, never the truth. */
typedef struct {
    int64_t time_ns;          /* time of the control step, the end of the scans (ns); the first 25 questions have negative times */
    double time_s;            /* the same (s) */
    double speed_mps;         /* odometry of the ego: speed (m/s) */
    double acceleration_mps2; /* longitudinal acceleration (m/s^2) */
    double yaw_rate_radps;    /* (rad/s) */
    double lane_offset_m;     /* from the centre of the lane (m), positive to the left */
    double pose_x_m;          /* place of the ego in the frame of its first pose (m, m, rad) */
    double pose_y_m;
    double pose_yaw_rad;
    uint32_t lane;     /* lane of the ego; 1 is the leftmost */
    uint32_t reserved; /* 0 */
    const closecall_scan *scans; /* the scans that have arrived; a lost or dead one is missing */
    uint64_t scan_count;
    const closecall_radar_scan *radar_scans; /* those that have arrived since the last question */
    uint64_t radar_scan_count;
    const closecall_image *image; /* of the first camera; NULL if none is due */
    const closecall_image *additional_images; /* of further cameras, as far as they are due */
    uint64_t additional_image_count;
} closecall_perception_input;

/* A box for the built-in tracker. Closecall sets what has no default to NaN before the call. */
typedef struct {
    double x_m;           /* middle of the face that is nearest to the ego (m) */
    double y_m;
    double covariance[4]; /* of the two, row by row (m^2) */
    double heading_rad;   /* relative to the ego (rad); 0 by default */
    double length_m;      /* (m) */
    double width_m;       /* (m) */
    double top_m;         /* height of the highest point (m); 1.5 by default */
    double car;           /* probabilities of the class, whose sum is 1; all are 0 by default: nothing is known */
    double truck;
    double motorcycle;
    double background;
    int64_t time_ns;         /* time at which the position holds (ns), at most 0.2 s before the question; by default the time of the question */
    uint32_t points;         /* number of points, at least 1; 0 by default, which is refused */
    uint32_t length_is_seen; /* 1 if the length is measured, 0 (default) if it is assumed */
    uint32_t width_is_seen;  /* the same for the width */
    uint32_t reserved;       /* 0 */
} closecall_detection;

/* A track at the time of the question. Closecall sets what has no default to NaN before the call, and the status to -1. */
typedef struct {
    uint32_t id;    /* the same for the whole life of a track, unlike the number of any other track */
    int32_t status; /* CLOSECALL_TRACK_... */
    double x_m;     /* centre of the box (m) */
    double y_m;
    double vx_mps; /* velocity over ground along the axes of the ego (m/s) */
    double vy_mps;
    double covariance[16]; /* of x, y, vx, vy; row by row; units m^2, m^2/s, m^2/s^2 */
    double heading_rad;    /* relative to the ego (rad); 0 by default */
    double length_m;       /* (m) */
    double width_m;        /* (m) */
    double car;            /* probabilities of the class, whose sum is 1; all are 0 by default: nothing is known */
    double truck;
    double motorcycle;
    double background;
    double existence; /* probability that there is an object */
} closecall_perceived_track;

/* The answer to one control step. The library fills the list that closecall_perception_answers announces, and sets the count. */
typedef struct {
    closecall_detection *detections;   /* room for `capacity` detections; NULL if tracks are announced */
    closecall_perceived_track *tracks; /* room for `capacity` tracks; NULL if detections are announced */
    uint64_t capacity;                 /* 256 */
    uint64_t count;                    /* number of elements; 0 before the call */
} closecall_perception_answer;

/* Returns CLOSECALL_PERCEPTION_ABI. */
CLOSECALL_EXPORT uint32_t closecall_perception_abi(void);

/* Returns CLOSECALL_ANSWERS_DETECTIONS or CLOSECALL_ANSWERS_TRACKS, always the same. */
CLOSECALL_EXPORT int32_t closecall_perception_answers(void);

/* Creates a perception. Returns NULL if that fails. */
CLOSECALL_EXPORT void *closecall_perception_create(const closecall_perception_setup *setup);

/* Answers a control step. Returns 0, or another number if it fails: the sample then ends in an error. */
CLOSECALL_EXPORT int32_t closecall_perception_step(void *perception, const closecall_perception_input *input,
                                                   closecall_perception_answer *answer);

/* Frees a perception. */
CLOSECALL_EXPORT void closecall_perception_destroy(void *perception);

/* Optional: returns why the last call for this perception failed, or NULL. The perception is NULL if it could not be created. */
CLOSECALL_EXPORT const char *closecall_perception_error(void *perception);

/* Optional: the name and the version of the perception. A campaign keeps them, and is not resumed with others. */
CLOSECALL_EXPORT const char *closecall_perception_name(void);
CLOSECALL_EXPORT const char *closecall_perception_version(void);

#if UINTPTR_MAX == UINT64_MAX && defined(__STDC_VERSION__) && __STDC_VERSION__ >= 201112L
_Static_assert(sizeof(closecall_lidar) == 72, "layout of closecall_lidar");
_Static_assert(sizeof(closecall_radar) == 80, "layout of closecall_radar");
_Static_assert(sizeof(closecall_camera) == 88, "layout of closecall_camera");
_Static_assert(sizeof(closecall_perception_setup) == 128, "layout of closecall_perception_setup");
_Static_assert(sizeof(closecall_scan) == 80, "layout of closecall_scan");
_Static_assert(sizeof(closecall_radar_detection) == 24, "layout of closecall_radar_detection");
_Static_assert(sizeof(closecall_radar_scan) == 32, "layout of closecall_radar_scan");
_Static_assert(sizeof(closecall_image) == 32, "layout of closecall_image");
_Static_assert(sizeof(closecall_perception_input) == 136, "layout of closecall_perception_input");
_Static_assert(sizeof(closecall_detection) == 136, "layout of closecall_detection");
_Static_assert(sizeof(closecall_perceived_track) == 232, "layout of closecall_perceived_track");
_Static_assert(sizeof(closecall_perception_answer) == 32, "layout of closecall_perception_answer");
#endif

#ifdef __cplusplus
}
#endif
#endif
