/* Trocar for programs in C, and for languages that call C: load a scene, step it, drive it, read it. Units are SI.
 *
 *     trocar_scene* scene = NULL;
 *     trocar_simulator* simulator = NULL;
 *     if (trocar_load_scene("scene.json", &scene) != TROCAR_OK) puts(trocar_last_error());
 *     trocar_create(scene, "exact", &simulator);
 *     trocar_step(simulator);
 *     trocar_destroy(simulator);
 *     trocar_free_scene(scene);
 *
 * Every call that can fail returns a status; what it was given is then as it was, and trocar_last_error() says in a sentence what was found and what
 * was expected. No call throws, and none ends the program. Null pointers are refused, but for those that are freed.
 *
 * Threads: a scene is never changed, and any number of threads may make simulators of it and free their own hold on it. A simulator belongs to one
 * thread at a time; two simulators are independent. trocar_last_error() is the calling thread's own.
 */
#ifndef TROCAR_C_API_H
#define TROCAR_C_API_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined(__GNUC__)
#define TROCAR_API __attribute__((visibility("default")))
#else
#define TROCAR_API
#endif

typedef struct trocar_scene trocar_scene;         /* prepared, never changed */
typedef struct trocar_simulator trocar_simulator; /* a state of one, and how it goes on */

typedef enum trocar_status {
    TROCAR_OK = 0,
    TROCAR_BAD_ARGUMENT = 1, /* a null pointer, no such index or name, a value that is not finite, a budget that is none */
    TROCAR_BAD_SCENE = 2,    /* the file is missing, or is no scene */
    TROCAR_STOPPED = 3,      /* a step came to values that are not finite: the state is the last good one, and no more steps are taken */
    TROCAR_NO_MEMORY = 4
} trocar_status;

/* What positions are asked of. */
typedef enum trocar_points {
    TROCAR_ROD = 0,     /* of an instrument: its nodes, from the handle's end to the tip */
    TROCAR_SKIN = 1,    /* of an instrument: its skin's vertices */
    TROCAR_SURFACE = 2, /* of a body: its surface's vertices */
    TROCAR_NODES = 3    /* of a body: its tissue's nodes; none where it does not deform */
} trocar_points;

/* Of the last step. */
typedef struct trocar_report {
    uint64_t step;                 /* how many were taken */
    double time_s;                 /* simulated */
    double total_ms, charged_ms;   /* wall time of the whole step, and of what the budget covers */
    int32_t budget_kept;           /* 0: the charged part took longer than its budget */
    int32_t exact;                 /* continuous tests answered, of all instruments */
    uint64_t lumen_exits;          /* vertices of instruments outside their vessel */
    uint64_t unresolved;           /* exact contacts that no correction parted */
    uint64_t assumed;              /* pairs of spheres that the budget left untested, taken for contacts */
    double contact_force_n;        /* sum of the normal forces on instruments */
    double max_contact_force_n;    /* the largest of them */
} trocar_report;

/* "1.0.0" */
TROCAR_API const char* trocar_version(void);
/* Of this thread's last call that failed; empty before the first. It holds until the next call that fails. */
TROCAR_API const char* trocar_last_error(void);

/* Reads and prepares a scene: seconds, minutes for a large anatomy that no cache has. */
TROCAR_API trocar_status trocar_load_scene(const char* file, trocar_scene** scene);
/* Simulators of it go on. Null: nothing. */
TROCAR_API void trocar_free_scene(trocar_scene* scene);
/* s, of a step; 0 for a null pointer. */
TROCAR_API double trocar_step_length(const trocar_scene* scene);

/* budget   of each step: "exact", "work:20000", "0.5ms", "250us"; null: the scene's */
TROCAR_API trocar_status trocar_create(const trocar_scene* scene, const char* budget, trocar_simulator** simulator);
/* Another one in the same state: both go on to the same bits. Drive commands that hold are taken over. */
TROCAR_API trocar_status trocar_fork(trocar_simulator* simulator, trocar_simulator** fork);
/* Null: nothing. */
TROCAR_API void trocar_destroy(trocar_simulator* simulator);

TROCAR_API size_t trocar_count_instruments(const trocar_simulator* simulator);
TROCAR_API size_t trocar_count_bodies(const trocar_simulator* simulator);
TROCAR_API trocar_status trocar_find_instrument(const trocar_simulator* simulator, const char* name, size_t* index);
TROCAR_API trocar_status trocar_find_body(const trocar_simulator* simulator, const char* name, size_t* index);

/* Where the instrument shall be, from the next step on until another command or trocar_release: it moves there as fast as its limits allow.
 * insertion   m of rod beyond its port
 * rotation    rad of the handle about the rod's axis */
TROCAR_API trocar_status trocar_set_drive(trocar_simulator* simulator, size_t instrument, double insertion, double rotation);
/* Back to what the scene's script does with it. */
TROCAR_API trocar_status trocar_release(trocar_simulator* simulator, size_t instrument);

/* One step of the scene's length. */
TROCAR_API trocar_status trocar_step(trocar_simulator* simulator);
TROCAR_API trocar_status trocar_get_report(const trocar_simulator* simulator, trocar_report* report);
/* 64-bit hash of where everything is: equal hashes are equal bits. */
TROCAR_API trocar_status trocar_get_hash(trocar_simulator* simulator, uint64_t* hash);

/* Of the drive on the first instrument, in the last step. Either may be null.
 * force_n     along the port's axis; positive: the drive pushes
 * torque_nm   about it; without the effect twist that of a shaped tip alone */
TROCAR_API trocar_status trocar_get_handle(const trocar_simulator* simulator, double* force_n, double* torque_nm);
/* Sum of the contact forces on an instrument, N. */
TROCAR_API trocar_status trocar_get_force(const trocar_simulator* simulator, size_t instrument, double force[3]);
/* m */
TROCAR_API trocar_status trocar_get_tip(const trocar_simulator* simulator, size_t instrument, double position[3]);
/* m beyond the port, rad; either may be null */
TROCAR_API trocar_status trocar_get_drive(const trocar_simulator* simulator, size_t instrument, double* insertion, double* rotation);

/* index   of the instrument or body that `points` belong to */
TROCAR_API trocar_status trocar_count_positions(trocar_simulator* simulator, trocar_points points, size_t index, size_t* count);
/* x, y, z of each, m, as the last step left them.
 * capacity   points that there is room for in `positions`; fewer than there are: nothing is copied */
TROCAR_API trocar_status trocar_copy_positions(trocar_simulator* simulator, trocar_points points, size_t index, double* positions,
                                               size_t capacity);
TROCAR_API trocar_status trocar_count_triangles(trocar_simulator* simulator, trocar_points points, size_t index, size_t* count);
/* Three vertices each, of TROCAR_SKIN or TROCAR_SURFACE. */
TROCAR_API trocar_status trocar_copy_triangles(trocar_simulator* simulator, trocar_points points, size_t index, uint32_t* vertices,
                                               size_t capacity);

#ifdef __cplusplus
}
#endif

#endif
