/*
 * Surrogate files of coldplate, read and evaluated. Link with libcoldplate_capi.
 *
 * Every function that returns an int returns one of the codes below; coldplate_error_text says it in words. A handle is
 * never written to after it was opened: several threads may ask it at once. Opening takes memory for the handle, and a
 * batch 74 kB while it lasts; no other function takes any. The bytes of the file stay the caller's, and stay as they are until the handle is closed.
 */
#ifndef COLDPLATE_H
#define COLDPLATE_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define COLDPLATE_DONE 0
#define COLDPLATE_NULL 1
#define COLDPLATE_NOT_A_SURROGATE 2
#define COLDPLATE_VERSION 3
#define COLDPLATE_DAMAGED 4
#define COLDPLATE_MALFORMED 5
#define COLDPLATE_SELF_TEST 6
#define COLDPLATE_LENGTH 7
#define COLDPLATE_INDEX 8
#define COLDPLATE_CONFIDENCE 9
#define COLDPLATE_STEADY 10
#define COLDPLATE_NUMBER 11

/* States of a limit and of a verdict. */
#define COLDPLATE_ACCEPTABLE 0
#define COLDPLATE_UNCERTAIN 1
#define COLDPLATE_NOT_ACCEPTABLE 2

/* An opened surrogate. */
typedef struct coldplate_surrogate coldplate_surrogate;

/* A text in the file, in UTF-8: not ended by a zero, and there as long as the bytes of the file. */
typedef struct {
    const char *data;
    size_t length;
} coldplate_text;

/* Of a variable: name, unit, fitted range. Of a point: name, unit, ends of its band of 95 % about its value by the fit. */
typedef struct {
    coldplate_text name;
    coldplate_text unit;
    double low;
    double high;
} coldplate_entry;

/* Standard deviations of a value: of the fit and of the solver's mesh together, of the machine's parameters, of what the
 * model misses, of all of it. */
typedef struct {
    double fit;
    double parameters;
    double misses;
    double total;
} coldplate_band;

/* A limit at a condition: the limited quantity, the ends of its band of 95 %, the largest value allowed, what is left to
 * it, the probability that it is kept, and the state of this limit alone. */
typedef struct {
    double value;
    double low;
    double high;
    double maximum;
    double margin;
    double probability;
    int state;
} coldplate_limit_value;

/* A verdict: its state, whether the condition lies in the fitted range, the limit that decides (-1: none), and the
 * probability that all limits together are kept (not a number where there is none). */
typedef struct {
    int state;
    int in_domain;
    int binding;
    double probability;
} coldplate_verdict;

/* The state of a machine over time; it may be copied, kept and put back. */
typedef struct {
    double numbers[33];
} coldplate_state;

/* The text of a code. */
const char *coldplate_error_text(int code);

/* Opens a file that lies in memory; *out is null where that fails. */
int coldplate_open(const uint8_t *bytes, size_t length, coldplate_surrogate **out);

/* Closes a handle; a null pointer is none. */
void coldplate_close(coldplate_surrogate *surrogate);

/* How many there are; 0 for a null pointer. */
size_t coldplate_variables(const coldplate_surrogate *surrogate);
size_t coldplate_points(const coldplate_surrogate *surrogate);
size_t coldplate_limits(const coldplate_surrogate *surrogate);

int coldplate_variable(const coldplate_surrogate *surrogate, size_t index, coldplate_entry *out);
int coldplate_point(const coldplate_surrogate *surrogate, size_t index, coldplate_entry *out);
int coldplate_limit_name(const coldplate_surrogate *surrogate, size_t index, coldplate_text *out);

/* The values of all points at the condition x, one value per variable. Outside the fitted range they are extrapolated. */
int coldplate_evaluate(const coldplate_surrogate *surrogate, const double *x, size_t variables, double *values, size_t points);

/* The values of all points at many conditions, one after the other in x as in values: bit for bit those of coldplate_evaluate,
 * in a fraction of the time. */
int coldplate_evaluate_batch(const coldplate_surrogate *surrogate, const double *x, size_t variables, double *values,
                             size_t points, size_t conditions);

/* What a controller adds at the condition x to be where it is meant to be: every displacement with the opposite sign, 0 for
 * points that are none. */
int coldplate_offset(const coldplate_surrogate *surrogate, const double *x, size_t variables, double *offsets, size_t points);

/* The derivatives of a point's value along each variable, into one place per variable. */
int coldplate_gradient(const coldplate_surrogate *surrogate, const double *x, size_t variables, size_t point, double *gradient);

/* Values, bands, and whether all limits together are kept with the probability confidence, between one half and one. */
int coldplate_assess(const coldplate_surrogate *surrogate, const double *x, size_t variables, double confidence, double *values,
                     coldplate_band *bands, size_t points, coldplate_verdict *verdict);

/* One limit, from the points' values at the condition. */
int coldplate_limit(const coldplate_surrogate *surrogate, size_t index, const double *x, size_t variables, const double *values,
                    size_t points, coldplate_limit_value *out);

/* How many states the machine has over time; 0 where the file knows steady states only, which the functions below refuse. */
size_t coldplate_states(const coldplate_surrogate *surrogate);

/* The steady state at a condition; that in which everything has one temperature, in the points' unit; and the most probable
 * one given what the points read, each with this standard deviation, and not a number where a point is not measured. */
int coldplate_at_rest(const coldplate_surrogate *surrogate, const double *x, size_t variables, coldplate_state *out);
int coldplate_at_temperature(const coldplate_surrogate *surrogate, double temperature, coldplate_state *out);
int coldplate_at_readings(const coldplate_surrogate *surrogate, const double *x, size_t variables, const double *readings,
                          size_t points, double deviation, coldplate_state *out);

/* Moves a state by a duration in seconds at a condition that holds all that time. */
int coldplate_step(const coldplate_surrogate *surrogate, coldplate_state *state, double duration, const double *x,
                   size_t variables);

/* What the points read in a state at a condition. */
int coldplate_read(const coldplate_surrogate *surrogate, const coldplate_state *state, const double *x, size_t variables,
                   double *values, size_t points);

#ifdef __cplusplus
}
#endif

#endif
