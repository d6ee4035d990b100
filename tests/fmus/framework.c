/* All functions of FMI 2.0 or 3.0 (FMI is 2 or 3) over arrays of numbers, for the small models of the tests. */
#include <stddef.h>
#include "framework.h"
#if FMI == 2
#include "fmi2Functions.h"
typedef fmi2Status Status;
#else
#include "fmi3Functions.h"
typedef fmi3Status Status;
#endif
#define states model_states
#define places model_places
#define update model_update
#define step model_step
#define start model_start
#define completed model_completed
#define ended model_ended
#define TOKEN model_token
#define NEAR model_near
#define ENDS model_ends
#define TIME_EVENT model_time_event

void say(Model *m, int status, const char *text, double value) {
#if FMI == 2
    ((fmi2CallbackLogger)m->log)(m->environment, m->name, (fmi2Status)status, "trial", "%s: %g", text, value);
#else
    char line[ROOM];
    snprintf(line, sizeof line, "%s: %g", text, value);
    ((fmi3LogMessageCallback)m->log)(m->environment, (fmi3Status)status, "trial", line);
#endif
}

static int hex(char c) { return c <= '9' ? c - '0' : (c | 32) - 'a' + 10; }

/* Give the path of a resource; FMI 2.0 gives a URI, of which RFC 3986 says how it is read. */
void resource(Model *m, const char *file, char *path) {
#if FMI == 2
    const char *from = strncmp(m->resources, "file://", 7) ? m->resources : m->resources + 7;
    char *to = path;
    for (; *from; from++)
        if (*from == '%') { *to++ = (char)(16 * hex(from[1]) + hex(from[2])); from += 2; } else *to++ = *from;
    sprintf(to, "/%s", file);
#else
    sprintf(path, "%s%s", m->resources, file);
#endif
}

#if FMI == 2
#define F(name) fmi2##name
#define OK fmi2OK
#define TEXT fmi2String
#define STATE fmi2FMUstate
#define COUNT , size_t n
#define VALUES
#else
#define F(name) fmi3##name
#define OK fmi3OK
#define TEXT fmi3String
#define STATE fmi3FMUState
#endif
#define VOID(x) (void)(x)

static Model *make(const char *name, const char *token, const char *resources) {
    if (!name || !token || strcmp(token, TOKEN)) return NULL;
    Model *m = calloc(1, sizeof *m);
    snprintf(m->name, ROOM, "%s", name);
    snprintf(m->resources, ROOM, "%s", resources ? resources : "");
    return m;
}

#if FMI == 2
const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String k[]) {
    VOID(c); VOID(on); VOID(n); VOID(k); return OK;
}
fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String token, fmi2String resources,
                              const fmi2CallbackFunctions *call, fmi2Boolean visible, fmi2Boolean logging) {
    VOID(type); VOID(visible); VOID(logging);
    Model *m = make(name, token, resources);
    if (!m) return NULL;
    m->log = (void *)call->logger; m->environment = call->componentEnvironment;
    if (start(m)) { free(m); return NULL; }
    return m;
}
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean t, fmi2Real tolerance, fmi2Real start_time,
                               fmi2Boolean s, fmi2Real stop) {
    VOID(t); VOID(tolerance); VOID(s); VOID(stop);
    ((Model *)c)->time = start_time; return OK;
}
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { VOID(c); return OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return (fmi2Status)update(c); }
#define ACCESS(Name, type, item) \
    fmi2Status fmi2Get##Name(fmi2Component c, const fmi2ValueReference v[], size_t n, type out[]) { \
        Model *m = c; update(m); \
        for (size_t k = 0; k < n; k++) out[k] = (type)m->item[v[k]]; return OK; } \
    fmi2Status fmi2Set##Name(fmi2Component c, const fmi2ValueReference v[], size_t n, const type in[]) { \
        Model *m = c; for (size_t k = 0; k < n; k++) m->item[v[k]] = in[k]; return OK; }
ACCESS(Real, fmi2Real, r)
ACCESS(Integer, fmi2Integer, i)
ACCESS(Boolean, fmi2Boolean, b)
fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference v[], size_t n, fmi2String out[]) {
    for (size_t k = 0; k < n; k++) out[k] = ((Model *)c)->s[v[k]]; return OK;
}
fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference v[], size_t n, const fmi2String in[]) {
    for (size_t k = 0; k < n; k++) snprintf(((Model *)c)->s[v[k]], ROOM, "%s", in[k]); return OK;
}
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no) {
    Model *m = c; VOID(no);
    if (fabs(m->time - t) > NEAR) { say(m, fmi2Error, "the step begins elsewhere", t); return fmi2Error; }
    m->time = t;
    int status = step(m, h);
    m->time = t + h;
    return (fmi2Status)status;
}
fmi2Status fmi2CancelStep(fmi2Component c) { VOID(c); return fmi2Error; }
fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind s, fmi2Status *v) { VOID(c); VOID(s); VOID(v); return fmi2Error; }
fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind s, fmi2Real *v) { VOID(c); VOID(s); VOID(v); return fmi2Error; }
fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind s, fmi2Integer *v) { VOID(c); VOID(s); VOID(v); return fmi2Error; }
fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind s, fmi2Boolean *v) { VOID(c); VOID(s); *v = ENDS; return OK; }
fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind s, fmi2String *v) { VOID(c); VOID(s); VOID(v); return fmi2Error; }
fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference v[], size_t n, const fmi2Integer o[], const fmi2Real x[]) {
    VOID(c); VOID(v); VOID(n); VOID(o); VOID(x); return fmi2Error;
}
fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference v[], size_t n, const fmi2Integer o[], fmi2Real x[]) {
    VOID(c); VOID(v); VOID(n); VOID(o); VOID(x); return fmi2Error;
}
fmi2Status fmi2EnterEventMode(fmi2Component c) { VOID(c); return OK; }
fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info) {
    VOID(c); memset(info, 0, sizeof *info); info->nextEventTimeDefined = TIME_EVENT; info->nextEventTime = 1.0; return OK;
}
fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean no, fmi2Boolean *event, fmi2Boolean *end) {
    VOID(no); *event = completed(c); *end = 0; return OK;
}
#else
const char *fmi3GetVersion(void) { return fmi3Version; }
fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n, const fmi3String k[]) {
    VOID(c); VOID(on); VOID(n); VOID(k); return OK;
}
static Model *made(const char *name, const char *token, const char *resources, void *environment, fmi3LogMessageCallback log) {
    Model *m = make(name, token, resources);
    if (!m) return NULL;
    m->log = (void *)log; m->environment = environment;
    if (start(m)) { free(m); return NULL; }
    return m;
}
fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log) {
    VOID(visible); VOID(logging); return made(name, token, resources, environment, log);
}
fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging, fmi3Boolean events, fmi3Boolean early, const fmi3ValueReference v[], size_t n,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback between) {
    VOID(visible); VOID(logging); VOID(events); VOID(early); VOID(v); VOID(n); VOID(between);
    return made(name, token, resources, environment, log);
}
fmi3Instance fmi3InstantiateScheduledExecution(fmi3String a, fmi3String b, fmi3String c, fmi3Boolean d, fmi3Boolean e,
    fmi3InstanceEnvironment f, fmi3LogMessageCallback g, fmi3ClockUpdateCallback h, fmi3LockPreemptionCallback i,
    fmi3UnlockPreemptionCallback j) {
    VOID(a); VOID(b); VOID(c); VOID(d); VOID(e); VOID(f); VOID(g); VOID(h); VOID(i); VOID(j); return NULL;
}
fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean t, fmi3Float64 tolerance, fmi3Float64 start_time,
    fmi3Boolean s, fmi3Float64 stop) {
    VOID(t); VOID(tolerance); VOID(s); VOID(stop); ((Model *)c)->time = start_time; return OK;
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { return (fmi3Status)update(c); }
#define ACCESS(Name, type, item, table) \
    fmi3Status fmi3Get##Name(fmi3Instance c, const fmi3ValueReference v[], size_t n, type out[], size_t values) { \
        Model *m = c; update(m); size_t at = 0; \
        for (size_t k = 0; k < n; k++) for (int e = 0; e < table[v[k]][1]; e++) out[at++] = (type)m->item[table[v[k]][0] + e]; \
        return at == values ? OK : fmi3Error; } \
    fmi3Status fmi3Set##Name(fmi3Instance c, const fmi3ValueReference v[], size_t n, const type in[], size_t values) { \
        Model *m = c; size_t at = 0; \
        for (size_t k = 0; k < n; k++) for (int e = 0; e < table[v[k]][1]; e++) m->item[table[v[k]][0] + e] = in[at++]; \
        return at == values ? OK : fmi3Error; }
ACCESS(Float64, fmi3Float64, r, places)
ACCESS(Float32, fmi3Float32, r, places)
ACCESS(Int8, fmi3Int8, i, places)
ACCESS(UInt8, fmi3UInt8, i, places)
ACCESS(Int16, fmi3Int16, i, places)
ACCESS(UInt16, fmi3UInt16, i, places)
ACCESS(Int32, fmi3Int32, i, places)
ACCESS(UInt32, fmi3UInt32, i, places)
ACCESS(Int64, fmi3Int64, i, places)
ACCESS(UInt64, fmi3UInt64, i, places)
ACCESS(Boolean, fmi3Boolean, b, places)
fmi3Status fmi3GetString(fmi3Instance c, const fmi3ValueReference v[], size_t n, fmi3String out[], size_t values) {
    VOID(values); for (size_t k = 0; k < n; k++) out[k] = ((Model *)c)->s[places[v[k]][0]]; return OK;
}
fmi3Status fmi3SetString(fmi3Instance c, const fmi3ValueReference v[], size_t n, const fmi3String in[], size_t values) {
    VOID(values); for (size_t k = 0; k < n; k++) snprintf(((Model *)c)->s[places[v[k]][0]], ROOM, "%s", in[k]); return OK;
}
fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean no, fmi3Boolean *event, fmi3Boolean *end,
    fmi3Boolean *early, fmi3Float64 *last) {
    Model *m = c; VOID(no);
    *event = false; *end = ENDS; *early = false; *last = t + h;
    if (fabs(m->time - t) > NEAR) { say(m, fmi3Error, "the step begins elsewhere", t); return fmi3Error; }
    m->time = t;
    int status = step(m, h);
    m->time = t + h;
    return (fmi3Status)status;
}
fmi3Status fmi3EnterEventMode(fmi3Instance c) { VOID(c); return OK; }
fmi3Status fmi3EnterStepMode(fmi3Instance c) { VOID(c); return OK; }
fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *need, fmi3Boolean *end, fmi3Boolean *nominal,
    fmi3Boolean *values, fmi3Boolean *defined, fmi3Float64 *next) {
    VOID(c); *need = *end = *nominal = *values = false; *defined = TIME_EVENT; *next = 1.0; return OK;
}
fmi3Status fmi3CompletedIntegratorStep(fmi3Instance c, fmi3Boolean no, fmi3Boolean *event, fmi3Boolean *end) {
    VOID(no); *event = completed(c); *end = false; return OK;
}
fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance c, fmi3Float64 dx[], size_t n) {
    Model *m = c; update(m); for (size_t k = 0; k < n; k++) dx[k] = R(states[k][1]); return OK;
}
#endif
#if FMI == 2
fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real dx[], size_t n) {
    Model *m = c; update(m); for (size_t k = 0; k < n; k++) dx[k] = R(states[k][1]); return OK;
}
fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real z[], size_t n) { VOID(c); VOID(z); VOID(n); return OK; }
fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real x[], size_t n) {
    VOID(c); for (size_t k = 0; k < n; k++) x[k] = 1.0; return OK;
}
fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference u[], size_t nu, const fmi2ValueReference k[],
    size_t nk, const fmi2Real dk[], fmi2Real du[]) {
    VOID(c); VOID(u); VOID(nu); VOID(k); VOID(nk); VOID(dk); VOID(du); return fmi2Error;
}
#endif
Status F(Terminate)(void *c) { VOID(c); return OK; }
Status F(Reset)(void *c) { start(c); return OK; }
void F(FreeInstance)(void *c) { ended(c); free(c); }
Status F(EnterContinuousTimeMode)(void *c) { VOID(c); return OK; }
#if FMI == 2
Status fmi2SetTime(fmi2Component c, fmi2Real t) { ((Model *)c)->time = t; return OK; }
#else
Status fmi3SetTime(fmi3Instance c, fmi3Float64 t) { ((Model *)c)->time = t; return OK; }
#endif
Status F(SetContinuousStates)(void *c, const double x[], size_t n) {
    Model *m = c; for (size_t k = 0; k < n; k++) R(states[k][0]) = x[k]; return OK;
}
Status F(GetContinuousStates)(void *c, double x[], size_t n) {
    Model *m = c; for (size_t k = 0; k < n; k++) x[k] = R(states[k][0]); return OK;
}
#if FMI == 2
#define GET_STATE fmi2GetFMUstate
#define SET_STATE fmi2SetFMUstate
#define FREE_STATE fmi2FreeFMUstate
#define STATE_SIZE fmi2SerializedFMUstateSize
#define SERIALIZE fmi2SerializeFMUstate
#define DESERIALIZE fmi2DeSerializeFMUstate
typedef fmi2Byte Byte;
#else
#define GET_STATE fmi3GetFMUState
#define SET_STATE fmi3SetFMUState
#define FREE_STATE fmi3FreeFMUState
#define STATE_SIZE fmi3SerializedFMUStateSize
#define SERIALIZE fmi3SerializeFMUState
#define DESERIALIZE fmi3DeserializeFMUState
typedef fmi3Byte Byte;
#endif
Status GET_STATE(void *c, STATE *s) { if (!*s) *s = malloc(NUMBERS); memcpy(*s, c, NUMBERS); return OK; }
Status SET_STATE(void *c, STATE s) { memcpy(c, s, NUMBERS); return OK; }
Status FREE_STATE(void *c, STATE *s) { VOID(c); free(*s); *s = NULL; return OK; }
Status STATE_SIZE(void *c, STATE s, size_t *n) { VOID(c); VOID(s); *n = NUMBERS; return OK; }
Status SERIALIZE(void *c, STATE s, Byte b[], size_t n) { VOID(c); memcpy(b, s, n); return OK; }
Status DESERIALIZE(void *c, const Byte b[], size_t n, STATE *s) { VOID(c); *s = malloc(n); memcpy(*s, b, n); return OK; }
