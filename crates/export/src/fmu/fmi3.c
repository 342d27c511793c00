/* The names and types of the interface, version 3.0. */
#include <stdbool.h>
#include <stdint.h>

#ifdef FMI3_FUNCTION_PREFIX
#define FMI3(name) SURROGATE_EXPORT SURROGATE_JOIN(FMI3_FUNCTION_PREFIX, name)
#else
#define FMI3(name) SURROGATE_EXPORT name
#endif

typedef void *fmi3Instance;
typedef void *fmi3InstanceEnvironment;
typedef void *fmi3FMUState;
typedef uint32_t fmi3ValueReference;
typedef double fmi3Float64;
typedef uint8_t fmi3Byte;
typedef const char *fmi3String;
typedef bool fmi3Boolean;
typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;

//! common

const char *FMI3(fmi3GetVersion)(void)
{
    return "3.0";
}

fmi3Instance FMI3(fmi3InstantiateModelExchange)(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging, fmi3InstanceEnvironment environment, void *log)
{
    (void)name;
    (void)resources;
    (void)visible;
    (void)logging;
    (void)environment;
    (void)log;
    return surrogate_new(token, 0);
}

/* Steps need no events from outside and return none. */
fmi3Instance FMI3(fmi3InstantiateCoSimulation)(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging, fmi3Boolean event_mode, fmi3Boolean early_return, const fmi3ValueReference intermediate[], size_t n, fmi3InstanceEnvironment environment, void *log, void *update)
{
    (void)name;
    (void)resources;
    (void)visible;
    (void)logging;
    (void)event_mode;
    (void)early_return;
    (void)intermediate;
    (void)n;
    (void)environment;
    (void)log;
    (void)update;
    return surrogate_new(token, 1);
}

fmi3Instance FMI3(fmi3InstantiateScheduledExecution)(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging, fmi3InstanceEnvironment environment, void *log, void *update, void *lock, void *unlock)
{
    (void)name;
    (void)token;
    (void)resources;
    (void)visible;
    (void)logging;
    (void)environment;
    (void)log;
    (void)update;
    (void)lock;
    (void)unlock;
    return NULL;
}

fmi3Status FMI3(fmi3EnterInitializationMode)(fmi3Instance c, fmi3Boolean has_tolerance, fmi3Float64 tolerance, fmi3Float64 start, fmi3Boolean has_stop, fmi3Float64 stop)
{
    (void)has_tolerance;
    (void)tolerance;
    (void)has_stop;
    (void)stop;
    surrogate_of(c)->time = start;
    surrogate_of(c)->is_between_events = 0;
    return fmi3OK;
}

fmi3Status FMI3(fmi3GetFloat64)(fmi3Instance c, const fmi3ValueReference references[], size_t n, fmi3Float64 values[], size_t n_values)
{
    int is_well = (n == n_values) ? 1 : 0;
    size_t i;
    for (i = 0U; (i < n) && (i < n_values); i++) {
        if (surrogate_real(surrogate_of(c), references[i], &values[i]) != 0) {
            is_well = 0;
        }
    }
    return surrogate_status(is_well);
}

fmi3Status FMI3(fmi3SetFloat64)(fmi3Instance c, const fmi3ValueReference references[], size_t n, const fmi3Float64 values[], size_t n_values)
{
    int is_well = (n == n_values) ? 1 : 0;
    size_t i;
    for (i = 0U; (i < n) && (i < n_values); i++) {
        if (surrogate_set_real(surrogate_of(c), references[i], values[i]) != 0) {
            is_well = 0;
        }
    }
    return surrogate_status(is_well);
}

/* Enumerations are of this type. */
fmi3Status FMI3(fmi3GetInt64)(fmi3Instance c, const fmi3ValueReference references[], size_t n, int64_t values[], size_t n_values)
{
    int is_well = (n == n_values) ? 1 : 0;
    size_t i;
    surrogate_refresh(surrogate_of(c));
    for (i = 0U; (i < n) && (i < n_values); i++) {
        if (references[i] == (fmi3ValueReference)SURROGATE_STATE_AT) {
            values[i] = surrogate_of(c)->state;
        } else {
            is_well = 0;
        }
    }
    return surrogate_status(is_well);
}

fmi3Status FMI3(fmi3GetBoolean)(fmi3Instance c, const fmi3ValueReference references[], size_t n, fmi3Boolean values[], size_t n_values)
{
    int is_well = (n == n_values) ? 1 : 0;
    size_t i;
    for (i = 0U; (i < n) && (i < n_values); i++) {
        int value = 0;
        if (surrogate_truth(surrogate_of(c), references[i], &value) != 0) {
            is_well = 0;
        }
        values[i] = (value != 0);
    }
    return surrogate_status(is_well);
}

fmi3Status FMI3(fmi3SetBoolean)(fmi3Instance c, const fmi3ValueReference references[], size_t n, const fmi3Boolean values[], size_t n_values)
{
    int is_well = (n == n_values) ? 1 : 0;
    size_t i;
    for (i = 0U; (i < n) && (i < n_values); i++) {
        if (surrogate_set_truth(surrogate_of(c), references[i], (values[i]) ? 1 : 0) != 0) {
            is_well = 0;
        }
    }
    return surrogate_status(is_well);
}

fmi3Status FMI3(fmi3GetDirectionalDerivative)(fmi3Instance c, const fmi3ValueReference unknowns[], size_t n_unknowns, const fmi3ValueReference knowns[], size_t n_knowns, const fmi3Float64 seeds[], size_t n_seeds, fmi3Float64 sensitivities[], size_t n_sensitivities)
{
    int is_well = ((n_seeds == n_knowns) && (n_sensitivities == n_unknowns)) ? 1 : 0;
    if ((is_well != 0) && (surrogate_directional(surrogate_of(c), unknowns, n_unknowns, knowns, n_knowns, seeds, sensitivities) != 0)) {
        is_well = 0;
    }
    return surrogate_status(is_well);
}

fmi3Status FMI3(fmi3EvaluateDiscreteStates)(fmi3Instance c)
{
    (void)c;
    return fmi3OK;
}

fmi3Status FMI3(fmi3UpdateDiscreteStates)(fmi3Instance c, fmi3Boolean *again, fmi3Boolean *terminate, fmi3Boolean *nominals_changed, fmi3Boolean *states_changed, fmi3Boolean *has_next, fmi3Float64 *next)
{
    surrogate_refresh(surrogate_of(c));
    *again = false;
    *terminate = false;
    *nominals_changed = false;
    *states_changed = false;
    *has_next = false;
    *next = 0.0;
    return fmi3OK;
}

fmi3Status FMI3(fmi3GetNumberOfEventIndicators)(fmi3Instance c, size_t *n)
{
    (void)c;
    *n = (size_t)SURROGATE_INDICATORS;
    return fmi3OK;
}

fmi3Status FMI3(fmi3GetNumberOfContinuousStates)(fmi3Instance c, size_t *n)
{
    (void)c;
    *n = (size_t)SURROGATE_CONTINUOUS;
    return fmi3OK;
}

/* Co-simulation. */
fmi3Status FMI3(fmi3EnterStepMode)(fmi3Instance c)
{
    surrogate_refresh(surrogate_of(c));
    return fmi3OK;
}

fmi3Status FMI3(fmi3GetOutputDerivatives)(fmi3Instance c, const fmi3ValueReference references[], size_t n, const int32_t orders[], fmi3Float64 values[], size_t n_values)
{
    (void)c;
    (void)references;
    (void)orders;
    (void)values;
    (void)n_values;
    return surrogate_status((n == 0U) ? 1 : 0);
}

fmi3Status FMI3(fmi3DoStep)(fmi3Instance c, fmi3Float64 point, fmi3Float64 step, fmi3Boolean no_set_state, fmi3Boolean *needs_event, fmi3Boolean *terminate, fmi3Boolean *returned_early, fmi3Float64 *last)
{
    int is_well = ((((surrogate_instance *)c)->is_co_simulation != 0) && (surrogate_of(c)->is_terminated == 0) && (step >= 0.0)) ? 1 : 0;
    (void)no_set_state;
    *needs_event = false;
    *terminate = false;
    *returned_early = false;
    if (is_well != 0) {
        surrogate_of(c)->time = point + step;
//? moving
        if (surrogate_advance(surrogate_of(c), step) != 0) {
            is_well = 0;
        }
//? end
        surrogate_refresh(surrogate_of(c));
    }
    *last = surrogate_of(c)->time;
    return surrogate_status(is_well);
}
