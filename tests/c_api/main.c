/* The C interface as a program in C sees it: what each call gives, what it refuses and how, forks, threads. */
#define _POSIX_C_SOURCE 200809L
#include "c_api.h"

#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int failures = 0;

#define CHECK(condition)                                                      \
    do {                                                                      \
        if (!(condition)) {                                                   \
            ++failures;                                                       \
            printf("%s:%d: %s\n  last error: %s\n", __FILE__, __LINE__, #condition, trocar_last_error()); \
        }                                                                     \
    } while (0)
#define REFUSED(call, status, piece)                                          \
    do {                                                                      \
        CHECK((call) == (status));                                            \
        CHECK(strstr(trocar_last_error(), (piece)) != NULL);                  \
    } while (0)

static uint64_t hash_of(trocar_simulator* simulator) {
    uint64_t hash = 0;
    CHECK(trocar_get_hash(simulator, &hash) == TROCAR_OK);
    return hash;
}

static void what_is_no_scene_is_refused(void) {
    trocar_scene* scene = NULL;
    REFUSED(trocar_load_scene("no/such/scene.json", &scene), TROCAR_BAD_SCENE, "no/such/scene.json");
    REFUSED(trocar_load_scene(NULL, &scene), TROCAR_BAD_ARGUMENT, "file");
    REFUSED(trocar_load_scene("scene.json", NULL), TROCAR_BAD_ARGUMENT, "scene");
    CHECK(scene == NULL);
    CHECK(trocar_step_length(NULL) == 0.0);
    trocar_free_scene(NULL);
    trocar_destroy(NULL);
}

static void what_is_asked_wrongly_is_refused(const trocar_scene* scene) {
    trocar_simulator* simulator = NULL;
    double three[3], one;
    size_t index = 7, count;
    REFUSED(trocar_create(NULL, NULL, &simulator), TROCAR_BAD_ARGUMENT, "scene");
    REFUSED(trocar_create(scene, NULL, NULL), TROCAR_BAD_ARGUMENT, "simulator");
    REFUSED(trocar_create(scene, "tomorrow", &simulator), TROCAR_BAD_ARGUMENT, "budget");
    CHECK(simulator == NULL);
    CHECK(trocar_create(scene, "work:1000", &simulator) == TROCAR_OK);
    const uint64_t before = hash_of(simulator);
    REFUSED(trocar_set_drive(simulator, 1, 0.1, 0.0), TROCAR_BAD_ARGUMENT, "instrument 1 of 1");
    REFUSED(trocar_set_drive(simulator, 0, NAN, 0.0), TROCAR_BAD_ARGUMENT, "finite");
    REFUSED(trocar_set_drive(NULL, 0, 0.1, 0.0), TROCAR_BAD_ARGUMENT, "simulator");
    REFUSED(trocar_release(simulator, 9), TROCAR_BAD_ARGUMENT, "instrument 9");
    REFUSED(trocar_find_instrument(simulator, "nobody", &index), TROCAR_BAD_ARGUMENT, "nobody");
    REFUSED(trocar_find_body(simulator, "nothing", &index), TROCAR_BAD_ARGUMENT, "nothing");
    CHECK(index == 7);
    REFUSED(trocar_find_body(simulator, NULL, &index), TROCAR_BAD_ARGUMENT, "null");
    REFUSED(trocar_step(NULL), TROCAR_BAD_ARGUMENT, "simulator");
    REFUSED(trocar_get_tip(simulator, 0, NULL), TROCAR_BAD_ARGUMENT, "position");
    REFUSED(trocar_get_force(simulator, 3, three), TROCAR_BAD_ARGUMENT, "instrument 3");
    REFUSED(trocar_get_report(simulator, NULL), TROCAR_BAD_ARGUMENT, "report");
    REFUSED(trocar_get_hash(simulator, NULL), TROCAR_BAD_ARGUMENT, "hash");
    REFUSED(trocar_count_positions(simulator, (trocar_points)12, 0, &count), TROCAR_BAD_ARGUMENT, "trocar_points");
    REFUSED(trocar_count_positions(simulator, TROCAR_SURFACE, 99, &count), TROCAR_BAD_ARGUMENT, "body 99");
    REFUSED(trocar_copy_positions(simulator, TROCAR_ROD, 0, &one, 0), TROCAR_BAD_ARGUMENT, "positions: room for 0");
    REFUSED(trocar_copy_positions(simulator, TROCAR_ROD, 0, NULL, 1u << 20), TROCAR_BAD_ARGUMENT, "positions");
    REFUSED(trocar_fork(simulator, NULL), TROCAR_BAD_ARGUMENT, "fork");
    CHECK(hash_of(simulator) == before);
    trocar_destroy(simulator);
}

static void a_drive_is_followed_and_read(const trocar_scene* scene) {
    trocar_simulator* simulator = NULL;
    CHECK(trocar_create(scene, NULL, &simulator) == TROCAR_OK);
    CHECK(trocar_count_instruments(simulator) == 1);
    CHECK(trocar_count_bodies(simulator) >= 1);
    double before[3], after[3], force[3], insertion = 0.0, rotation = 0.0, wanted, axial, torque;
    trocar_report report;
    CHECK(trocar_get_tip(simulator, 0, before) == TROCAR_OK);
    CHECK(trocar_get_drive(simulator, 0, &wanted, NULL) == TROCAR_OK);
    wanted += 0.004;
    CHECK(trocar_set_drive(simulator, 0, wanted, 0.3) == TROCAR_OK);
    for (int k = 0; k < 60; ++k) CHECK(trocar_step(simulator) == TROCAR_OK);
    CHECK(trocar_get_drive(simulator, 0, &insertion, &rotation) == TROCAR_OK);
    CHECK(fabs(insertion - wanted) < 1e-9 && fabs(rotation - 0.3) < 1e-9);
    CHECK(trocar_get_tip(simulator, 0, after) == TROCAR_OK);
    const double way = sqrt(pow(after[0] - before[0], 2) + pow(after[1] - before[1], 2) + pow(after[2] - before[2], 2));
    CHECK(way > 0.003 && way < 0.006);
    CHECK(trocar_get_report(simulator, &report) == TROCAR_OK);
    CHECK(report.step == 60 && fabs(report.time_s - 60 * trocar_step_length(scene)) < 1e-9 && report.lumen_exits == 0);
    CHECK(trocar_get_force(simulator, 0, force) == TROCAR_OK);
    CHECK(isfinite(force[0] + force[1] + force[2]));
    CHECK(sqrt(force[0] * force[0] + force[1] * force[1] + force[2] * force[2]) <= 2.0 * report.contact_force_n + 1e-12);
    CHECK(trocar_get_handle(simulator, &axial, &torque) == TROCAR_OK && isfinite(axial) && isfinite(torque));
    CHECK(trocar_get_handle(simulator, NULL, NULL) == TROCAR_OK);

    size_t nodes = 0, vertices = 0, triangles = 0;
    CHECK(trocar_count_positions(simulator, TROCAR_ROD, 0, &nodes) == TROCAR_OK && nodes > 10);
    double* rod = malloc(3 * nodes * sizeof *rod);
    CHECK(trocar_copy_positions(simulator, TROCAR_ROD, 0, rod, nodes) == TROCAR_OK);
    for (int axis = 0; axis < 3; ++axis) CHECK(rod[3 * (nodes - 1) + (size_t)axis] == after[axis]); /* the tip is the last one */
    free(rod);
    CHECK(trocar_count_positions(simulator, TROCAR_SURFACE, 0, &vertices) == TROCAR_OK);
    CHECK(trocar_count_triangles(simulator, TROCAR_SURFACE, 0, &triangles) == TROCAR_OK && triangles > 10);
    uint32_t* corners = malloc(3 * triangles * sizeof *corners);
    CHECK(trocar_copy_triangles(simulator, TROCAR_SURFACE, 0, corners, triangles) == TROCAR_OK);
    for (size_t k = 0; k < 3 * triangles; ++k) CHECK(corners[k] < vertices);
    free(corners);

    trocar_simulator* fork = NULL;
    CHECK(trocar_fork(simulator, &fork) == TROCAR_OK);
    CHECK(trocar_set_drive(simulator, 0, wanted - 0.002, 0.0) == TROCAR_OK && trocar_set_drive(fork, 0, wanted - 0.002, 0.0) == TROCAR_OK);
    for (int k = 0; k < 10; ++k) CHECK(trocar_step(simulator) == TROCAR_OK && trocar_step(fork) == TROCAR_OK);
    CHECK(hash_of(simulator) == hash_of(fork));
    CHECK(trocar_release(fork, 0) == TROCAR_OK);
    for (int k = 0; k < 30; ++k) CHECK(trocar_step(simulator) == TROCAR_OK && trocar_step(fork) == TROCAR_OK);
    CHECK(hash_of(simulator) != hash_of(fork)); /* the script drives it again */
    trocar_destroy(fork);
    trocar_destroy(simulator);
}

static void* run_alone(void* given) {
    trocar_simulator* simulator = NULL;
    uint64_t* hash = malloc(sizeof *hash);
    CHECK(trocar_create(given, "work:5000", &simulator) == TROCAR_OK);
    CHECK(trocar_load_scene("of this thread alone", &(trocar_scene*){NULL}) == TROCAR_BAD_SCENE);
    for (int k = 0; k < 40; ++k) CHECK(trocar_step(simulator) == TROCAR_OK);
    CHECK(strstr(trocar_last_error(), "of this thread alone") != NULL);
    *hash = hash_of(simulator);
    trocar_destroy(simulator);
    return hash;
}

static void threads_share_a_scene(trocar_scene* scene) {
    pthread_t threads[3];
    void* hashes[3];
    for (int k = 0; k < 3; ++k) CHECK(pthread_create(&threads[k], NULL, run_alone, scene) == 0);
    for (int k = 0; k < 3; ++k) CHECK(pthread_join(threads[k], &hashes[k]) == 0);
    CHECK(*(uint64_t*)hashes[0] == *(uint64_t*)hashes[1] && *(uint64_t*)hashes[0] == *(uint64_t*)hashes[2]);
    for (int k = 0; k < 3; ++k) free(hashes[k]);
}

static void a_simulator_outlives_the_hold_on_its_scene(const char* file) {
    trocar_scene* scene = NULL;
    trocar_simulator* simulator = NULL;
    CHECK(trocar_load_scene(file, &scene) == TROCAR_OK);
    CHECK(trocar_create(scene, NULL, &simulator) == TROCAR_OK);
    trocar_free_scene(scene);
    CHECK(trocar_step(simulator) == TROCAR_OK);
    trocar_destroy(simulator);
}

int main(int argc, char** argv) {
    trocar_scene* scene = NULL;
    if (argc != 2) return 2;
    CHECK(strlen(trocar_version()) > 0);
    CHECK(strlen(trocar_last_error()) == 0);
    what_is_no_scene_is_refused();
    CHECK(trocar_load_scene(argv[1], &scene) == TROCAR_OK);
    if (scene == NULL) return 1;
    CHECK(trocar_step_length(scene) > 0.0);
    what_is_asked_wrongly_is_refused(scene);
    a_drive_is_followed_and_read(scene);
    threads_share_a_scene(scene);
    trocar_free_scene(scene);
    a_simulator_outlives_the_hold_on_its_scene(argv[1]);
    printf("%d checks failed\n", failures);
    return failures == 0 ? 0 : 1;
}
