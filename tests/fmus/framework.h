/* What a model sees of the framework: its numbers, and a way to speak. The builder writes the model. */
#include <math.h>
#include <signal.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#pragma GCC visibility push(hidden)
#define ROOM 512

typedef struct Model {
    double time, r[64]; int64_t i[64]; bool b[16]; char s[4][ROOM]; double hidden[8]; /* the state: NUMBERS bytes */
    char resources[ROOM], name[ROOM];
    void *log, *environment;
} Model;
#define NUMBERS offsetof(Model, resources)
#define TIME (m->time)
#define R(k) (m->r[k])
#define I(k) (m->i[k])
#define B(k) (m->b[k])
#define S(k) (m->s[k])
#define HIDDEN(k) (m->hidden[k])

void say(Model *m, int status, const char *text, double value);
void resource(Model *m, const char *file, char *path);

/* Of the model: its functions return a status, 0 for OK; states: places of states and of their derivatives;
   places: first place and size of each variable (FMI 3.0). */
extern const char *const model_token;
extern const double model_near;
extern const int model_ends, model_time_event, model_states[][2], model_places[][2];
int model_start(Model *m), model_update(Model *m), model_step(Model *m, double h), model_completed(Model *m);
void model_ended(Model *m);
#pragma GCC visibility pop
