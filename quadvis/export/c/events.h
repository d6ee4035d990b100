/* The solver's step with events between two ticks, with the operations of quadvis's engine/events.py. */

/* States; values of all functions now, as they were last asked for, and at the upper end of a search. */
typedef struct {
    double state[STATES], moved[STATES], present[VALUES], found[VALUES], above[VALUES];
    uint8_t armed[VALUES], fired[VALUES];
} Events;

static int place(Model *m, double time, const double *state) {
    put(m, 0, time);
    for (int k = 0; k < STATES; k++) put(m, state_slots[k], state[k]);
    return call_minor(m);
}

/* Ask for the functions at a time, with its states. */
static int ask(Model *m, Events *e, double time, const double *state) {
    return place(m, time, state) || call_crossings(m, e->found);
}

/* Let `moved` hold the states some time later, by one step of the formula. */
static int move(Model *m, Events *e, double time, double after) {
    memcpy(e->moved, e->state, sizeof e->moved);
    if (after <= 0.0) return 0;
    for (int k = 0; k < STATES; k++) put(m, state_slots[k], e->state[k]);
    for (int stage = 0; stage < STAGES; stage++) {
        const double onward = formula[stage][1] * after, weight = formula[stage][2] * after;
        put(m, 0, stage > 0 ? time + formula[stage][0] * after : time);
        if (call_minor(m) || call_derivatives(m)) return 1;
        for (int k = 0; k < STATES; k++) {
            const double slope = real_at(m, slope_slots[k]);
            put(m, state_slots[k], e->state[k] + onward * slope);
            e->moved[k] += weight * slope;
        }
    }
    return 0;
}

static int look(Model *m, Events *e, double time, double after) {
    return move(m, e, time, after) || ask(m, e, time + after, e->moved);
}

/* The least of the armed functions as they were last asked for; NaN if one is NaN. */
static double least_armed(const Events *e) {
    double found = 0.0;
    int empty = 1;
    for (int k = 0; k < VALUES; k++) {
        const double value = e->found[k];
        if (e->armed[k] && (empty || value < found || value != value)) {
            found = value;
            empty = 0;
        }
    }
    return found;
}

/* Set `low` to where the least of the armed functions is first found to be zero or below. */
static int locate(Model *m, Events *e, double time, double *low, double high) {
    double weight_low, weight_high;
    if (look(m, e, time, *low)) return 1;
    weight_low = least_armed(e);
    if (look(m, e, time, high)) return 1;
    weight_high = least_armed(e);
    memcpy(e->above, e->found, sizeof e->above);
    for (int trial = 0; trial < TRIES; trial++) {
        const double span = weight_low - weight_high;
        double middle = *low, value;
        if (high - *low <= LOCATED * formula_step) break;
        if (isfinite(span) && span > 0.0) middle = *low + (high - *low) * weight_low / span;
        if (trial % 3 == 2 || !(*low < middle && middle < high)) middle = (*low + high) / 2;
        if (!(*low < middle && middle < high)) break;
        if (look(m, e, time, middle)) return 1;
        value = least_armed(e);
        if (value > 0.0) {
            *low = middle;
            weight_low = value;
            weight_high /= 2;
        } else {
            high = middle;
            weight_high = value;
            weight_low /= 2;
            memcpy(e->above, e->found, sizeof e->above);
        }
    }
    for (int k = 0; k < VALUES; k++) e->fired[k] = e->armed[k] && e->above[k] <= 0.0;
    *low = high;
    return 0;
}

/* Set `taken` to the time after which the first event comes; to a negative one if none does. */
static int first_event(Model *m, Events *e, double time, double rest, double *taken) {
    double before = 0.0;
    int parts = rest < formula_step ? PARTS : 1;
    for (int k = 0; k < VALUES; k++) {
        e->armed[k] = e->present[k] > 0.0;
        if (e->present[k] == 0.0) parts = PARTS;
    }
    for (int part = 1; part <= parts; part++) {
        const double after = rest * part / parts;
        int fallen = 0;
        if (look(m, e, time, after)) return 1;
        for (int k = 0; k < VALUES; k++) fallen |= e->armed[k] && e->found[k] <= 0.0;
        if (fallen) {
            *taken = before;
            return locate(m, e, time, taken, after);
        }
        for (int k = 0; k < VALUES; k++) e->armed[k] |= e->found[k] > 0.0;
        before = after;
    }
    *taken = -1.0;
    return 0;
}

/* Let the events happen, and compute anew what follows from them. */
static int happen(Model *m, Events *e, double time) {
    if (place(m, time, e->state)) return 1;
    for (int block = 0; block < EVENTS; block++) {
        int fired = 0;
        for (int k = first_value[block]; k < first_value[block + 1]; k++) fired |= e->fired[k];
        if (fired && call_event(m, block)) return 1;
    }
    if (call_renewed(m)) return 1;
    for (int k = 0; k < STATES; k++) e->state[k] = real_at(m, state_slots[k]);
    if (ask(m, e, time, e->state)) return 1;
    memcpy(e->present, e->found, sizeof e->present);
    for (int k = 0; k < VALUES; k++) {
        e->armed[k] = e->armed[k] && !e->fired[k];
        e->fired[k] = e->armed[k] && e->present[k] <= 0.0;
    }
    return 0;
}

static int any_fired(const Events *e) {
    for (int k = 0; k < VALUES; k++)
        if (e->fired[k]) return 1;
    return 0;
}

/* Advance the states by one step, from event to event. */
static int advance(Model *m, Events *e, double time) {
    double done = 0.0;
    int happened = 0;
    for (int k = 0; k < STATES; k++) e->state[k] = real_at(m, state_slots[k]);
    if (ask(m, e, time, e->state)) return 1;
    memcpy(e->present, e->found, sizeof e->present);
    for (;;) {
        const double rest = formula_step - done;
        double taken;
        if (first_event(m, e, time + done, rest, &taken)) return 1;
        if (move(m, e, time + done, taken < 0.0 ? rest : taken)) return 1;
        memcpy(e->state, e->moved, sizeof e->state);
        if (taken < 0.0) return 0;
        done += taken;
        while (any_fired(e)) {
            if (++happened > MOST) return failed(m, "the solver", "more events within one step than can be meant");
            if (happen(m, e, time + done)) return 1;
        }
    }
}
