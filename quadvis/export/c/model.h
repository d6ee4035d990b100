/* A program of quadvis as one structure of numbers, and what the functions of FMI do with it. */
#ifndef QUADVIS_MODEL_H
#define QUADVIS_MODEL_H
#include <stddef.h>
#include <stdint.h>
#include "program.h" /* what this program is */

/* All that can change: a saved state is a copy of it. */
typedef struct {
    uint64_t memory[SLOTS]; /* 8 bytes each: a double, a whole number, or a truth value in the first byte */
    int64_t tick;           /* the next to run */
    uint64_t before[UNDONE + 1]; /* what conditions have changed, as it was when the tick came */
    double begin, now;      /* s: the time of the first tick; that which has been reached */
    uint8_t started;        /* the states have their first values */
    uint8_t arrived;        /* the time of the tick has come: what is due then can be computed */
    uint8_t fresh;          /* the outputs are those of the present inputs */
} State;

typedef struct {
    State state;
    void (*say)(void *caller, const char *text);
    void *caller;
} Model;

/* A variable: places[first] to places[first + count - 1] are its slots. kind is 'd', 'q' or 'b'; role is
   'i' of an input, 'o' of an output, 'p' of a parameter, whose values lie between least and most. */
typedef struct {
    int32_t first, count;
    char kind, role;
    double least, most;
} Variable;
extern const Variable model_variables[];
extern const int32_t model_places[];

/* Each returns 0, or 1 and has said why. */
void model_make(Model *m);                /* all values as they are at first */
int model_begin(Model *m);                /* first values of the states, from the present parameters */
int model_read(Model *m);                 /* make the outputs readable */
int model_advance(Model *m, double time); /* run all ticks before a time (s), and arrive at it */
int model_set(Model *m, int32_t variable, int32_t element, char kind, double real, int64_t whole);
int model_get(Model *m, int32_t variable, int32_t element, char kind, double *real, int64_t *whole);
#endif
