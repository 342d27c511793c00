/*
//! head
 *
 * Written by coldplate. What the interface asks for, on top of the surrogate's own source. No instance shares memory with
 * another.
 */
//! include

#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

//! counts
/* Zero crossings: each variable less its low end, its high end less the variable, and the probability less both bounds. */
#define SURROGATE_INDICATORS ((2 * SURROGATE_VARIABLES) + 2)
/* Places for one entry per limit; C knows no array without an entry. */
#define SURROGATE_PLACES ((SURROGATE_LIMITS > 0) ? SURROGATE_LIMITS : 1)

/* Value references, in this order: variables, confidence, values, bands, margins, probabilities, probability, inside, state,
 * time, indicators; of what moves also, behind the state: the points now, whether it begins at rest, the temperature that it
 * begins with otherwise, the states and their derivatives. */
#define SURROGATE_CONFIDENCE_AT SURROGATE_VARIABLES
#define SURROGATE_VALUES_AT (SURROGATE_VARIABLES + 1)
#define SURROGATE_BANDS_AT (SURROGATE_VALUES_AT + SURROGATE_POINTS)
#define SURROGATE_MARGINS_AT (SURROGATE_BANDS_AT + SURROGATE_POINTS)
#define SURROGATE_PROBABILITIES_AT (SURROGATE_MARGINS_AT + SURROGATE_LIMITS)
#define SURROGATE_PROBABILITY_AT (SURROGATE_PROBABILITIES_AT + SURROGATE_LIMITS)
#define SURROGATE_INSIDE_AT (SURROGATE_PROBABILITY_AT + 1)
#define SURROGATE_STATE_AT (SURROGATE_INSIDE_AT + 1)
//? moving
#define SURROGATE_NOW_AT (SURROGATE_STATE_AT + 1)
#define SURROGATE_AT_REST_AT (SURROGATE_NOW_AT + SURROGATE_POINTS)
#define SURROGATE_INITIAL_AT (SURROGATE_AT_REST_AT + 1)
#define SURROGATE_STATES_AT (SURROGATE_INITIAL_AT + 1)
#define SURROGATE_SLOPES_AT (SURROGATE_STATES_AT + SURROGATE_TIME_STATES)
#define SURROGATE_TIME_AT (SURROGATE_SLOPES_AT + SURROGATE_TIME_STATES)
#define SURROGATE_CONTINUOUS SURROGATE_TIME_STATES
//? else
#define SURROGATE_TIME_AT (SURROGATE_STATE_AT + 1)
#define SURROGATE_CONTINUOUS 0
//? end
#define SURROGATE_INDICATORS_AT (SURROGATE_TIME_AT + 1)

//! tables

/* Everything that an instance remembers; a state of the unit is a copy of it. */
typedef struct {
    double x[SURROGATE_VARIABLES];
    double confidence;
    double time;
    /* Answers at x, where is_fresh says so. */
    double values[SURROGATE_POINTS];
    surrogate_band bands[SURROGATE_POINTS];
    double margins[SURROGATE_PLACES];
    double probabilities[SURROGATE_PLACES];
    surrogate_chance chance;
    /* What was said at the last event: between events discrete outputs stand still. */
    int inside;
    int state;
    int is_fresh;
//? moving
    /* What the points read now, and the state in which they do. */
    double now[SURROGATE_POINTS];
    surrogate_state moving;
    /* How it begins, and whether it has. */
    double initial;
    int at_rest;
    int is_begun;
//? end
    /* 1 in the mode in which time is continuous. */
    int is_between_events;
    int is_terminated;
} surrogate_memory;

typedef struct {
    surrogate_memory memory;
    int is_co_simulation;
} surrogate_instance;

static void surrogate_start(surrogate_memory *memory)
{
    (void)memset(memory, 0, sizeof(*memory));
    (void)memcpy(memory->x, surrogate_starts, sizeof(memory->x));
    memory->confidence = 0.95;
//? moving
    memory->initial = 20.0;
    memory->at_rest = 1;
//? end
}

static surrogate_instance *surrogate_new(const char *token, int is_co_simulation)
{
    surrogate_instance *own = NULL;
    if ((token != NULL) && (strcmp(token, SURROGATE_TOKEN) == 0) && (surrogate_self_test() == 0)) {
        own = (surrogate_instance *)calloc(1U, sizeof(*own));
    }
    if (own != NULL) {
        surrogate_start(&own->memory);
        own->is_co_simulation = is_co_simulation;
    }
    return own;
}

static void surrogate_answer_at(const double *x, double confidence, surrogate_memory *memory)
{
    int limit;
    surrogate_assess(x, confidence, memory->values, memory->bands, &memory->chance);
    for (limit = 0; limit < SURROGATE_LIMITS; limit++) {
        surrogate_limit_chance own;
        (void)surrogate_limit_probability(limit, x, memory->values, &own);
        memory->margins[limit] = own.maximum - own.value;
        memory->probabilities[limit] = own.probability;
    }
//? !limits
    memory->chance.probability = 0.0;
//? end
}

static void surrogate_refresh(surrogate_memory *memory)
{
    if (memory->is_fresh == 0) {
        surrogate_answer_at(memory->x, memory->confidence, memory);
//? moving
        if (memory->is_begun == 0) {
            if (memory->at_rest != 0) {
                (void)surrogate_at_rest(memory->x, &memory->moving);
            } else {
                (void)surrogate_at_temperature(memory->initial, &memory->moving);
            }
        }
        (void)surrogate_read(&memory->moving, memory->x, memory->now);
//? end
        memory->is_fresh = 1;
    }
    if (memory->is_between_events == 0) {
        memory->inside = memory->chance.in_domain;
        memory->state = memory->chance.state;
    }
}

/* The end of the initialization: from here on the state is its own. */
static void surrogate_begin(surrogate_memory *memory)
{
    surrogate_refresh(memory);
//? moving
    memory->is_begun = 1;
//? end
}

//? moving
/* Moves by a step of the co-simulation. Returns 0, or -1 where a number is not finite. */
static int surrogate_advance(surrogate_memory *memory, double step)
{
    surrogate_begin(memory);
    memory->is_fresh = 0;
    return surrogate_step(&memory->moving, step, memory->x);
}

static void surrogate_set_states(surrogate_memory *memory, const double *states)
{
    (void)memcpy(memory->moving.states, states, sizeof(memory->moving.states));
    memory->is_begun = 1;
    memory->is_fresh = 0;
}

/* The derivatives of the states. */
static int surrogate_slopes_now(surrogate_memory *memory, double *slopes)
{
    surrogate_refresh(memory);
    return surrogate_slopes(&memory->moving, memory->x, slopes);
}
//? end

static void surrogate_indicators(surrogate_memory *memory, double *z)
{
    int v;
    surrogate_refresh(memory);
    for (v = 0; v < SURROGATE_VARIABLES; v++) {
        z[2 * v] = memory->x[v] - surrogate_range_low[v];
        z[(2 * v) + 1] = surrogate_range_high[v] - memory->x[v];
    }
    z[2 * SURROGATE_VARIABLES] = memory->chance.probability - memory->confidence;
    z[(2 * SURROGATE_VARIABLES) + 1] = memory->chance.probability - (1.0 - memory->confidence);
}

/* A real variable. Returns 0, or -1 if there is none of that reference. */
static int surrogate_real(surrogate_memory *memory, unsigned int reference, double *value)
{
    const int at = (reference < 100000U) ? (int)reference : 100000;
    int status = 0;
    surrogate_refresh(memory);
    if (at < SURROGATE_CONFIDENCE_AT) {
        *value = memory->x[at];
    } else if (at == SURROGATE_CONFIDENCE_AT) {
        *value = memory->confidence;
    } else if (at < SURROGATE_BANDS_AT) {
        *value = memory->values[at - SURROGATE_VALUES_AT];
    } else if (at < SURROGATE_MARGINS_AT) {
        *value = 1.959963984540054 * memory->bands[at - SURROGATE_BANDS_AT].total;
    } else if (at < SURROGATE_PROBABILITIES_AT) {
        *value = memory->margins[at - SURROGATE_MARGINS_AT];
    } else if (at < SURROGATE_PROBABILITY_AT) {
        *value = memory->probabilities[at - SURROGATE_PROBABILITIES_AT];
    } else if (at == SURROGATE_PROBABILITY_AT) {
        *value = memory->chance.probability;
//? moving
    } else if ((at >= SURROGATE_NOW_AT) && (at < SURROGATE_AT_REST_AT)) {
        *value = memory->now[at - SURROGATE_NOW_AT];
    } else if (at == SURROGATE_INITIAL_AT) {
        *value = memory->initial;
    } else if ((at >= SURROGATE_STATES_AT) && (at < SURROGATE_SLOPES_AT)) {
        *value = memory->moving.states[at - SURROGATE_STATES_AT];
    } else if ((at >= SURROGATE_SLOPES_AT) && (at < SURROGATE_TIME_AT)) {
        double slopes[SURROGATE_TIME_STATES];
        status = surrogate_slopes_now(memory, slopes);
        *value = slopes[at - SURROGATE_SLOPES_AT];
//? end
    } else if (at == SURROGATE_TIME_AT) {
        *value = memory->time;
    } else if ((at >= SURROGATE_INDICATORS_AT) && (at < (SURROGATE_INDICATORS_AT + SURROGATE_INDICATORS))) {
        double z[SURROGATE_INDICATORS];
        surrogate_indicators(memory, z);
        *value = z[at - SURROGATE_INDICATORS_AT];
    } else {
        status = -1;
    }
    return status;
}

/* Variables and the confidence can be set, and the temperature that what moves begins with. */
static int surrogate_set_real(surrogate_memory *memory, unsigned int reference, double value)
{
    int status = 0;
    if (reference < (unsigned int)SURROGATE_VARIABLES) {
        memory->x[reference] = value;
    } else if (reference == (unsigned int)SURROGATE_CONFIDENCE_AT) {
        memory->confidence = value;
//? moving
    } else if (reference == (unsigned int)SURROGATE_INITIAL_AT) {
        memory->initial = value;
//? end
    } else {
        status = -1;
    }
    memory->is_fresh = 0;
    return status;
}

/* Truth values that can be asked for: whether the condition lies inside, and whether what moves begins at rest. */
static int surrogate_truth(surrogate_memory *memory, unsigned int reference, int *value)
{
    int status = -1;
    surrogate_refresh(memory);
    if (reference == (unsigned int)SURROGATE_INSIDE_AT) {
        *value = memory->inside;
        status = 0;
    }
//? moving
    if (reference == (unsigned int)SURROGATE_AT_REST_AT) {
        *value = memory->at_rest;
        status = 0;
    }
//? end
    return status;
}

static int surrogate_set_truth(surrogate_memory *memory, unsigned int reference, int value)
{
    int status = -1;
//? moving
    if (reference == (unsigned int)SURROGATE_AT_REST_AT) {
        memory->at_rest = (value != 0) ? 1 : 0;
        memory->is_fresh = 0;
        status = 0;
    }
//? else
    (void)memory;
    (void)reference;
    (void)value;
//? end
    return status;
}

/* Whether something changes with an input or a state in a way that is known by a difference alone. */
static int surrogate_is_differenced(int of)
{
    int is = ((of >= SURROGATE_BANDS_AT) && (of <= SURROGATE_PROBABILITY_AT)) ? 1 : 0;
//? moving
    if (((of >= SURROGATE_NOW_AT) && (of < SURROGATE_AT_REST_AT)) || ((of >= SURROGATE_SLOPES_AT) && (of < SURROGATE_TIME_AT))) {
        is = 1;
    }
//? end
    return is;
}

/* The step of a difference along an input or a state; zero where it is neither. */
static double surrogate_difference(int along)
{
    double step = 0.0;
    if ((along >= 0) && (along < SURROGATE_VARIABLES)) {
        const double range = surrogate_range_high[along] - surrogate_range_low[along];
        step = 1e-5 * ((range > 0.0) ? range : 1.0);
    }
//? moving
    if ((along >= SURROGATE_STATES_AT) && (along < SURROGATE_SLOPES_AT)) {
        step = 1e-3;
    }
//? end
    return step;
}

static int surrogate_real_near(const surrogate_memory *memory, int of, int along, double by, double *value)
{
    surrogate_memory near = *memory;
    near.is_fresh = 0;
    if (along < SURROGATE_VARIABLES) {
        near.x[along] = near.x[along] + by;
    }
//? moving
    if (along >= SURROGATE_STATES_AT) {
        near.moving.states[along - SURROGATE_STATES_AT] = near.moving.states[along - SURROGATE_STATES_AT] + by;
        near.is_begun = 1;
    }
//? end
    return surrogate_real(&near, (unsigned int)of, value);
}

/* The derivative of an output along an input or a state: of values in closed form, of everything else by a central
 * difference. */
static int surrogate_derivative(surrogate_memory *memory, int of, int along, double *slope)
{
    double gradient[SURROGATE_VARIABLES];
    int status = -1;
    surrogate_refresh(memory);
    if ((along >= 0) && (along < SURROGATE_VARIABLES) && (of >= SURROGATE_VALUES_AT) && (of < SURROGATE_BANDS_AT)) {
        status = surrogate_gradient(memory->x, of - SURROGATE_VALUES_AT, gradient);
        *slope = gradient[along];
    } else if ((surrogate_is_differenced(of) != 0) && (surrogate_difference(along) > 0.0)) {
        const double step = surrogate_difference(along);
        double above = 0.0;
        double below = 0.0;
        status = surrogate_real_near(memory, of, along, step, &above);
        status = (surrogate_real_near(memory, of, along, -step, &below) == 0) ? status : -1;
        *slope = (above - below) / (2.0 * step);
//? moving
    } else if ((of >= SURROGATE_VALUES_AT) && (of < SURROGATE_BANDS_AT) && (surrogate_difference(along) > 0.0)) {
        *slope = 0.0;
        status = 0;
//? end
    } else {
        *slope = 0.0;
    }
    return status;
}

/* Sums of derivatives times a seed per variable. */
static int surrogate_directional(surrogate_memory *memory, const unsigned int *of, size_t ofs, const unsigned int *along, size_t alongs, const double *seeds, double *sums)
{
    size_t i;
    size_t j;
    int status = 0;
    for (i = 0U; i < ofs; i++) {
        sums[i] = 0.0;
        for (j = 0U; j < alongs; j++) {
            double slope = 0.0;
            if (surrogate_derivative(memory, (int)of[i], (int)along[j], &slope) != 0) {
                status = -1;
            }
            sums[i] = sums[i] + (slope * seeds[j]);
        }
    }
    return status;
}

/* A copy of everything that an instance remembers, in memory of its own unless the caller has some from before. */
static int surrogate_keep(const void *memory, void **state)
{
    if (*state == NULL) {
        *state = malloc(sizeof(surrogate_memory));
    }
    if (*state != NULL) {
        (void)memcpy(*state, memory, sizeof(surrogate_memory));
    }
    return (*state != NULL) ? 0 : -1;
}

static int surrogate_restore(surrogate_memory *memory, const void *state)
{
    if (state != NULL) {
        (void)memcpy(memory, state, sizeof(*memory));
    }
    return (state != NULL) ? 0 : -1;
}

/* The bytes of such a copy. */
static int surrogate_pack(const void *state, void *bytes, size_t size)
{
    const int fits = ((state != NULL) && (size >= sizeof(surrogate_memory))) ? 1 : 0;
    if (fits != 0) {
        (void)memcpy(bytes, state, sizeof(surrogate_memory));
    }
    return (fits != 0) ? 0 : -1;
}

static int surrogate_unpack(const void *bytes, size_t size, void **state)
{
    return (size == sizeof(surrogate_memory)) ? surrogate_keep(bytes, state) : -1;
}

/* The interface is seen from outside, whatever is said of everything else. */
#if defined(_WIN32)
#define SURROGATE_EXPORT __declspec(dllexport)
#else
#define SURROGATE_EXPORT
#endif
#if defined(__GNUC__)
#pragma GCC visibility push(default)
#endif
#define SURROGATE_PASTE(a, b) a##b
#define SURROGATE_JOIN(a, b) SURROGATE_PASTE(a, b)

//! interface
