/* How a program of quadvis goes on from tick to tick. blocks.h has its blocks, calls.h what is called when. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "model.h"
#include "blocks.h"

#define NEAR 1e-9 /* s: instants that are no further apart are one */

static double real_at(const Model *m, int32_t slot) { return ld_f64((const char *)&m->state.memory[slot]); }
static void put(Model *m, int32_t slot, double value) { st_f64((char *)&m->state.memory[slot], value); }
static char *at(Model *m, int32_t slot) { return (char *)&m->state.memory[slot]; }

/* The time of a tick, rounded once. */
static double time_of(int64_t tick) { return (double)(tick * PERIOD_ABOVE) / (double)PERIOD_BELOW; }

static int due(const Model *m, int64_t every, int64_t first) {
    return m->state.tick >= first && (m->state.tick - first) % every == 0;
}

static int failed(Model *m, const char *block, const char *what) {
    char text[512];
    snprintf(text, sizeof text, "block '%s', t = %.9g s: %s", block, time_of(m->state.tick), what);
    if (m->say) m->say(m->caller, text);
    return 1;
}

static int finite_at(const Model *m, int32_t first, int32_t count) {
    for (int32_t k = first; k < first + count; k++)
        if (!isfinite(real_at(m, k))) return 0;
    return 1;
}

static int fell(Model *m, const char *block, const char *fallback, const char *error) {
    const char *sentence = why(error);
    return failed(m, block, sentence ? sentence : fallback);
}

#define CALL(block, method, function, ...) \
    do { \
        char *error = 0; \
        if (function((char *)&error, __VA_ARGS__)) return fell(m, block, "'" method "' failed", error); \
    } while (0)
#define CHECK(block, port, first, count) \
    if (!finite_at(m, first, count)) return failed(m, block, "port '" port "': the output is not finite")
#include "calls.h"

#if EVENTS
#include "events.h"

/* Let `sum` be the states one step later. */
static int stepped(Model *m, double time, double *sum) {
    Events events;
    if (advance(m, &events, time)) return 1;
    memcpy(sum, events.state, sizeof events.state);
    return 0;
}
#else
/* Let `sum` be the states one step later, with the operations in the order in which quadvis does them. */
static int stepped(Model *m, double time, double *sum) {
    double begin[STATES + 1];
    for (int k = 0; k < STATES; k++) begin[k] = sum[k] = real_at(m, state_slots[k]);
    for (int stage = 0; stage < STAGES; stage++) {
        if (stage > 0) {
            put(m, 0, time + stages[stage][0]);
            if (call_minor(m)) return 1;
        }
        if (call_derivatives(m)) return 1;
        for (int k = 0; k < STATES; k++) {
            const double slope = real_at(m, slope_slots[k]);
            put(m, state_slots[k], begin[k] + stages[stage][1] * slope);
            sum[k] += stages[stage][2] * slope;
        }
    }
    return 0;
}
#endif

/* One step of the solver. */
static int integrate(Model *m) {
    double sum[STATES + 1];
    uint64_t kept[HELD + 1];
    const double time = real_at(m, 0);
    if (STATES == 0) return 0;
    for (int k = 0; k < HELD; k++) kept[k] = m->state.memory[held_slots[k]];
    if (stepped(m, time, sum)) return 1;
    put(m, 0, time);
    for (int k = 0; k < HELD; k++) m->state.memory[held_slots[k]] = kept[k];
    for (int k = 0; k < STATES; k++) put(m, state_slots[k], sum[k]);
    for (int k = 0; k < STATES; k++)
        if (!isfinite(sum[k])) return failed(m, "the solver", "a state left the finite numbers");
    return 0;
}

/* Delayed values are copied once a tick, before their producers run; all the rest may run again, from what was. */
static void arrive(Model *m) {
    put(m, 0, time_of(m->state.tick));
    call_delays(m);
    for (int k = 0; k < UNDONE; k++) m->state.before[k] = m->state.memory[undone_slots[k]];
    m->state.arrived = 1;
    m->state.fresh = 0;
}

static int outputs(Model *m) {
    if (m->state.fresh) return 0;
    for (int k = 0; k < UNDONE; k++) m->state.memory[undone_slots[k]] = m->state.before[k];
    if (call_outputs(m)) return 1;
    m->state.fresh = 1;
    return 0;
}

void model_make(Model *m) {
    memset(&m->state, 0, sizeof m->state);
    memcpy(m->state.memory, image, sizeof image);
}

static uint64_t *settable(Model *m, int variable, int element) {
    return &m->state.memory[model_places[model_variables[variable].first + element]];
}

int model_begin(Model *m) {
    uint64_t kept[SETTABLE + 1];
    int count = 0;
    for (int v = 0; v < VARIABLES; v++)
        for (int k = 0; k < model_variables[v].count; k++)
            if (model_variables[v].role != 'o') kept[count++] = *settable(m, v, k);
    memcpy(m->state.memory, image, sizeof image);
    count = 0;
    for (int v = 0; v < VARIABLES; v++)
        for (int k = 0; k < model_variables[v].count; k++)
            if (model_variables[v].role != 'o') *settable(m, v, k) = kept[count++];
    m->state.tick = 0;
    if (call_starts(m)) return 1;
    arrive(m);
    m->state.started = 1;
    return 0;
}

int model_read(Model *m) {
    if (!m->state.started && model_begin(m)) return 1;
    return m->state.arrived ? outputs(m) : 0;
}

int model_advance(Model *m, double time) {
    State *s = &m->state;
    const double end = time - s->begin;
    if (!s->started && model_begin(m)) return 1;
    for (;;) {
        if (!s->arrived) {
            if (time_of(s->tick) > end + NEAR) break;
            arrive(m);
        }
        if (time_of(s->tick) > end - NEAR) break;
        if (outputs(m) || call_checks(m) || call_updates(m) || integrate(m)) return 1;
        s->tick++;
        s->arrived = 0;
    }
    s->now = time;
    return 0;
}

/* FMI's types are narrower and wider than those of the memory. */
int model_set(Model *m, int32_t variable, int32_t element, char kind, double real, int64_t whole) {
    const Variable *v = &model_variables[variable];
    const int32_t slot = model_places[v->first + element];
    const double value = kind == 'd' ? real : (double)whole;
    if (v->kind != kind || v->role == 'o') return failed(m, "the FMU", "an output, or a variable of another type, was set");
    if (v->role == 'p' && !(value >= v->least && value <= v->most))
        return failed(m, "the FMU", "a parameter was set to a value beyond its limits");
    if (kind == 'd') put(m, slot, real);
    else m->state.memory[slot] = kind == 'b' ? (uint64_t)(whole != 0) : (uint64_t)whole;
    m->state.fresh = 0;
    if (v->role == 'p' && m->state.tick == 0) m->state.started = 0; /* states may begin with it */
    return 0;
}

int model_get(Model *m, int32_t variable, int32_t element, char kind, double *real, int64_t *whole) {
    const Variable *v = &model_variables[variable];
    const int32_t slot = model_places[v->first + element];
    if (v->kind != kind) return failed(m, "the FMU", "a variable was read as another type");
    if (kind == 'd') *real = real_at(m, slot);
    else *whole = kind == 'b' ? *at(m, slot) != 0 : (int64_t)m->state.memory[slot];
    return 0;
}
