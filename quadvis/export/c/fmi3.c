/* The functions of FMI 3.0 for co-simulation. An instance is used by one thread at a time. */
#include <stdlib.h>
#include <string.h>
#include "fmi3Functions.h"
#include "model.h"

typedef struct {
    Model model;
    fmi3LogMessageCallback log;
    fmi3InstanceEnvironment environment;
} Instance;

static void say(void *caller, const char *text) {
    const Instance *i = caller;
    if (i->log) i->log(i->environment, fmi3Error, "logStatusError", text);
}

#define UNUSED(x) (void)(x)
#define STATUS(failed) ((failed) ? fmi3Error : fmi3OK)
#define TIME VARIABLES /* the value reference of the time */

const char *fmi3GetVersion(void) { return fmi3Version; }

fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n, const fmi3String categories[]) {
    UNUSED(c); UNUSED(on); UNUSED(n); UNUSED(categories);
    return fmi3OK;
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources,
    fmi3Boolean visible, fmi3Boolean logging, fmi3Boolean events, fmi3Boolean early,
    const fmi3ValueReference between[], size_t n, fmi3InstanceEnvironment environment,
    fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update) {
    UNUSED(name); UNUSED(resources); UNUSED(visible); UNUSED(logging); UNUSED(early);
    UNUSED(between); UNUSED(n); UNUSED(update);
    if (!token || strcmp(token, TOKEN) != 0 || events) return NULL;
    Instance *i = calloc(1, sizeof *i);
    if (!i) return NULL;
    i->log = log;
    i->environment = environment;
    i->model.say = say;
    i->model.caller = i;
    model_make(&i->model);
    return i;
}

void fmi3FreeInstance(fmi3Instance c) { free(c); }

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean defined, fmi3Float64 tolerance, fmi3Float64 start,
                                       fmi3Boolean stops, fmi3Float64 stop) {
    State *s = &((Instance *)c)->model.state;
    UNUSED(defined); UNUSED(tolerance); UNUSED(stops); UNUSED(stop);
    s->begin = s->now = start;
    return fmi3OK;
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance c) {
    Model *m = &((Instance *)c)->model;
    return STATUS(!m->state.started && model_begin(m));
}
fmi3Status fmi3Terminate(fmi3Instance c) { UNUSED(c); return fmi3OK; }
fmi3Status fmi3Reset(fmi3Instance c) { model_make(&((Instance *)c)->model); return fmi3OK; }

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 time, fmi3Float64 step, fmi3Boolean no_way_back, fmi3Boolean *event,
                      fmi3Boolean *ended, fmi3Boolean *early, fmi3Float64 *reached) {
    Instance *i = c;
    UNUSED(no_way_back);
    *event = *ended = *early = fmi3False;
    if (model_advance(&i->model, time + step)) return fmi3Error;
    *reached = time + step;
    return fmi3OK;
}

/* Getting outputs computes them, if inputs were set since. */
static int readable(Model *m, const fmi3ValueReference v[], size_t n) {
    for (size_t k = 0; k < n; k++) {
        if (v[k] > TIME) return 0;
        if (v[k] < VARIABLES && model_variables[v[k]].role == 'o') return model_read(m) == 0;
    }
    return 1;
}

#define ACCESS(Name, type, letter, real, whole, from) \
    fmi3Status fmi3Get##Name(fmi3Instance c, const fmi3ValueReference v[], size_t n, type values[], size_t size) { \
        Instance *i = c; double d = 0.0; int64_t q = 0; size_t place = 0; \
        if (!readable(&i->model, v, n)) return fmi3Error; \
        for (size_t k = 0; k < n; k++) { \
            const int32_t count = v[k] == TIME ? 1 : model_variables[v[k]].count; \
            for (int32_t e = 0; e < count; e++, place++) { \
                if (place >= size) return fmi3Error; \
                if (v[k] == TIME && letter == 'd') d = i->model.state.now; \
                else if (v[k] == TIME || model_get(&i->model, (int32_t)v[k], e, letter, &d, &q)) return fmi3Error; \
                values[place] = (type)from; } } \
        return STATUS(place != size); } \
    fmi3Status fmi3Set##Name(fmi3Instance c, const fmi3ValueReference v[], size_t n, const type values[], size_t size) { \
        Instance *i = c; size_t place = 0; \
        for (size_t k = 0; k < n; k++) { \
            if (v[k] >= VARIABLES) return fmi3Error; \
            for (int32_t e = 0; e < model_variables[v[k]].count; e++, place++) \
                if (place >= size || model_set(&i->model, (int32_t)v[k], e, letter, real, whole)) return fmi3Error; } \
        return STATUS(place != size); }
ACCESS(Float64, fmi3Float64, 'd', values[place], 0, d)
ACCESS(Int64, fmi3Int64, 'q', 0.0, values[place], q)
ACCESS(Boolean, fmi3Boolean, 'b', 0.0, values[place], q)

/* The whole state is a copy of one structure. */
fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state) {
    if (!*state) *state = malloc(sizeof(State));
    if (!*state) return fmi3Error;
    memcpy(*state, &((Instance *)c)->model.state, sizeof(State));
    return fmi3OK;
}
fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state) {
    memcpy(&((Instance *)c)->model.state, state, sizeof(State));
    return fmi3OK;
}
fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state) {
    UNUSED(c);
    free(*state);
    *state = NULL;
    return fmi3OK;
}
fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState state, size_t *size) {
    UNUSED(c); UNUSED(state);
    *size = sizeof(State);
    return fmi3OK;
}
fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState state, fmi3Byte data[], size_t size) {
    UNUSED(c);
    if (size != sizeof(State)) return fmi3Error;
    memcpy(data, state, size);
    return fmi3OK;
}
fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte data[], size_t size, fmi3FMUState *state) {
    UNUSED(c);
    if (size != sizeof(State)) return fmi3Error;
    if (!*state) *state = malloc(size);
    if (!*state) return fmi3Error;
    memcpy(*state, data, size);
    return fmi3OK;
}

/* What the description does not offer; importers look for the functions all the same. */
fmi3Instance fmi3InstantiateModelExchange(fmi3String instanceName, fmi3String instantiationToken,
    fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
    fmi3InstanceEnvironment instanceEnvironment, fmi3LogMessageCallback logMessage) {
    UNUSED(instanceName); UNUSED(instantiationToken); UNUSED(resourcePath); UNUSED(visible);
    UNUSED(loggingOn); UNUSED(instanceEnvironment); UNUSED(logMessage);
    return NULL;
}
fmi3Instance fmi3InstantiateScheduledExecution(fmi3String instanceName, fmi3String instantiationToken,
    fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
    fmi3InstanceEnvironment instanceEnvironment, fmi3LogMessageCallback logMessage,
    fmi3ClockUpdateCallback clockUpdate, fmi3LockPreemptionCallback lockPreemption,
    fmi3UnlockPreemptionCallback unlockPreemption) {
    UNUSED(instanceName); UNUSED(instantiationToken); UNUSED(resourcePath); UNUSED(visible);
    UNUSED(loggingOn); UNUSED(instanceEnvironment); UNUSED(logMessage); UNUSED(clockUpdate);
    UNUSED(lockPreemption); UNUSED(unlockPreemption);
    return NULL;
}
fmi3Status fmi3EnterEventMode(fmi3Instance instance) {
    UNUSED(instance);
    return fmi3Error;
}
fmi3Status fmi3GetFloat32(fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, fmi3Float32 values[], size_t nValues) {
    UNUSED(instance); UNUSED(valueReferences); UNUSED(nValueReferences); UNUSED(values); UNUSED(nValues);
    return fmi3Error;
}
fmi3Status fmi3GetInt8(fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, fmi3Int8 values[], size_t nValues) {
    UNUSED(instance); UNUSED(valueReferences); UNUSED(nValueReferences); UNUSED(values); UNUSED(nValues);
    return fmi3Error;
}
fmi3Status fmi3GetUInt8(fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, fmi3UInt8 values[], size_t nValues) {
    UNUSED(instance); UNUSED(valueReferences); UNUSED(nValueReferences); UNUSED(values); UNUSED(nValues);
    return fmi3Error;
}
fmi3Status fmi3GetInt16(fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, fmi3Int16 values[], size_t nValues) {
    UNUSED(instance); UNUSED(valueReferences); UNUSED(nValueReferences); UNUSED(values); UNUSED(nValues);
    return fmi3Error;
}
fmi3Status fmi3GetUInt16(fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, fmi3UInt16 values[], size_t nValues) {
    UNUSED(instance); UNUSED(valueReferences); UNUSED(nValueReferences); UNUSED(values); UNUSED(nValues);
    return fmi3Error;
}
fmi3Status fmi3GetInt32(fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, fmi3Int32 values[], size_t nValues) {
    UNUSED(instance); UNUSED(valueReferences); UNUSED(nValueReferences); UNUSED(values); UNUSED(nValues);
    return fmi3Error;
}
fmi3Status fmi3GetUInt32(fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, fmi3UInt32 values[], size_t nValues) {
    UNUSED(instance); UNUSED(valueReferences); UNUSED(nValueReferences); UNUSED(values); UNUSED(nValues);
    return fmi3Error;
}
fmi3Status fmi3GetUInt64(fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, fmi3UInt64 values[], size_t nValues) {
    UNUSED(instance); UNUSED(valueReferences); UNUSED(nValueReferences); UNUSED(values); UNUSED(nValues);
    return fmi3Error;
}
fmi3Status fmi3GetString(fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, fmi3String values[], size_t nValues) {
    UNUSED(instance); UNUSED(valueReferences); UNUSED(nValueReferences); UNUSED(values); UNUSED(nValues);
    return fmi3Error;
}
fmi3Status fmi3GetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, size_t valueSizes[], fmi3Binary values[], size_t nValues) {
    UNUSED(instance); UNUSED(valueReferences); UNUSED(nValueReferences); UNUSED(valueSizes); UNUSED(values);
    UNUSED(nValues);
    return fmi3Error;
}
fmi3Status fmi3GetClock(fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, fmi3Clock values[]) {
    UNUSED(instance); UNUSED(valueReferences); UNUSED(nValueReferences); UNUSED(values);
    return fmi3Error;
}
fmi3Status fmi3SetFloat32(fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, const fmi3Float32 values[], size_t nValues) {
    UNUSED(instance); UNUSED(valueReferences); UNUSED(nValueReferences); UNUSED(values); UNUSED(nValues);
    return fmi3Error;
}
fmi3Status fmi3SetInt8(fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, const fmi3Int8 values[], size_t nValues) {
    UNUSED(instance); UNUSED(valueReferences); UNUSED(nValueReferences); UNUSED(values); UNUSED(nValues);
    return fmi3Error;
}
fmi3Status fmi3SetUInt8(fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, const fmi3UInt8 values[], size_t nValues) {
    UNUSED(instance); UNUSED(valueReferences); UNUSED(nValueReferences); UNUSED(values); UNUSED(nValues);
    return fmi3Error;
}
fmi3Status fmi3SetInt16(fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, const fmi3Int16 values[], size_t nValues) {
    UNUSED(instance); UNUSED(valueReferences); UNUSED(nValueReferences); UNUSED(values); UNUSED(nValues);
    return fmi3Error;
}
fmi3Status fmi3SetUInt16(fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, const fmi3UInt16 values[], size_t nValues) {
    UNUSED(instance); UNUSED(valueReferences); UNUSED(nValueReferences); UNUSED(values); UNUSED(nValues);
    return fmi3Error;
}
fmi3Status fmi3SetInt32(fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, const fmi3Int32 values[], size_t nValues) {
    UNUSED(instance); UNUSED(valueReferences); UNUSED(nValueReferences); UNUSED(values); UNUSED(nValues);
    return fmi3Error;
}
fmi3Status fmi3SetUInt32(fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, const fmi3UInt32 values[], size_t nValues) {
    UNUSED(instance); UNUSED(valueReferences); UNUSED(nValueReferences); UNUSED(values); UNUSED(nValues);
    return fmi3Error;
}
fmi3Status fmi3SetUInt64(fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, const fmi3UInt64 values[], size_t nValues) {
    UNUSED(instance); UNUSED(valueReferences); UNUSED(nValueReferences); UNUSED(values); UNUSED(nValues);
    return fmi3Error;
}
fmi3Status fmi3SetString(fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, const fmi3String values[], size_t nValues) {
    UNUSED(instance); UNUSED(valueReferences); UNUSED(nValueReferences); UNUSED(values); UNUSED(nValues);
    return fmi3Error;
}
fmi3Status fmi3SetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, const size_t valueSizes[], const fmi3Binary values[], size_t nValues) {
    UNUSED(instance); UNUSED(valueReferences); UNUSED(nValueReferences); UNUSED(valueSizes); UNUSED(values);
    UNUSED(nValues);
    return fmi3Error;
}
fmi3Status fmi3SetClock(fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, const fmi3Clock values[]) {
    UNUSED(instance); UNUSED(valueReferences); UNUSED(nValueReferences); UNUSED(values);
    return fmi3Error;
}
fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance instance, fmi3ValueReference valueReference,
    size_t* nDependencies) {
    UNUSED(instance); UNUSED(valueReference); UNUSED(nDependencies);
    return fmi3Error;
}
fmi3Status fmi3GetVariableDependencies(fmi3Instance instance, fmi3ValueReference dependent,
    size_t elementIndicesOfDependent[], fmi3ValueReference independents[],
    size_t elementIndicesOfIndependents[], fmi3DependencyKind dependencyKinds[], size_t nDependencies) {
    UNUSED(instance); UNUSED(dependent); UNUSED(elementIndicesOfDependent); UNUSED(independents);
    UNUSED(elementIndicesOfIndependents); UNUSED(dependencyKinds); UNUSED(nDependencies);
    return fmi3Error;
}
fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[],
    size_t nUnknowns, const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[],
    size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity) {
    UNUSED(instance); UNUSED(unknowns); UNUSED(nUnknowns); UNUSED(knowns); UNUSED(nKnowns); UNUSED(seed);
    UNUSED(nSeed); UNUSED(sensitivity); UNUSED(nSensitivity);
    return fmi3Error;
}
fmi3Status fmi3GetAdjointDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[],
    size_t nUnknowns, const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[],
    size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity) {
    UNUSED(instance); UNUSED(unknowns); UNUSED(nUnknowns); UNUSED(knowns); UNUSED(nKnowns); UNUSED(seed);
    UNUSED(nSeed); UNUSED(sensitivity); UNUSED(nSensitivity);
    return fmi3Error;
}
fmi3Status fmi3EnterConfigurationMode(fmi3Instance instance) {
    UNUSED(instance);
    return fmi3Error;
}
fmi3Status fmi3ExitConfigurationMode(fmi3Instance instance) {
    UNUSED(instance);
    return fmi3Error;
}
fmi3Status fmi3GetIntervalDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[]) {
    UNUSED(instance); UNUSED(valueReferences); UNUSED(nValueReferences); UNUSED(intervals);
    UNUSED(qualifiers);
    return fmi3Error;
}
fmi3Status fmi3GetIntervalFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, fmi3UInt64 counters[], fmi3UInt64 resolutions[],
    fmi3IntervalQualifier qualifiers[]) {
    UNUSED(instance); UNUSED(valueReferences); UNUSED(nValueReferences); UNUSED(counters);
    UNUSED(resolutions); UNUSED(qualifiers);
    return fmi3Error;
}
fmi3Status fmi3GetShiftDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, fmi3Float64 shifts[]) {
    UNUSED(instance); UNUSED(valueReferences); UNUSED(nValueReferences); UNUSED(shifts);
    return fmi3Error;
}
fmi3Status fmi3GetShiftFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, fmi3UInt64 counters[], fmi3UInt64 resolutions[]) {
    UNUSED(instance); UNUSED(valueReferences); UNUSED(nValueReferences); UNUSED(counters);
    UNUSED(resolutions);
    return fmi3Error;
}
fmi3Status fmi3SetIntervalDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, const fmi3Float64 intervals[]) {
    UNUSED(instance); UNUSED(valueReferences); UNUSED(nValueReferences); UNUSED(intervals);
    return fmi3Error;
}
fmi3Status fmi3SetIntervalFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]) {
    UNUSED(instance); UNUSED(valueReferences); UNUSED(nValueReferences); UNUSED(counters);
    UNUSED(resolutions);
    return fmi3Error;
}
fmi3Status fmi3SetShiftDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, const fmi3Float64 shifts[]) {
    UNUSED(instance); UNUSED(valueReferences); UNUSED(nValueReferences); UNUSED(shifts);
    return fmi3Error;
}
fmi3Status fmi3SetShiftFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]) {
    UNUSED(instance); UNUSED(valueReferences); UNUSED(nValueReferences); UNUSED(counters);
    UNUSED(resolutions);
    return fmi3Error;
}
fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance instance) {
    UNUSED(instance);
    return fmi3Error;
}
fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean* discreteStatesNeedUpdate,
    fmi3Boolean* terminateSimulation, fmi3Boolean* nominalsOfContinuousStatesChanged,
    fmi3Boolean* valuesOfContinuousStatesChanged, fmi3Boolean* nextEventTimeDefined,
    fmi3Float64* nextEventTime) {
    UNUSED(instance); UNUSED(discreteStatesNeedUpdate); UNUSED(terminateSimulation);
    UNUSED(nominalsOfContinuousStatesChanged); UNUSED(valuesOfContinuousStatesChanged);
    UNUSED(nextEventTimeDefined); UNUSED(nextEventTime);
    return fmi3Error;
}
fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance instance) {
    UNUSED(instance);
    return fmi3Error;
}
fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance, fmi3Boolean noSetFMUStatePriorToCurrentPoint,
    fmi3Boolean* enterEventMode, fmi3Boolean* terminateSimulation) {
    UNUSED(instance); UNUSED(noSetFMUStatePriorToCurrentPoint); UNUSED(enterEventMode);
    UNUSED(terminateSimulation);
    return fmi3Error;
}
fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 time) {
    UNUSED(instance); UNUSED(time);
    return fmi3Error;
}
fmi3Status fmi3SetContinuousStates(fmi3Instance instance, const fmi3Float64 continuousStates[],
    size_t nContinuousStates) {
    UNUSED(instance); UNUSED(continuousStates); UNUSED(nContinuousStates);
    return fmi3Error;
}
fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance instance, fmi3Float64 derivatives[],
    size_t nContinuousStates) {
    UNUSED(instance); UNUSED(derivatives); UNUSED(nContinuousStates);
    return fmi3Error;
}
fmi3Status fmi3GetEventIndicators(fmi3Instance instance, fmi3Float64 eventIndicators[],
    size_t nEventIndicators) {
    UNUSED(instance); UNUSED(eventIndicators); UNUSED(nEventIndicators);
    return fmi3Error;
}
fmi3Status fmi3GetContinuousStates(fmi3Instance instance, fmi3Float64 continuousStates[],
    size_t nContinuousStates) {
    UNUSED(instance); UNUSED(continuousStates); UNUSED(nContinuousStates);
    return fmi3Error;
}
fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance instance, fmi3Float64 nominals[],
    size_t nContinuousStates) {
    UNUSED(instance); UNUSED(nominals); UNUSED(nContinuousStates);
    return fmi3Error;
}
fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance instance, size_t* nEventIndicators) {
    UNUSED(instance); UNUSED(nEventIndicators);
    return fmi3Error;
}
fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance instance, size_t* nContinuousStates) {
    UNUSED(instance); UNUSED(nContinuousStates);
    return fmi3Error;
}
fmi3Status fmi3EnterStepMode(fmi3Instance instance) {
    UNUSED(instance);
    return fmi3Error;
}
fmi3Status fmi3GetOutputDerivatives(fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, const fmi3Int32 orders[], fmi3Float64 values[], size_t nValues) {
    UNUSED(instance); UNUSED(valueReferences); UNUSED(nValueReferences); UNUSED(orders); UNUSED(values);
    UNUSED(nValues);
    return fmi3Error;
}
fmi3Status fmi3ActivateModelPartition(fmi3Instance instance, fmi3ValueReference clockReference,
    fmi3Float64 activationTime) {
    UNUSED(instance); UNUSED(clockReference); UNUSED(activationTime);
    return fmi3Error;
}
