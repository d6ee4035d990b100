/* The functions of FMI 2.0 for co-simulation. An instance is used by one thread at a time. */
#include <stdlib.h>
#include <string.h>
#include "fmi2Functions.h"
#include "model.h"

typedef struct {
    Model model;
    fmi2CallbackFunctions call;
    char *name;
} Instance;

static void say(void *caller, const char *text) {
    const Instance *i = caller;
    if (i->call.logger) i->call.logger(i->call.componentEnvironment, i->name, fmi2Error, "logStatusError", "%s", text);
}

#define UNUSED(x) (void)(x)
#define STATUS(failed) ((failed) ? fmi2Error : fmi2OK)

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[]) {
    UNUSED(c); UNUSED(on); UNUSED(n); UNUSED(categories);
    return fmi2OK;
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String token, fmi2String resources,
                              const fmi2CallbackFunctions *call, fmi2Boolean visible, fmi2Boolean logging) {
    UNUSED(resources); UNUSED(visible); UNUSED(logging);
    if (!call || !token || strcmp(token, TOKEN) != 0 || type != fmi2CoSimulation) return NULL;
    Instance *i = calloc(1, sizeof *i);
    if (!i) return NULL;
    const size_t length = strlen(name ? name : "") + 1;
    i->name = malloc(length);
    if (!i->name) { free(i); return NULL; }
    memcpy(i->name, name ? name : "", length);
    i->call = *call;
    i->model.say = say;
    i->model.caller = i;
    model_make(&i->model);
    return i;
}

void fmi2FreeInstance(fmi2Component c) {
    Instance *i = c;
    if (i) free(i->name);
    free(i);
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean defined, fmi2Real tolerance, fmi2Real start,
                               fmi2Boolean stops, fmi2Real stop) {
    UNUSED(defined); UNUSED(tolerance); UNUSED(stops); UNUSED(stop);
    ((Instance *)c)->model.state.begin = start;
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) { UNUSED(c); return fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    Model *m = &((Instance *)c)->model;
    return STATUS(!m->state.started && model_begin(m));
}
fmi2Status fmi2Terminate(fmi2Component c) { UNUSED(c); return fmi2OK; }
fmi2Status fmi2Reset(fmi2Component c) { model_make(&((Instance *)c)->model); return fmi2OK; }

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real step, fmi2Boolean no_way_back) {
    UNUSED(no_way_back);
    return STATUS(model_advance(&((Instance *)c)->model, time + step));
}

/* Getting outputs computes them, if inputs were set since. */
static int readable(Model *m, const fmi2ValueReference v[], size_t n) {
    for (size_t k = 0; k < n; k++) {
        if (v[k] >= VARIABLES) return 0;
        if (model_variables[v[k]].role == 'o') return model_read(m) == 0;
    }
    return 1;
}

#define ACCESS(Name, type, letter, real, whole, from, least, most) \
    fmi2Status fmi2Get##Name(fmi2Component c, const fmi2ValueReference v[], size_t n, type values[]) { \
        Model *m = &((Instance *)c)->model; double d = 0.0; int64_t q = 0; \
        if (!readable(m, v, n)) return fmi2Error; \
        for (size_t k = 0; k < n; k++) { \
            if (model_get(m, (int32_t)v[k], 0, letter, &d, &q) || (letter == 'q' && (q < least || q > most))) return fmi2Error; \
            values[k] = (type)from; } \
        return fmi2OK; } \
    fmi2Status fmi2Set##Name(fmi2Component c, const fmi2ValueReference v[], size_t n, const type values[]) { \
        Model *m = &((Instance *)c)->model; \
        for (size_t k = 0; k < n; k++) \
            if (v[k] >= VARIABLES || model_set(m, (int32_t)v[k], 0, letter, real, whole)) return fmi2Error; \
        return fmi2OK; }
ACCESS(Real, fmi2Real, 'd', values[k], 0, d, 0, 0)
ACCESS(Integer, fmi2Integer, 'q', 0.0, values[k], q, INT32_MIN, INT32_MAX)
ACCESS(Boolean, fmi2Boolean, 'b', 0.0, values[k], q, 0, 1)

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference v[], size_t n, fmi2String values[]) {
    UNUSED(c); UNUSED(v); UNUSED(values);
    return n ? fmi2Error : fmi2OK;
}
fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference v[], size_t n, const fmi2String values[]) {
    UNUSED(c); UNUSED(v); UNUSED(values);
    return n ? fmi2Error : fmi2OK;
}

/* The whole state is a copy of one structure. */
fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) {
    if (!*state) *state = malloc(sizeof(State));
    if (!*state) return fmi2Error;
    memcpy(*state, &((Instance *)c)->model.state, sizeof(State));
    return fmi2OK;
}
fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) {
    memcpy(&((Instance *)c)->model.state, state, sizeof(State));
    return fmi2OK;
}
fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) {
    UNUSED(c);
    free(*state);
    *state = NULL;
    return fmi2OK;
}
fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size) {
    UNUSED(c); UNUSED(state);
    *size = sizeof(State);
    return fmi2OK;
}
fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte data[], size_t size) {
    UNUSED(c);
    if (size != sizeof(State)) return fmi2Error;
    memcpy(data, state, size);
    return fmi2OK;
}
fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte data[], size_t size, fmi2FMUstate *state) {
    UNUSED(c);
    if (size != sizeof(State)) return fmi2Error;
    if (!*state) *state = malloc(size);
    if (!*state) return fmi2Error;
    memcpy(*state, data, size);
    return fmi2OK;
}

/* What the description does not offer. */
fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference u[], size_t nu,
    const fmi2ValueReference k[], size_t nk, const fmi2Real dk[], fmi2Real du[]) {
    UNUSED(c); UNUSED(u); UNUSED(nu); UNUSED(k); UNUSED(nk); UNUSED(dk); UNUSED(du);
    return fmi2Error;
}
fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference v[], size_t n,
    const fmi2Integer order[], const fmi2Real values[]) {
    UNUSED(c); UNUSED(v); UNUSED(n); UNUSED(order); UNUSED(values);
    return fmi2Error;
}
fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference v[], size_t n,
    const fmi2Integer order[], fmi2Real values[]) {
    UNUSED(c); UNUSED(v); UNUSED(n); UNUSED(order); UNUSED(values);
    return fmi2Error;
}
fmi2Status fmi2CancelStep(fmi2Component c) { UNUSED(c); return fmi2Error; }
fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value) {
    UNUSED(c); UNUSED(kind); UNUSED(value);
    return fmi2Discard;
}
fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value) {
    UNUSED(c); UNUSED(kind); UNUSED(value);
    return fmi2Discard;
}
fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value) {
    UNUSED(c); UNUSED(kind); UNUSED(value);
    return fmi2Discard;
}
fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value) {
    UNUSED(c); UNUSED(kind); UNUSED(value);
    return fmi2Discard;
}
fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String *value) {
    UNUSED(c); UNUSED(kind); UNUSED(value);
    return fmi2Discard;
}

/* Model exchange is not offered; some importers look for its functions all the same. */
fmi2Status fmi2EnterEventMode(fmi2Component c) { UNUSED(c); return fmi2Error; }
fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info) { UNUSED(c); UNUSED(info); return fmi2Error; }
fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) { UNUSED(c); return fmi2Error; }
fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean no, fmi2Boolean *event, fmi2Boolean *end) {
    UNUSED(c); UNUSED(no); UNUSED(event); UNUSED(end);
    return fmi2Error;
}
fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time) { UNUSED(c); UNUSED(time); return fmi2Error; }
fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t n) {
    UNUSED(c); UNUSED(x); UNUSED(n);
    return fmi2Error;
}
fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real dx[], size_t n) {
    UNUSED(c); UNUSED(dx); UNUSED(n);
    return fmi2Error;
}
fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real z[], size_t n) {
    UNUSED(c); UNUSED(z); UNUSED(n);
    return fmi2Error;
}
fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t n) {
    UNUSED(c); UNUSED(x); UNUSED(n);
    return fmi2Error;
}
fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real x[], size_t n) {
    UNUSED(c); UNUSED(x); UNUSED(n);
    return fmi2Error;
}
