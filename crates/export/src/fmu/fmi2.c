/* The names and types of the interface, version 2.0. */
#ifdef FMI2_FUNCTION_PREFIX
#define FMI2(name) SURROGATE_EXPORT SURROGATE_JOIN(FMI2_FUNCTION_PREFIX, name)
#else
#define FMI2(name) SURROGATE_EXPORT name
#endif

typedef void *fmi2Component;
typedef void *fmi2ComponentEnvironment;
typedef void *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer;
typedef int fmi2Boolean;
typedef char fmi2Byte;
typedef const char *fmi2String;
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef enum { fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated } fmi2StatusKind;
typedef struct {
    fmi2Boolean newDiscreteStatesNeeded;
    fmi2Boolean terminateSimulation;
    fmi2Boolean nominalsOfContinuousStatesChanged;
    fmi2Boolean valuesOfContinuousStatesChanged;
    fmi2Boolean nextEventTimeDefined;
    fmi2Real nextEventTime;
} fmi2EventInfo;

//! common

const char *FMI2(fmi2GetTypesPlatform)(void)
{
    return "default";
}

const char *FMI2(fmi2GetVersion)(void)
{
    return "2.0";
}

fmi2Component FMI2(fmi2Instantiate)(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources, const void *functions, fmi2Boolean visible, fmi2Boolean logging)
{
    (void)name;
    (void)resources;
    (void)functions;
    (void)visible;
    (void)logging;
    return surrogate_new(guid, (type == fmi2CoSimulation) ? 1 : 0);
}

fmi2Status FMI2(fmi2SetupExperiment)(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance, fmi2Real start, fmi2Boolean has_stop, fmi2Real stop)
{
    (void)has_tolerance;
    (void)tolerance;
    (void)has_stop;
    (void)stop;
    surrogate_of(c)->time = start;
    return fmi2OK;
}

fmi2Status FMI2(fmi2EnterInitializationMode)(fmi2Component c)
{
    surrogate_of(c)->is_between_events = 0;
    return fmi2OK;
}

fmi2Status FMI2(fmi2GetReal)(fmi2Component c, const fmi2ValueReference references[], size_t n, fmi2Real values[])
{
    fmi2Status status = fmi2OK;
    size_t i;
    for (i = 0U; i < n; i++) {
        if (surrogate_real(surrogate_of(c), references[i], &values[i]) != 0) {
            status = fmi2Error;
        }
    }
    return status;
}

fmi2Status FMI2(fmi2SetReal)(fmi2Component c, const fmi2ValueReference references[], size_t n, const fmi2Real values[])
{
    fmi2Status status = fmi2OK;
    size_t i;
    for (i = 0U; i < n; i++) {
        if (surrogate_set_real(surrogate_of(c), references[i], values[i]) != 0) {
            status = fmi2Error;
        }
    }
    return status;
}

fmi2Status FMI2(fmi2GetInteger)(fmi2Component c, const fmi2ValueReference references[], size_t n, fmi2Integer values[])
{
    fmi2Status status = fmi2OK;
    size_t i;
    surrogate_refresh(surrogate_of(c));
    for (i = 0U; i < n; i++) {
        if (references[i] == (fmi2ValueReference)SURROGATE_STATE_AT) {
            values[i] = surrogate_of(c)->state;
        } else {
            status = fmi2Error;
        }
    }
    return status;
}

fmi2Status FMI2(fmi2GetBoolean)(fmi2Component c, const fmi2ValueReference references[], size_t n, fmi2Boolean values[])
{
    fmi2Status status = fmi2OK;
    size_t i;
    for (i = 0U; i < n; i++) {
        int value = 0;
        if (surrogate_truth(surrogate_of(c), references[i], &value) != 0) {
            status = fmi2Error;
        }
        values[i] = value;
    }
    return status;
}

fmi2Status FMI2(fmi2GetString)(fmi2Component c, const fmi2ValueReference references[], size_t n, fmi2String values[])
{
    (void)c;
    (void)references;
    (void)values;
    return (n == 0U) ? fmi2OK : fmi2Error;
}

/* No variable of this type can be set. */
fmi2Status FMI2(fmi2SetInteger)(fmi2Component c, const fmi2ValueReference references[], size_t n, const fmi2Integer values[])
{
    (void)c;
    (void)references;
    (void)values;
    return (n == 0U) ? fmi2OK : fmi2Error;
}

fmi2Status FMI2(fmi2SetBoolean)(fmi2Component c, const fmi2ValueReference references[], size_t n, const fmi2Boolean values[])
{
    fmi2Status status = fmi2OK;
    size_t i;
    for (i = 0U; i < n; i++) {
        if (surrogate_set_truth(surrogate_of(c), references[i], values[i]) != 0) {
            status = fmi2Error;
        }
    }
    return status;
}

fmi2Status FMI2(fmi2SetString)(fmi2Component c, const fmi2ValueReference references[], size_t n, const fmi2String values[])
{
    (void)c;
    (void)references;
    (void)values;
    return (n == 0U) ? fmi2OK : fmi2Error;
}

fmi2Status FMI2(fmi2GetDirectionalDerivative)(fmi2Component c, const fmi2ValueReference unknowns[], size_t n_unknowns, const fmi2ValueReference knowns[], size_t n_knowns, const fmi2Real seeds[], fmi2Real sensitivities[])
{
    return (surrogate_directional(surrogate_of(c), unknowns, n_unknowns, knowns, n_knowns, seeds, sensitivities) == 0) ? fmi2OK : fmi2Error;
}

fmi2Status FMI2(fmi2NewDiscreteStates)(fmi2Component c, fmi2EventInfo *info)
{
    surrogate_refresh(surrogate_of(c));
    (void)memset(info, 0, sizeof(*info));
    return fmi2OK;
}

/* Co-simulation. */
fmi2Status FMI2(fmi2SetRealInputDerivatives)(fmi2Component c, const fmi2ValueReference references[], size_t n, const fmi2Integer orders[], const fmi2Real values[])
{
    (void)c;
    (void)references;
    (void)orders;
    (void)values;
    return (n == 0U) ? fmi2OK : fmi2Error;
}

fmi2Status FMI2(fmi2GetRealOutputDerivatives)(fmi2Component c, const fmi2ValueReference references[], size_t n, const fmi2Integer orders[], fmi2Real values[])
{
    (void)c;
    (void)references;
    (void)orders;
    (void)values;
    return (n == 0U) ? fmi2OK : fmi2Error;
}

fmi2Status FMI2(fmi2DoStep)(fmi2Component c, fmi2Real point, fmi2Real step, fmi2Boolean no_set_state)
{
    int is_well = ((((surrogate_instance *)c)->is_co_simulation != 0) && (surrogate_of(c)->is_terminated == 0) && (step >= 0.0)) ? 1 : 0;
    (void)no_set_state;
    if (is_well != 0) {
        surrogate_of(c)->time = point + step;
//? moving
        if (surrogate_advance(surrogate_of(c), step) != 0) {
            is_well = 0;
        }
//? end
        surrogate_refresh(surrogate_of(c));
    }
    return (is_well != 0) ? fmi2OK : fmi2Error;
}

/* No step is ever pending. */
fmi2Status FMI2(fmi2CancelStep)(fmi2Component c)
{
    (void)c;
    return fmi2Error;
}

fmi2Status FMI2(fmi2GetStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value)
{
    (void)c;
    (void)kind;
    (void)value;
    return fmi2Discard;
}

fmi2Status FMI2(fmi2GetRealStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value)
{
    if (kind == fmi2LastSuccessfulTime) {
        *value = surrogate_of(c)->time;
    }
    return (kind == fmi2LastSuccessfulTime) ? fmi2OK : fmi2Discard;
}

fmi2Status FMI2(fmi2GetIntegerStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value)
{
    (void)c;
    (void)kind;
    (void)value;
    return fmi2Discard;
}

fmi2Status FMI2(fmi2GetBooleanStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value)
{
    if (kind == fmi2Terminated) {
        *value = 0;
    }
    (void)c;
    return (kind == fmi2Terminated) ? fmi2OK : fmi2Discard;
}

fmi2Status FMI2(fmi2GetStringStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2String *value)
{
    (void)c;
    (void)kind;
    (void)value;
    return fmi2Discard;
}
