/*
//! head
 *
 * Written by coldplate. ISO C99, also C++. No heap, no recursion, no state: every function may be called from several
 * threads. Compile without options that change the arithmetic: no -ffast-math, and -ffp-contract=off where the compiler
 * fuses multiplications and additions by itself.
 *
//? single
 * All numbers are in single precision. What that costs a value, surrogate_value_error says.
//? paired
 * Parts of the values cancel: their sums are kept in pairs of numbers. A build that changes the arithmetic is off by
 * many times that, and surrogate_self_test finds it.
//? end
 *
//? end
 * The caller lends all memory. A condition has one value per variable, in the units and in the order below.
 */
#ifndef SURROGATE_H
#define SURROGATE_H

#ifdef __cplusplus
extern "C" {
#endif

//! counts

//! names

/* States of a limit and of a verdict. */
#define SURROGATE_ACCEPTABLE 0
#define SURROGATE_UNCERTAIN 1
#define SURROGATE_NOT_ACCEPTABLE 2

/* In place of the number of a limit where there is none. */
#define SURROGATE_NO_LIMIT (-1)

/* How uncertain a value is, as standard deviations: of the fitted function and of the solver's mesh together, of the
 * machine's parameters, of what the model misses, and of all of it. 1.96 times the total is half the width of the band of 95 %. */
typedef struct {
    double fit;
    double parameters;
    double misses;
    double total;
} surrogate_band;

/* A limit at a condition: the limited quantity, the ends of its band, the largest value allowed, what is left to it
 * (negative where it is broken), and the state of this limit alone inside the fitted range. */
typedef struct {
    double value;
    double low;
    double high;
    double maximum;
    double margin;
    int state;
} surrogate_limit_value;

/* A limit at a condition with everything that is uncertain: the probability is that of its being kept. */
typedef struct {
    double value;
    surrogate_band band;
    double maximum;
    double probability;
} surrogate_limit_chance;

/* The verdict on a condition. binding is the limit that decides, or SURROGATE_NO_LIMIT. */
typedef struct {
    int state;
    int in_domain;
    int binding;
    double value;
    double margin;
} surrogate_verdict;

/* The verdict at a stated confidence. probability is that of all limits together being kept; not a number without any. */
typedef struct {
    int state;
    int in_domain;
    int binding;
    double probability;
} surrogate_chance;

/* 1 if every variable lies within its fitted range, ends included; otherwise 0. */
int surrogate_in_domain(const double x[SURROGATE_VARIABLES]);

/* The values of all points. Outside the fitted range the functions extrapolate. */
void surrogate_evaluate(const double x[SURROGATE_VARIABLES], double values[SURROGATE_POINTS]);

//? displaced
/* What a controller adds to be where it is meant to be: every displacement with the opposite sign, 0 for other points. Of a
 * machine that moves, what its state reads, with the opposite sign, is the same over time. */
void surrogate_offset(const double x[SURROGATE_VARIABLES], double offsets[SURROGATE_POINTS]);

//? end
/* The derivatives of one point's value along each variable. Returns 0, or -1 if there is no such point. */
int surrogate_gradient(const double x[SURROGATE_VARIABLES], int point, double gradient[SURROGATE_VARIABLES]);

/* The values and the bands of all points. */
void surrogate_bands(const double x[SURROGATE_VARIABLES], double values[SURROGATE_POINTS], surrogate_band bands[SURROGATE_POINTS]);

/* Values of all points, and the verdict: acceptable and not acceptable are said with a probability of 95 %; uncertain
 * outside the fitted range. */
void surrogate_query(const double x[SURROGATE_VARIABLES], double values[SURROGATE_POINTS], surrogate_verdict *verdict);

/* One limit at a condition, from the points' values there. Returns 0, or -1 if there is no such limit. */
int surrogate_limit(int limit, const double x[SURROGATE_VARIABLES], const double values[SURROGATE_POINTS], surrogate_limit_value *out);
int surrogate_limit_probability(int limit, const double x[SURROGATE_VARIABLES], const double values[SURROGATE_POINTS], surrogate_limit_chance *out);

/* Values, bands, and whether all limits together are kept with the probability confidence, between one half and one. */
void surrogate_assess(const double x[SURROGATE_VARIABLES], double confidence, double values[SURROGATE_POINTS], surrogate_band bands[SURROGATE_POINTS], surrogate_chance *chance);

//? moving
/* The state of the machine over time; it may be copied and kept. */
typedef struct {
    double states[SURROGATE_TIME_STATES];
    double length;
} surrogate_state;

/* The steady state at a condition. Returns 0, or -1 where a number is not finite; the same of the functions below, which
 * then leave the state as it was. */
int surrogate_at_rest(const double x[SURROGATE_VARIABLES], surrogate_state *state);

/* The state in which everything has one temperature, in the points' unit. */
int surrogate_at_temperature(double temperature, surrogate_state *state);

/* The most probable state at a condition given what the points read, each with this standard deviation, which is positive;
 * a reading that is not finite is none. */
int surrogate_at_readings(const double x[SURROGATE_VARIABLES], const double readings[SURROGATE_POINTS], double deviation, surrogate_state *state);

/* Moves a state by a duration in seconds, not negative, at a condition that holds all that time. */
int surrogate_step(surrogate_state *state, double duration, const double x[SURROGATE_VARIABLES]);

/* What the points read in a state at a condition. */
int surrogate_read(const surrogate_state *state, const double x[SURROGATE_VARIABLES], double values[SURROGATE_POINTS]);

/* How quickly the states move at a condition, in a second. */
int surrogate_slopes(const surrogate_state *state, const double x[SURROGATE_VARIABLES], double slopes[SURROGATE_TIME_STATES]);

/* By how much a point may be off over time, beside its band; 0 if there is no such point. */
double surrogate_time_error(int point);

//? end
//? single
/* By how much the value of a point may be off for being computed in single precision, inside the fitted range; 0 if there
 * is no such point. Twice the largest difference from double precision at some thousand conditions. */
double surrogate_value_error(int point);

/* Computes the self-test vectors of the file, and values of double precision where single precision is furthest off.
 * Returns 0 if every value is reproduced to within what it may be off, and 1e-6 times the larger of one and its size;
 * otherwise the number of the first vector that is not, counted from 1. Call it once at start. */
//? else
/* Computes the self-test vectors of the file. Returns 0 if every value is reproduced to within 1e-7 times the larger of
 * one and its size; otherwise the number of the first vector that is not, counted from 1. Call it once at start. */
//? end
int surrogate_self_test(void);

#ifdef __cplusplus
}
#endif

#endif
