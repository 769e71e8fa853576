/* A haptic loop of 1 kHz beside a simulation that takes as long as it takes: haptic SCENE [MILLISECONDS].
 *
 * The simulation has a thread of its own. The haptic loop never waits for it: each tick it shows the force that the last steps lead to, extrapolated
 * along them, changed by no more than a limit a tick, and made passive: an observer adds up the energy that the hand has been given, and where that
 * is more than it has put in, a damper takes the rest (Hannaford & Ryu 2002, "Time-domain passivity control of haptic interfaces"). A device's
 * position would come from its driver; here a scripted hand goes to and fro.
 */
#define _GNU_SOURCE
#include <c_api.h>

#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

enum { kTickNs = 1000000, kHistogram = 12 };
static const double kTick = 1e-3;        /* s */
static const double kMostChange = 0.02;  /* N in a tick: 20 N/s */
static const double kMostAhead = 0.02;   /* s; older forces are not extrapolated any further */
static const double kMostDamping = 50.0; /* N s/m */

static int64_t now_ns(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}
static void sleep_until(int64_t ns) {
    const struct timespec at = {ns / 1000000000, ns % 1000000000};
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, NULL) != 0) continue;
}

/* ---- passivity ------------------------------------------------------------------------------------------------------------------------ */

typedef struct Passivity {
    double energy; /* J that the hand has put in and not got back; less than 0: the loop has made it */
    double damped; /* J that the damper is to take, by the velocity that it was set for */
    double shown;  /* N, in the last tick */
} Passivity;

/* The force to show.
 * force      N, of the device on the hand
 * velocity   m/s, of the hand since the last tick: what the last force has done is known now */
static double make_passive(Passivity* p, double force, double velocity) {
    p->energy -= p->shown * velocity * kTick;
    p->shown = force;
    if (p->energy >= 0.0 || velocity == 0.0) return p->shown;
    double damping = -p->energy / (velocity * velocity * kTick);
    if (damping > kMostDamping) damping = kMostDamping;
    p->damped += damping * velocity * velocity * kTick;
    return p->shown = force - damping * velocity;
}

/* A hand of 50 g thrown against a virtual wall of 4 kN/m that is sampled once a tick: a sampled spring gives more than it takes. Returns the hand's
 * kinetic energy afterwards over that before. */
static double bounce(int passive) {
    const double mass = 0.05, stiffness = 4000.0;
    double x = -0.002, v = 0.1, last = x;
    const double before = 0.5 * mass * v * v;
    Passivity passivity = {0.0, 0.0, 0.0};
    for (int tick = 0; tick < 2000; ++tick) {
        double force = x > 0.0 ? -stiffness * x : 0.0;
        if (passive) force = make_passive(&passivity, force, (x - last) / kTick);
        last = x;
        for (int k = 0; k < 100; ++k) { /* the hand itself is continuous */
            v += force / mass * kTick / 100;
            x += v * kTick / 100;
        }
    }
    return 0.5 * mass * v * v / before;
}

/* ---- what both threads share ---------------------------------------------------------------------------------------------------------- */

typedef struct Shared {
    pthread_mutex_t lock;
    trocar_simulator* simulator; /* of the simulation's thread alone */
    double step;                 /* s */
    double wanted;               /* m, insertion that the hand asks for */
    double force[2], at[2];      /* N, s: of the last two steps, and when they were done */
    long steps;
    int running, failed;
} Shared;

static void* simulate(void* given) {
    Shared* shared = given;
    const int64_t begin = now_ns();
    for (long k = 1;; ++k) {
        pthread_mutex_lock(&shared->lock);
        const int running = shared->running;
        const double wanted = shared->wanted;
        pthread_mutex_unlock(&shared->lock);
        if (!running) return NULL;
        double force = 0.0;
        const int fine = trocar_set_drive(shared->simulator, 0, wanted, 0.0) == TROCAR_OK && trocar_step(shared->simulator) == TROCAR_OK &&
                         trocar_get_handle(shared->simulator, &force, NULL) == TROCAR_OK;
        if (!fine) fprintf(stderr, "error: %s\n", trocar_last_error());
        pthread_mutex_lock(&shared->lock);
        shared->force[0] = shared->force[1], shared->at[0] = shared->at[1];
        shared->force[1] = force, shared->at[1] = 1e-9 * (double)now_ns();
        shared->steps = k;
        shared->failed |= !fine;
        pthread_mutex_unlock(&shared->lock);
        if (!fine) return NULL;
        sleep_until(begin + (int64_t)(1e9 * shared->step * (double)k)); /* no faster than what is simulated */
    }
}

/* Along the last two steps, as far ahead as they are apart. */
static double extrapolate(const Shared* shared, double now) {
    const double apart = shared->at[1] - shared->at[0];
    if (shared->steps < 2 || !(apart > 0.0)) return shared->force[1];
    const double ahead = fmin(fmin(now - shared->at[1], apart), kMostAhead);
    return shared->force[1] + (shared->force[1] - shared->force[0]) / apart * ahead;
}

static int compare(const void* a, const void* b) {
    const double x = *(const double*)a, y = *(const double*)b;
    return (x > y) - (x < y);
}

int main(int argc, char** argv) {
    const double alone = bounce(0), passive = bounce(1);
    printf("virtual wall: a hand comes back with %.2f of its energy, with the observer %.2f\n", alone, passive);
    if (!(alone > 1.0) || !(passive <= 1.0)) return 1; /* the same on every machine */
    if (argc < 2) return fprintf(stderr, "usage: haptic SCENE [MILLISECONDS]\n"), 2;
    const long ticks = argc > 2 ? atol(argv[2]) : 2000;

    trocar_scene* scene = NULL;
    Shared shared = {.lock = PTHREAD_MUTEX_INITIALIZER, .running = 1};
    double start = 0.0;
    if (ticks < 1 || ticks > 10000000 || trocar_load_scene(argv[1], &scene) != TROCAR_OK || trocar_create(scene, NULL, &shared.simulator) != TROCAR_OK ||
        trocar_get_drive(shared.simulator, 0, &start, NULL) != TROCAR_OK)
        return fprintf(stderr, "error: %s\n", trocar_last_error()), 2;
    shared.step = trocar_step_length(scene);
    shared.wanted = start;
    double* ages = malloc((size_t)ticks * sizeof *ages); /* s, of the force that a tick shows */
    pthread_t simulation;
    if (ages == NULL || pthread_create(&simulation, NULL, simulate, &shared) != 0) return 2;

    Passivity passivity = {0.0, 0.0, 0.0};
    double shown = 0.0, last = start, largest = 0.0, fastest = 0.0;
    long missed = 0, shaped = 0;
    long histogram[kHistogram] = {0}; /* of lateness, in powers of two from 8 us on */
    const int64_t begin = now_ns();
    for (long tick = 0; tick < ticks; ++tick) {
        const int64_t due = begin + (int64_t)kTickNs * tick;
        sleep_until(due);
        const int64_t woken = now_ns();
        int bin = 0;
        while (bin + 1 < kHistogram && woken - due > ((int64_t)8000 << bin)) ++bin;
        ++histogram[bin];
        missed += woken - due > kTickNs; /* its time had gone by before it began */
        const double hand = start + 0.002 * sin(3.14159265358979 * kTick * (double)tick); /* m: 2 mm to and fro, every 2 s */
        const double velocity = (hand - last) / kTick;
        pthread_mutex_lock(&shared.lock);
        shared.wanted = hand;
        const double now = 1e-9 * (double)now_ns();
        double force = -extrapolate(&shared, now); /* what pushes the drive on pushes the hand back */
        ages[tick] = shared.steps > 0 ? now - shared.at[1] : 0.0;
        const int failed = shared.failed;
        pthread_mutex_unlock(&shared.lock);
        if (failed) break;
        const double change = fmax(-kMostChange, fmin(kMostChange, force - shown));
        shaped += change != force - shown;
        force = make_passive(&passivity, shown + change, velocity);
        fastest = fmax(fastest, fabs(change));
        shown += change;
        largest = fmax(largest, fabs(force));
        last = hand; /* here `force` would go to the device */
    }
    pthread_mutex_lock(&shared.lock);
    shared.running = 0;
    pthread_mutex_unlock(&shared.lock);
    pthread_join(simulation, NULL);

    qsort(ages, (size_t)ticks, sizeof *ages, compare);
    printf("%ld ticks of 1 ms, %ld missed; %ld steps of %g ms\n", ticks, missed, shared.steps, 1e3 * shared.step);
    printf("the force shown was %.2f ms old in the median, %.2f ms at p99; %.4f N at most, changed by %.4f N a tick at most, %ld ticks limited\n",
           1e3 * ages[ticks / 2], 1e3 * ages[(ticks * 99) / 100], largest, fastest, shaped);
    printf("energy that the hand put in: %.3g J; taken by the observer's damper: %.3g J\n", passivity.energy, passivity.damped);
    printf("woken late by up to");
    for (int bin = 0; bin < kHistogram; ++bin) printf(" %ld us: %ld%s", (8L << bin), histogram[bin], bin + 1 < kHistogram ? "," : "\n");
    free(ages);
    trocar_destroy(shared.simulator);
    trocar_free_scene(scene);
    return shared.failed ? 3 : 0;
}
