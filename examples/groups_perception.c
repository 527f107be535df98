/* A perception as a shared library: it groups the points of a scan by gaps along the road, and follows the nearest vehicle.
 *
 *   cc -std=c11 -O2 -ffp-contract=off -shared -fPIC -I controllers/include -o groups.so examples/groups_perception.c -lm
 *   closecall run low-thw-overtake --sensors full --set 'sensors.perception="lib:./groups.so"'
 *
 * Its speed is the mean over half a second. It takes the road for straight, and every vehicle for a car. */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "closecall_perception.h"

#define LOWEST_M 0.35   /* above returns of the road */
#define HIGHEST_M 1.6   /* below roofs, which lie behind the face of a car */
#define MARGIN_M 0.3    /* from the edges of the road, beyond which there are rails */
#define GAP_M 4.0       /* along the road, between two vehicles */
#define FACE_M 0.8      /* depth of the face of a vehicle */
#define LEAST_POINTS 3
#define JUMP_M 10.0     /* beyond it the nearest vehicle is another one */
#define MEMORY_S 0.5    /* time over which a speed is the mean, and the least such time */
#define LEAST_S 0.2
#define LENGTH_M 4.6
#define WIDTH_M 1.85
#define PLACES 64

/* A point behind the ego: its distance, its position to the left, and its age at the end of the scan. */
typedef struct {
    double back_m, y_m, age_s;
} point;

/* The face of a vehicle, and the mean age of its points. */
typedef struct {
    double x_m, y_m, age_s;
    uint32_t points;
} face;

/* A place of the followed vehicle along the road, in the frame of the first pose. */
typedef struct {
    double time_s, x_m;
} place;

typedef struct {
    double lane_widths_m[8];
    uint32_t lanes, id;
    place places[PLACES]; /* the latest is the last */
    int count;
} follower;

static int compare(const void *first, const void *second) {
    const point *a = first, *b = second;
    if (a->back_m != b->back_m) return a->back_m < b->back_m ? -1 : 1;
    if (a->y_m != b->y_m) return a->y_m < b->y_m ? -1 : 1;
    return a->age_s < b->age_s ? -1 : a->age_s > b->age_s;
}

/* Returns the face of a group of points, which are sorted by their distance. */
static face face_of(const point *points, size_t count) {
    double least_m = INFINITY, most_m = -INFINITY, age_s = 0.0;
    uint32_t near = 0;
    for (; near < count && points[near].back_m < points[0].back_m + FACE_M; near++) {
        least_m = fmin(least_m, points[near].y_m);
        most_m = fmax(most_m, points[near].y_m);
        age_s += points[near].age_s;
    }
    return (face){-points[0].back_m, 0.5 * (least_m + most_m), age_s / near, (uint32_t)count};
}

/* Lists the faces of a scan, at most `most`, the nearest first. Returns their number, or -1 without memory. */
static int faces(const follower *own, const closecall_perception_input *in, const closecall_scan *scan, face *list, int most) {
    double left_m = -0.5 * own->lane_widths_m[in->lane - 1] - in->lane_offset_m, right_m;
    for (uint32_t lane = 0; lane < in->lane; lane++) left_m += own->lane_widths_m[lane];
    right_m = left_m;
    for (uint32_t lane = 0; lane < own->lanes; lane++) right_m -= own->lane_widths_m[lane];
    double sweep_ns = (double)(scan->end_ns - scan->start_ns);
    point *points = malloc((scan->point_count + 1) * sizeof *points);
    if (!points) return -1;
    size_t kept = 0;
    for (uint64_t i = 0; i < scan->point_count; i++) {
        double y_m = scan->y_m[i], z_m = scan->z_m[i];
        if (z_m > LOWEST_M && z_m < HIGHEST_M && y_m > right_m + MARGIN_M && y_m < left_m - MARGIN_M)
            points[kept++] = (point){-scan->x_m[i], y_m, 1e-9 * (sweep_ns - scan->offset_ns[i])};
    }
    qsort(points, kept, sizeof *points, compare);
    int found = 0;
    for (size_t first = 0, next = 1; first < kept && found < most; next++) {
        if (next < kept && points[next].back_m - points[next - 1].back_m <= GAP_M) continue;
        if (next - first >= LEAST_POINTS) list[found++] = face_of(points + first, next - first);
        first = next;
    }
    free(points);
    return found;
}

/* Adds a place of the nearest vehicle, and returns its speed over ground, or NaN as long as it is unknown. */
static double speed(follower *own, place now) {
    if (own->count && fabs(now.x_m - own->places[own->count - 1].x_m) > JUMP_M) own->count = 0, own->id++;
    int old = own->count == PLACES;
    while (old < own->count && now.time_s - own->places[old].time_s >= MEMORY_S) old++;
    own->count -= old;
    memmove(own->places, own->places + old, (size_t)own->count * sizeof *own->places);
    own->places[own->count++] = now;
    double elapsed_s = now.time_s - own->places[0].time_s;
    return elapsed_s > LEAST_S ? (now.x_m - own->places[0].x_m) / elapsed_s : NAN;
}

uint32_t closecall_perception_abi(void) { return CLOSECALL_PERCEPTION_ABI; }
int32_t closecall_perception_answers(void) { return CLOSECALL_ANSWERS_TRACKS; }
const char *closecall_perception_name(void) { return "groups in C"; }
const char *closecall_perception_version(void) { return "1"; }

void *closecall_perception_create(const closecall_perception_setup *setup) {
    follower *own = calloc(1, sizeof *own);
    if (!own) return NULL;
    own->lanes = setup->lanes < 8 ? setup->lanes : 8;
    memcpy(own->lane_widths_m, setup->lane_widths_m, own->lanes * sizeof(double));
    return own;
}

int32_t closecall_perception_step(void *perception, const closecall_perception_input *in, closecall_perception_answer *answer) {
    follower *own = perception;
    for (uint64_t i = 0; i < in->scan_count; i++) {
        face nearest;
        int found = faces(own, in, &in->scans[i], &nearest, 1);
        if (found < 0) return 1;
        if (found == 0) continue;
        double vx_mps = speed(own, (place){in->time_s - nearest.age_s, in->pose_x_m + nearest.x_m});
        if (isnan(vx_mps)) return 0;
        closecall_perceived_track *track = &answer->tracks[answer->count++];
        track->id = own->id;
        track->status = CLOSECALL_TRACK_CONFIRMED;
        track->x_m = nearest.x_m + nearest.age_s * vx_mps - 0.5 * LENGTH_M;
        track->y_m = nearest.y_m;
        track->vx_mps = vx_mps;
        track->vy_mps = 0.0;
        for (int k = 0; k < 16; k++) track->covariance[k] = k % 5 ? 0.0 : k < 10 ? 0.04 : 0.25;
        track->length_m = LENGTH_M;
        track->width_m = WIDTH_M;
        track->car = 0.9;
        track->background = 0.1;
        track->existence = 0.95;
        return 0;
    }
    return 0;
}

void closecall_perception_destroy(void *perception) { free(perception); }
