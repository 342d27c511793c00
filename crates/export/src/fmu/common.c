/* The functions that both versions of the interface have, in one wording. */
static surrogate_memory *surrogate_of(fmi3Instance c)
{
    return &((surrogate_instance *)c)->memory;
}

static fmi3Status surrogate_status(int is_well)
{
    return (is_well != 0) ? fmi3OK : fmi3Error;
}

fmi3Status FMI3(fmi3SetDebugLogging)(fmi3Instance c, fmi3Boolean on, size_t n, const fmi3String categories[])
{
    (void)on;
    (void)n;
    (void)categories;
    return surrogate_status((c != NULL) ? 1 : 0);
}

void FMI3(fmi3FreeInstance)(fmi3Instance c)
{
    free(c);
}

fmi3Status FMI3(fmi3ExitInitializationMode)(fmi3Instance c)
{
    surrogate_begin(surrogate_of(c));
    return fmi3OK;
}

fmi3Status FMI3(fmi3EnterEventMode)(fmi3Instance c)
{
    surrogate_of(c)->is_between_events = 0;
    return fmi3OK;
}

fmi3Status FMI3(fmi3Terminate)(fmi3Instance c)
{
    surrogate_of(c)->is_terminated = 1;
    return fmi3OK;
}

fmi3Status FMI3(fmi3Reset)(fmi3Instance c)
{
    surrogate_start(surrogate_of(c));
    return fmi3OK;
}

fmi3Status FMI3(fmi3GetFMUState)(fmi3Instance c, fmi3FMUState *state)
{
    return surrogate_status((surrogate_keep(surrogate_of(c), state) == 0) ? 1 : 0);
}

fmi3Status FMI3(fmi3SetFMUState)(fmi3Instance c, fmi3FMUState state)
{
    return surrogate_status((surrogate_restore(surrogate_of(c), state) == 0) ? 1 : 0);
}

fmi3Status FMI3(fmi3FreeFMUState)(fmi3Instance c, fmi3FMUState *state)
{
    (void)c;
    if (state != NULL) {
        free(*state);
        *state = NULL;
    }
    return fmi3OK;
}

fmi3Status FMI3(fmi3SerializedFMUStateSize)(fmi3Instance c, fmi3FMUState state, size_t *size)
{
    (void)c;
    (void)state;
    *size = sizeof(surrogate_memory);
    return fmi3OK;
}

fmi3Status FMI3(fmi3SerializeFMUState)(fmi3Instance c, fmi3FMUState state, fmi3Byte bytes[], size_t size)
{
    (void)c;
    return surrogate_status((surrogate_pack(state, bytes, size) == 0) ? 1 : 0);
}

fmi3Status FMI3(fmi3DeserializeFMUState)(fmi3Instance c, const fmi3Byte bytes[], size_t size, fmi3FMUState *state)
{
    (void)c;
    return surrogate_status((surrogate_unpack(bytes, size, state) == 0) ? 1 : 0);
}

/* Model exchange. */
fmi3Status FMI3(fmi3EnterContinuousTimeMode)(fmi3Instance c)
{
    surrogate_refresh(surrogate_of(c));
    surrogate_of(c)->is_between_events = 1;
    return fmi3OK;
}

fmi3Status FMI3(fmi3CompletedIntegratorStep)(fmi3Instance c, fmi3Boolean no_set_state, fmi3Boolean *enter_event_mode, fmi3Boolean *terminate)
{
    (void)c;
    (void)no_set_state;
    *enter_event_mode = false;
    *terminate = false;
    return fmi3OK;
}

fmi3Status FMI3(fmi3SetTime)(fmi3Instance c, fmi3Float64 time)
{
    surrogate_of(c)->time = time;
    return fmi3OK;
}

fmi3Status FMI3(fmi3SetContinuousStates)(fmi3Instance c, const fmi3Float64 x[], size_t n)
{
//? moving
    if (n == (size_t)SURROGATE_CONTINUOUS) {
        surrogate_set_states(surrogate_of(c), x);
    }
//? else
    (void)c;
    (void)x;
//? end
    return surrogate_status((n == (size_t)SURROGATE_CONTINUOUS) ? 1 : 0);
}

fmi3Status FMI3(fmi3GetContinuousStateDerivatives)(fmi3Instance c, fmi3Float64 derivatives[], size_t n)
{
    int is_well = (n == (size_t)SURROGATE_CONTINUOUS) ? 1 : 0;
//? moving
    if ((is_well != 0) && (surrogate_slopes_now(surrogate_of(c), derivatives) != 0)) {
        is_well = 0;
    }
//? else
    (void)c;
    (void)derivatives;
//? end
    return surrogate_status(is_well);
}

fmi3Status FMI3(fmi3GetContinuousStates)(fmi3Instance c, fmi3Float64 x[], size_t n)
{
//? moving
    if (n == (size_t)SURROGATE_CONTINUOUS) {
        surrogate_refresh(surrogate_of(c));
        (void)memcpy(x, surrogate_of(c)->moving.states, sizeof(surrogate_of(c)->moving.states));
    }
//? else
    (void)c;
    (void)x;
//? end
    return surrogate_status((n == (size_t)SURROGATE_CONTINUOUS) ? 1 : 0);
}

fmi3Status FMI3(fmi3GetNominalsOfContinuousStates)(fmi3Instance c, fmi3Float64 nominals[], size_t n)
{
    size_t i;
    for (i = 0U; i < n; i++) {
        nominals[i] = 1.0;
    }
    (void)c;
    return surrogate_status((n == (size_t)SURROGATE_CONTINUOUS) ? 1 : 0);
}

fmi3Status FMI3(fmi3GetEventIndicators)(fmi3Instance c, fmi3Float64 indicators[], size_t n)
{
    if (n == (size_t)SURROGATE_INDICATORS) {
        surrogate_indicators(surrogate_of(c), indicators);
    }
    return surrogate_status((n == (size_t)SURROGATE_INDICATORS) ? 1 : 0);
}
