/*
//! head
 *
 * Written by coldplate; see the header for what the functions do.
 */
//! include

#include <math.h>

#ifdef __FAST_MATH__
#error "the arithmetic is that of IEEE 754: compile without -ffast-math"
#endif
#ifdef __clang__
#pragma STDC FP_CONTRACT OFF
#endif

//? paired
/* A number in two parts, the second below the last place of the first. */
typedef struct {
    double high;
    double low;
} surrogate_pair;

//? end
//! tables

/* Numbers smaller than this are not normal. */
//? single
#define SURROGATE_TINY 1.17549435e-38
//? else
#define SURROGATE_TINY 2.2250738585072014e-308
//? end
/* Half the width of the interval that holds 95 % of a normal distribution. */
#define SURROGATE_NINETY_FIVE 1.959963984540054
//? limits uncertain
/* Probability with which a verdict is said where none is asked for. */
#define SURROGATE_CONFIDENCE 0.95
//? end
/* Terms and centres are added up in blocks of this many. */
#define SURROGATE_BLOCK 128
/* Places for the powers 0 to 12 of a scaled variable. */
#define SURROGATE_POWERS 13
//? limits
/* Limits whose dependence on each other is followed. */
#define SURROGATE_MOST_LIMITS 8
/* Correlation from which on two limits are of one quantity; probabilities that are alike; variances, shares of one and
   probabilities that are as good as none. */
//? single
#define SURROGATE_SAME 0.99999
#define SURROGATE_ALIKE 1e-6
#define SURROGATE_FLAT 1e-6
#define SURROGATE_NOTHING 1e-6
#define SURROGATE_NEVER 1e-30
//? else
#define SURROGATE_SAME 0.999999999
#define SURROGATE_ALIKE 1e-9
#define SURROGATE_FLAT 1e-14
#define SURROGATE_NOTHING 1e-12
#define SURROGATE_NEVER 1e-300
//? end
//? end

//? finite
static int surrogate_is_finite(double x)
{
    return ((x - x) == 0.0) ? 1 : 0;
}
//? end

static int surrogate_is_place(int place, int count)
{
    return ((place >= 0) && (place < count)) ? 1 : 0;
}

/* ln 2 cut to few binary places, and the rest. */
//? single
#define SURROGATE_LN2_HIGH 0.693359375
#define SURROGATE_LN2_LOW -2.1219444005469057e-4
//? else
#define SURROGATE_LN2_HIGH 0.6931471805582987
#define SURROGATE_LN2_LOW 1.6465949582897082e-12
//? end

//? ln
/* ln x for positive, normal, finite x: x = 2^k m, ln m = 2 atanh((m - 1)/(m + 1)). */
static double surrogate_ln_normal(double x)
{
    int exponent = 0;
    double m = frexp(x, &exponent);
    double k;
    double s;
    double z;
    double z2;
    double series;
    double twice;
    if (m < 0.70710678118654757) {
        m = m * 2.0;
        exponent = exponent - 1;
    }
    k = (double)exponent;
    s = (m - 1.0) / (2.0 + (m - 1.0));
    z = s * s;
    z2 = z * z;
    series = (0.3333333333333335 + (0.19999999999949444 * z))
        + (z2 * ((0.14285714313126918 + (0.11111105544689748 * z))
            + (z2 * ((0.09091446216268435 + (0.07665805861027504 * z)) + (z2 * 0.07308903576708663)))));
    twice = s + s;
    return (k * SURROGATE_LN2_HIGH) + (twice + (((twice * z) * series) + (k * SURROGATE_LN2_LOW)));
}
//? end

//? log
static double surrogate_ln(double x)
{
    double result = log(x);
    if ((x >= SURROGATE_TINY) && (surrogate_is_finite(x) != 0)) {
        result = surrogate_ln_normal(x);
    }
    return result;
}
//? end

//? exp
/* From where on exp(-x) is zero. */
//? single
#define SURROGATE_FAR 87.0
//? else
#define SURROGATE_FAR 708.0
//? end

/* exp(-x) for x >= 0. */
static double surrogate_exp_minus(double x)
{
    double result = 0.0;
    if (!(x > SURROGATE_FAR)) {
        const double k = nearbyint(-(x * 1.4426950408889634));
        const double r = (-x - (k * SURROGATE_LN2_HIGH)) - (k * SURROGATE_LN2_LOW);
        double series = 1.0 / 6227020800.0;
        series = (series * r) + (1.0 / 479001600.0);
        series = (series * r) + (1.0 / 39916800.0);
        series = (series * r) + (1.0 / 3628800.0);
        series = (series * r) + (1.0 / 362880.0);
        series = (series * r) + (1.0 / 40320.0);
        series = (series * r) + (1.0 / 5040.0);
        series = (series * r) + (1.0 / 720.0);
        series = (series * r) + (1.0 / 120.0);
        series = (series * r) + (1.0 / 24.0);
        series = (series * r) + (1.0 / 6.0);
        series = (series * r) + 0.5;
        result = x;
        if (x >= 0.0) {
            result = ldexp(1.0 + (r + ((r * r) * series)), (int)k);
        }
    }
    return result;
}

//? end
static double surrogate_greater(double a, double b)
{
    return (a > b) ? a : b;
}

//? limits
static double surrogate_lesser(double a, double b)
{
    return (a < b) ? a : b;
}
//? end

/* The scaled variables of a model. */
static void surrogate_scale(const double x[SURROGATE_VARIABLES], const unsigned char *scalings, double u[SURROGATE_VARIABLES])
{
    int v;
    for (v = 0; v < SURROGATE_VARIABLES; v++) {
        const surrogate_scaling_entry *const own = &surrogate_scalings[scalings[v]];
        double g = x[v];
//? reciprocal
        if (own->transform == 1) {
            g = 1.0 / g;
        }
//? end
//? log
        if (own->transform == 2) {
            g = surrogate_ln(g);
        }
//? end
        u[v] = ((g - own->low) * own->factor) + own->offset;
    }
}

/* The derivative of each scaled variable along its variable. */
static double surrogate_scale_slope(const double x[SURROGATE_VARIABLES], const unsigned char *scalings, int v)
{
    const surrogate_scaling_entry *const own = &surrogate_scalings[scalings[v]];
    double slope = 1.0;
//? reciprocal
    if (own->transform == 1) {
        slope = -1.0 / (x[v] * x[v]);
    }
//? end
//? log
    if (own->transform == 2) {
        slope = 1.0 / x[v];
    }
//? end
//? !reciprocal !log
    (void)x;
//? end
    return own->factor * slope;
}

static void surrogate_powers(const double u[SURROGATE_VARIABLES], double powers[SURROGATE_VARIABLES][SURROGATE_POWERS])
{
    int v;
    int e;
    for (v = 0; v < SURROGATE_VARIABLES; v++) {
        powers[v][0] = 1.0;
        for (e = 1; e < SURROGATE_POWERS; e++) {
            powers[v][e] = powers[v][e - 1] * u[v];
        }
    }
}

/* One monomial: the variables enter in pairs. */
static double surrogate_monomial(double powers[SURROGATE_VARIABLES][SURROGATE_POWERS], const unsigned char *exponents)
{
    double product = 1.0;
    int v;
    for (v = 0; v < SURROGATE_VARIABLES; v = v + 2) {
        double pair = powers[v][exponents[v]];
        if ((v + 1) < SURROGATE_VARIABLES) {
            pair = pair * powers[v + 1][exponents[v + 1]];
        }
        product = product * pair;
    }
    return product;
}

/* Adds the sums of the columns of a table, each row times its factor, to the values of the points. */
static void surrogate_add_columns(const double *factors, int rows, const double *table, const unsigned short *points, int columns, double values[SURROGATE_POINTS])
{
    int c;
    int i;
    for (c = 0; c < columns; c++) {
        double sum = 0.0;
        for (i = 0; i < rows; i++) {
            sum = sum + (factors[i] * table[(i * columns) + c]);
        }
        values[points[c]] = values[points[c]] + sum;
    }
}

/* Derivatives of a polynomial along the scaled variables, for the coefficients of one column. */
static void surrogate_polynomial_slopes(const double u[SURROGATE_VARIABLES], const unsigned char *exponents, int terms, const double *coefficients, int columns, double slopes[SURROGATE_VARIABLES])
{
    double powers[SURROGATE_VARIABLES][SURROGATE_POWERS];
    int t;
    int by;
    int v;
    surrogate_powers(u, powers);
    for (t = 0; t < terms; t++) {
        const unsigned char *const own = &exponents[t * SURROGATE_VARIABLES];
        for (by = 0; by < SURROGATE_VARIABLES; by++) {
            if (own[by] > 0U) {
                double product = coefficients[t * columns] * (double)own[by];
                for (v = 0; v < SURROGATE_VARIABLES; v++) {
                    product = product * powers[v][(v == by) ? ((int)own[v] - 1) : (int)own[v]];
                }
                slopes[by] = slopes[by] + product;
            }
        }
    }
}

//? paired
//! pairs
//? end
//? bases !paired
/* Squared distances become kernel values. */
static double surrogate_kernel(int kernel, double square)
{
    double value = 0.0;
//? thin_plate
    if (kernel == 0) {
        const double normal = (square < SURROGATE_TINY) ? SURROGATE_TINY : square;
        value = (0.5 * square) * ((surrogate_is_finite(normal) != 0) ? surrogate_ln_normal(normal) : normal);
    }
//? end
//? cubic
    if (kernel == 1) {
        value = square * sqrt(square);
    }
//? end
//? multiquadric
    if (kernel == 2) {
        value = sqrt(1.0 + square);
    }
//? end
//? gaussian
    if (kernel == 3) {
        value = surrogate_exp_minus(square);
    }
//? end
    return value;
}

/* Derivative of the kernel along the squared distance; zero at a centre. */
static double surrogate_kernel_slope(int kernel, double square)
{
    double value = 0.0;
//? thin_plate
    if ((kernel == 0) && (square >= SURROGATE_TINY)) {
        value = 0.5 * (surrogate_ln_normal(square) + 1.0);
    }
//? end
//? cubic
    if (kernel == 1) {
        value = 1.5 * sqrt(square);
    }
//? end
//? multiquadric
    if (kernel == 2) {
        value = 0.5 / sqrt(1.0 + square);
    }
//? end
//? gaussian
    if (kernel == 3) {
        value = -surrogate_exp_minus(square);
    }
//? end
    return value;
}

static double surrogate_squared_distance(const surrogate_basis_entry *basis, const double u[SURROGATE_VARIABLES], int centre)
{
    double square = 0.0;
    int v;
    for (v = 0; v < SURROGATE_VARIABLES; v++) {
        const double d = (u[v] - basis->centres[(centre * SURROGATE_VARIABLES) + v]) * basis->scales[v];
        square = square + (d * d);
    }
    return square;
}
//? end

/* The fitted functions alone. */
static void surrogate_evaluate_fit(const double x[SURROGATE_VARIABLES], double values[SURROGATE_POINTS])
{
    double u[SURROGATE_VARIABLES];
    double powers[SURROGATE_VARIABLES][SURROGATE_POWERS];
    double block[SURROGATE_BLOCK];
    int model;
    int done;
    int i;
    for (i = 0; i < SURROGATE_POINTS; i++) {
        values[i] = 0.0;
    }
    for (model = 0; model < SURROGATE_POLYNOMIALS; model++) {
        const surrogate_polynomial_entry *const own = &surrogate_polynomials[model];
        surrogate_scale(x, own->scalings, u);
        surrogate_powers(u, powers);
        for (done = 0; done < own->terms; done = done + SURROGATE_BLOCK) {
            const int rest = own->terms - done;
            const int rows = (rest < SURROGATE_BLOCK) ? rest : SURROGATE_BLOCK;
            for (i = 0; i < rows; i++) {
                block[i] = surrogate_monomial(powers, &own->exponents[(done + i) * SURROGATE_VARIABLES]);
            }
            surrogate_add_columns(block, rows, &own->coefficients[done * own->columns], own->points, own->columns, values);
        }
    }
//? paired
    surrogate_add_bases(x, values);
//? end
//? bases !paired
    for (model = 0; model < SURROGATE_BASES; model++) {
        const surrogate_basis_entry *const own = &surrogate_bases[model];
        surrogate_scale(x, own->scalings, u);
        for (done = 0; done < own->count; done = done + SURROGATE_BLOCK) {
            const int rest = own->count - done;
            const int rows = (rest < SURROGATE_BLOCK) ? rest : SURROGATE_BLOCK;
            for (i = 0; i < rows; i++) {
                block[i] = surrogate_kernel(own->kernel, surrogate_squared_distance(own, u, done + i));
            }
            surrogate_add_columns(block, rows, &own->weights[done * own->columns], own->points, own->columns, values);
        }
    }
//? end
}

//? uncertain
/* Square root of a variance that rounding may have made negative. */
static double surrogate_root(double variance)
{
    return (variance <= 0.0) ? 0.0 : sqrt(variance);
}
//? end

//? widths
static double surrogate_fit_variance(int point)
{
    const double fit = surrogate_half_widths[point] / SURROGATE_NINETY_FIVE;
    return fit * fit;
}
//? end

//? uncertain
/* How a value, or the difference of two, depends on what is uncertain at one condition. */
typedef struct {
    double slopes[SURROGATE_SLOPES];
    /* The points: the state of what the model misses there alone, one, minus one or zero, its weight, the variance of the fit. */
    int state[2];
    double sign[2];
    double own[2];
    double fit[2];
    double common;
    double growth;
} surrogate_direction;

/* What all directions at one condition share. */
typedef struct {
    double monomials[SURROGATE_SLOPE_TERMS];
    double growth;
} surrogate_here;

static void surrogate_at(const double x[SURROGATE_VARIABLES], surrogate_here *here)
{
    double u[SURROGATE_VARIABLES];
    double powers[SURROGATE_VARIABLES][SURROGATE_POWERS];
    double square = 0.0;
    double away;
    int i;
    surrogate_scale(x, surrogate_slope_scalings, u);
    surrogate_powers(u, powers);
    here->monomials[0] = 0.0;
    for (i = 0; i < SURROGATE_SLOPE_TERM_COUNT; i++) {
        here->monomials[i] = surrogate_monomial(powers, &surrogate_slope_exponents[i * SURROGATE_VARIABLES]);
    }
    for (i = 0; i < SURROGATE_VARIABLES; i++) {
        const double half = surrogate_measured_halves[i];
        const double d = (half > 0.0) ? ((x[i] - surrogate_measured_centre[i]) / half) : 0.0;
        square = square + (d * d);
    }
    away = SURROGATE_GROWTH * sqrt(square);
    here->growth = away * away;
}

/* The direction of a point, or of the first point minus the second (-1: no second). */
static void surrogate_direct(const surrogate_here *here, int first, int second, surrogate_direction *direction)
{
    int end;
    int t;
    int k;
    for (k = 0; k < SURROGATE_SLOPES; k++) {
        direction->slopes[k] = 0.0;
    }
    for (end = 0; end < 2; end++) {
        direction->state[end] = SURROGATE_STATES - 1;
        direction->sign[end] = 0.0;
        direction->own[end] = 0.0;
        direction->fit[end] = 0.0;
    }
    direction->common = 0.0;
    direction->growth = here->growth;
    if (second != first) {
        for (end = 0; end < 2; end++) {
            const int point = (end == 0) ? first : second;
            const double sign = (end == 0) ? 1.0 : -1.0;
            if (point >= 0) {
                double slopes[SURROGATE_SLOPES];
                direction->state[end] = SURROGATE_PARAMETERS + point;
                direction->sign[end] = sign;
                direction->own[end] = surrogate_missed_own[point];
                direction->fit[end] = surrogate_fit_variance(point);
                direction->common = direction->common + (sign * surrogate_missed_common[point]);
                for (k = 0; k < SURROGATE_SLOPES; k++) {
                    slopes[k] = 0.0;
                }
                for (t = 0; t < SURROGATE_SLOPE_TERM_COUNT; t++) {
                    for (k = 0; k < SURROGATE_PARAMETERS; k++) {
                        slopes[k] = slopes[k] + (here->monomials[t] * surrogate_slope_table[(((point * SURROGATE_SLOPE_TERM_COUNT) + t) * SURROGATE_PARAMETERS) + k]);
                    }
                }
                for (k = 0; k < SURROGATE_PARAMETERS; k++) {
                    direction->slopes[k] = direction->slopes[k] + (sign * slopes[k]);
                }
            }
        }
    }
}

/* Weight number k of a direction, 0 to PARAMETERS + 2, and the state it belongs to. */
static double surrogate_weight(const surrogate_direction *direction, int k, int *state)
{
    double weight;
    if (k < SURROGATE_PARAMETERS) {
        *state = k;
        weight = direction->slopes[k];
    } else if (k < (SURROGATE_PARAMETERS + 2)) {
        const int end = k - SURROGATE_PARAMETERS;
        *state = direction->state[end];
        weight = direction->sign[end] * direction->own[end];
    } else {
        *state = SURROGATE_STATES - 1;
        weight = direction->common;
    }
    return weight;
}

//? known
static double surrogate_known(int i, int j)
{
    const int row = (i < j) ? j : i;
    const int column = (i < j) ? i : j;
    return surrogate_covariance[surrogate_rows[row] + column];
}

/* What the mean of the states adds. */
static double surrogate_mean_of(const surrogate_direction *direction)
{
    double sum = 0.0;
    int state = 0;
    int k;
    for (k = 0; k < (SURROGATE_PARAMETERS + 3); k++) {
        const double weight = surrogate_weight(direction, k, &state);
        sum = sum + (weight * surrogate_mean[state]);
    }
    return sum;
}
//? end

/* Covariance by the states between the weights from..to of two directions. */
static double surrogate_by_states(const surrogate_direction *a, const surrogate_direction *b, int from, int to)
{
    double sum = 0.0;
    int i;
    int j;
    int state_a = 0;
    int state_b = 0;
    for (i = from; i < to; i++) {
        const double weight = surrogate_weight(a, i, &state_a);
        double towards = 0.0;
//? known
        for (j = from; j < to; j++) {
            const double other = surrogate_weight(b, j, &state_b);
            towards = towards + (other * surrogate_known(state_b, state_a));
        }
//? else
        int first = SURROGATE_PARAMETERS;
        int last = to;
        if (i < SURROGATE_PARAMETERS) {
            first = i;
            last = i + 1;
        }
        for (j = first; j < last; j++) {
            const double other = surrogate_weight(b, j, &state_b);
            if (state_a == state_b) {
                towards = towards + other;
            }
        }
//? end
        sum = sum + (weight * towards);
    }
    return sum;
}

static void surrogate_band_of(const surrogate_direction *direction, surrogate_band *band)
{
    double fit = 0.0;
    double new_there = 0.0;
    double parameters;
    double misses;
    double states;
    int end;
    for (end = 0; end < 2; end++) {
        fit = fit + direction->fit[end];
        new_there = new_there + (direction->own[end] * direction->own[end]);
    }
    new_there = direction->growth * (new_there + (direction->common * direction->common));
    parameters = surrogate_by_states(direction, direction, 0, SURROGATE_PARAMETERS);
    misses = surrogate_by_states(direction, direction, SURROGATE_PARAMETERS, SURROGATE_PARAMETERS + 3);
//? known
    states = surrogate_by_states(direction, direction, 0, SURROGATE_PARAMETERS + 3);
//? else
    states = parameters + misses;
//? end
    band->fit = surrogate_root(fit);
    band->parameters = surrogate_root(parameters);
    band->misses = surrogate_root(misses + new_there);
    band->total = surrogate_root((states + fit) + new_there);
}

//? limits
/* Covariance of two quantities at one condition. */
static double surrogate_shared(const surrogate_direction *a, const surrogate_direction *b)
{
    double beside = (a->growth * a->common) * b->common;
    int i;
    int j;
    for (i = 0; i < 2; i++) {
        for (j = 0; j < 2; j++) {
            if (a->state[i] == b->state[j]) {
                beside = beside + ((a->sign[i] * b->sign[j]) * (a->fit[i] + ((a->growth * a->own[i]) * a->own[i])));
            }
        }
    }
    return surrogate_by_states(a, b, 0, SURROGATE_PARAMETERS + 3) + beside;
}
//? end
//? end

//? limits
/* The points a limit compares: the first with a plus sign, the second (-1: none) with a minus sign. */
static void surrogate_compared(int limit, const double values[SURROGATE_POINTS], int *first, int *second)
{
    const surrogate_limit_entry *const own = &surrogate_limits[limit];
    int i;
    *first = (int)own->points[0];
    *second = -1;
    if (own->kind == 2) {
        *second = (int)own->points[1];
    }
    if (own->kind == 3) {
        *second = *first;
        for (i = 1; i < own->count; i++) {
            const int point = (int)own->points[i];
            if (values[point] > values[*first]) {
                *first = point;
            }
            if (values[point] < values[*second]) {
                *second = point;
            }
        }
    }
}

/* The limited quantity. */
static double surrogate_limited(int limit, const double x[SURROGATE_VARIABLES], const double values[SURROGATE_POINTS])
{
    const surrogate_limit_entry *const own = &surrogate_limits[limit];
    double value = values[own->points[0]];
    int i;
    if (own->kind == 1) {
        value = value - x[own->variable];
    }
    if (own->kind == 2) {
        value = value - values[own->points[1]];
    }
    if (own->kind == 3) {
        double low = value;
        double high = value;
        double sum = value;
        for (i = 1; i < own->count; i++) {
            const double next = values[own->points[i]];
            low = surrogate_lesser(next, low);
            high = surrogate_greater(next, high);
            sum = sum + next;
        }
        value = high - low;
        if (surrogate_is_finite(sum) == 0) {
            value = sum - sum;
        }
    }
    return value;
}

static double surrogate_horner(const double *coefficients, int count, double x)
{
    double sum = 0.0;
    int i;
    for (i = 0; i < count; i++) {
        sum = (sum * x) + coefficients[i];
    }
    return sum;
}

/* Probability that a standard normal variable is at most x: Hart (1968, no. 5666), a continued fraction beyond 7. */
static double surrogate_probability_below(double x)
{
    static const double over[7] = {
        0.0352624965998911, 0.700383064443688, 6.37396220353165, 33.912866078383, 112.079291497871, 221.213596169931, 220.206867912376
    };
    static const double under[8] = {
        0.0883883476483184, 1.75566716318264, 16.064177579207, 86.7807322029461, 296.564248779674, 637.333633378831, 793.826512519948, 440.413735824752
    };
    const double size = (x < 0.0) ? -x : x;
    double tail = 0.0;
    int k;
    if (!(size > 38.0)) {
        const double density = surrogate_exp_minus((0.5 * size) * size);
        if (size < 7.0) {
            tail = (density * surrogate_horner(over, 7, size)) / surrogate_horner(under, 8, size);
        } else {
            double fraction = size;
            for (k = 12; k >= 1; k--) {
                fraction = size + ((double)k / fraction);
            }
            tail = (density * 0.3989422804014327) / fraction;
        }
    }
    return (x < 0.0) ? tail : (1.0 - tail);
}

/* Probability that a margin is kept; not a number where one of them has overflown. */
static double surrogate_kept(double margin, double deviation)
{
    double probability = (margin - margin) + (deviation - deviation);
    if (probability == 0.0) {
        if (deviation > 0.0) {
            probability = surrogate_probability_below(margin / deviation);
        } else {
            probability = (margin >= 0.0) ? 1.0 : 0.0;
        }
    }
    return probability;
}

static int surrogate_judged(double probability, double confidence)
{
    int state = SURROGATE_UNCERTAIN;
    if (probability >= confidence) {
        state = SURROGATE_ACCEPTABLE;
    } else if (probability <= (1.0 - confidence)) {
        state = SURROGATE_NOT_ACCEPTABLE;
    } else {
        state = SURROGATE_UNCERTAIN;
    }
    return state;
}

//? uncertain
static void surrogate_limit_direction(int limit, const surrogate_here *here, const double values[SURROGATE_POINTS], surrogate_direction *direction)
{
    int first = 0;
    int second = -1;
    surrogate_compared(limit, values, &first, &second);
    surrogate_direct(here, first, second, direction);
}

static void surrogate_chance_of(int limit, const double x[SURROGATE_VARIABLES], const surrogate_here *here, const double values[SURROGATE_POINTS], surrogate_limit_chance *out)
{
    surrogate_direction direction;
    surrogate_limit_direction(limit, here, values, &direction);
    surrogate_band_of(&direction, &out->band);
    out->value = surrogate_limited(limit, x, values);
    out->maximum = surrogate_limits[limit].maximum;
    out->probability = surrogate_kept(out->maximum - out->value, out->band.total);
}
//? else
static void surrogate_chance_of(int limit, const double x[SURROGATE_VARIABLES], const double values[SURROGATE_POINTS], surrogate_limit_chance *out)
{
    int first = 0;
    int second = -1;
    double variance;
    surrogate_compared(limit, values, &first, &second);
    variance = surrogate_fit_variance(first);
    if (second >= 0) {
        variance = variance + surrogate_fit_variance(second);
    }
    out->band.fit = sqrt(variance);
    out->band.parameters = 0.0;
    out->band.misses = 0.0;
    out->band.total = out->band.fit;
    out->value = surrogate_limited(limit, x, values);
    out->maximum = surrogate_limits[limit].maximum;
    out->probability = surrogate_kept(out->maximum - out->value, out->band.total);
}
//? end

/* A limit that may be broken. */
typedef struct {
    int index;
    double slack;
    double broken;
    double variance;
} surrogate_critical;

static double surrogate_clamped(double value, double low, double high)
{
    double result = value;
    if (result < low) {
        result = low;
    }
    if (result > high) {
        result = high;
    }
    return result;
}

/* Nodes and weights of Gauss and Legendre's rule between 0 and 1. */
#define SURROGATE_NODES 12
static const double surrogate_rule[SURROGATE_NODES][2] = {
    {0.009219682876640378, 0.023587668193255706}, {0.0479413718147626, 0.05346966299765953}, {0.11504866290284765, 0.08003916427167321},
    {0.20634102285669126, 0.10158371336153287}, {0.31608425050090994, 0.1167462682691773}, {0.43738329574426554, 0.12457352290670134},
    {0.5626167042557344, 0.12457352290670134}, {0.6839157494990901, 0.1167462682691773}, {0.7936589771433087, 0.10158371336153287},
    {0.8849513370971523, 0.08003916427167321}, {0.9520586281852375, 0.05346966299765953}, {0.9907803171233596, 0.023587668193255706}
};

/* exp(x) for either sign. */
static double surrogate_exp_signed(double x)
{
    return (x < 0.0) ? surrogate_exp_minus(-x) : (1.0 / surrogate_exp_minus(x));
}

/* The tangent of half the angle whose sine is r. */
static double surrogate_half_tangent(double r)
{
    return r / (1.0 + sqrt((1.0 - r) * (1.0 + r)));
}

/* Correlation and its complement 1 - r^2 at a half tangent; the angle that a step of it adds. */
static double surrogate_turned(double tangent, double *r, double *left)
{
    const double under = 1.0 + (tangent * tangent);
    const double cosine = (1.0 - (tangent * tangent)) / under;
    *r = (2.0 * tangent) / under;
    *left = cosine * cosine;
    return 2.0 / under;
}

/* The density of two standard normal numbers of a correlation, without its leading factors; left is 1 - r^2. */
static double surrogate_density_of_two(double a, double b, double r, double left)
{
    return surrogate_exp_minus((0.5 * (((a * a) + (b * b)) - (((2.0 * r) * a) * b))) / left);
}

/* What a correlation that is not quite one takes from the probability that both are below. */
static double surrogate_missing(double a, double b, double r)
{
    const double end = sqrt((1.0 - r) * (1.0 + r));
    const double apart = surrogate_greater(a, b) - surrogate_lesser(a, b);
    double result = 0.0;
    int k;
    if ((apart <= (8.0 * end)) && (end > 0.0)) {
        const double square = apart * apart;
        const double product = a * b;
        /* At the narrow end the integrand is its first two terms times a factor whose integrals are known. */
        const double lead = surrogate_exp_signed(-0.5 * product);
        const double bend = 0.5 - (0.125 * product);
        const double edge = surrogate_exp_minus((0.5 * square) / (end * end));
        const double flat = (end * edge) - ((apart * 2.5066282746310007) * surrogate_probability_below(-apart / end));
        const double curved = ((((end * end) * end) * edge) - (square * flat)) / 3.0;
        double sum = 0.0;
        for (k = 0; k < SURROGATE_NODES; k++) {
            const double x = surrogate_rule[k][0] * end;
            const double cosine = sqrt((1.0 - x) * (1.0 + x));
            const double whole = surrogate_exp_signed(-product / (1.0 + cosine)) / cosine;
            sum = sum + ((surrogate_rule[k][1] * surrogate_exp_minus((0.5 * square) / (x * x))) * (whole - (lead * (1.0 + ((bend * x) * x)))));
        }
        result = ((lead * (flat + (bend * curved))) + (end * sum)) / 6.283185307179586;
    }
    return result;
}

/* Probability that two standard normal numbers of correlation r are below a and b, each by itself with below_a and below_b
   (Drezner and Wesolowsky 1990, Genz 2004). */
static double surrogate_both_below(double a, double b, double r, double below_a, double below_b)
{
    double result;
    int k;
    if (r > 0.9) {
        result = surrogate_lesser(below_a, below_b) - surrogate_missing(a, b, r);
    } else if (r < -0.9) {
        result = surrogate_greater((below_a + below_b) - 1.0, 0.0) + surrogate_missing(a, -b, -r);
    } else {
        const double end = surrogate_half_tangent(r);
        double sum = 0.0;
        for (k = 0; k < SURROGATE_NODES; k++) {
            double here;
            double left;
            const double step = surrogate_turned(surrogate_rule[k][0] * end, &here, &left);
            sum = sum + ((surrogate_rule[k][1] * step) * surrogate_density_of_two(a, b, here, left));
        }
        result = (below_a * below_b) + ((end * sum) / 6.283185307179586);
    }
    return result;
}

/* Limits, each the standard normal number below which it is broken, and what is known of one and of two. */
typedef struct {
    double bound[SURROGATE_MOST_LIMITS];
    double broken[SURROGATE_MOST_LIMITS];
    double both[SURROGATE_MOST_LIMITS][SURROGATE_MOST_LIMITS];
} surrogate_breaking;

static double surrogate_size(double x)
{
    return (x < 0.0) ? -x : x;
}

/* Probability that three are broken (Plackett 1954); below zero where two of them are the same quantity. */
static double surrogate_three(const surrogate_breaking *own, double correlation[SURROGATE_MOST_LIMITS][SURROGATE_MOST_LIMITS], int i, int j, int k)
{
    const double ij = surrogate_size(correlation[i][j]);
    const double ik = surrogate_size(correlation[i][k]);
    const double jk = surrogate_size(correlation[j][k]);
    double result = -1.0;
    int first = k;
    int second = i;
    int third = j;
    int n;
    if ((jk >= ij) && (jk >= ik)) {
        first = i;
        second = j;
        third = k;
    } else if (ik >= ij) {
        first = j;
        second = i;
        third = k;
    } else {
        /* as they stand */
    }
    if (surrogate_size(correlation[second][third]) <= SURROGATE_SAME) {
        const double a = own->bound[first];
        const double b = own->bound[second];
        const double c = own->bound[third];
        const double p = correlation[second][third];
        const double to_b = surrogate_half_tangent(correlation[first][second]);
        const double to_c = surrogate_half_tangent(correlation[first][third]);
        double sum = 0.0;
        for (n = 0; n < SURROGATE_NODES; n++) {
            double r;
            double left_r;
            double q;
            double left_q;
            const double step_r = surrogate_turned(surrogate_rule[n][0] * to_b, &r, &left_r);
            const double step_q = surrogate_turned(surrogate_rule[n][0] * to_c, &q, &left_q);
            const double left = surrogate_greater(((left_r - (q * q)) - (p * p)) + (((2.0 * p) * q) * r), SURROGATE_FLAT);
            const double with_b = (((c * left_r) - ((q - (p * r)) * a)) - ((p - (q * r)) * b)) / sqrt(left_r * left);
            const double with_c = (((b * left_q) - ((r - (p * q)) * a)) - ((p - (q * r)) * c)) / sqrt(left_q * left);
            const double of_b = surrogate_density_of_two(a, b, r, left_r) * surrogate_probability_below(with_b);
            const double of_c = surrogate_density_of_two(a, c, q, left_q) * surrogate_probability_below(with_c);
            sum = sum + (surrogate_rule[n][1] * (((to_b * step_r) * of_b) + ((to_c * step_q) * of_c)));
        }
        result = surrogate_clamped((own->broken[first] * own->both[second][third]) + (sum / 6.283185307179586), 0.0,
                                   surrogate_lesser(surrogate_lesser(own->both[i][j], own->both[i][k]), own->both[j][k]));
    }
    return result;
}

/* A probability that all are kept which is never too large (Hunter 1976, Worsley 1982; Bukszar and Prekopa 2001). */
static double surrogate_least_kept(const surrogate_breaking *own, double correlation[SURROGATE_MOST_LIMITS][SURROGATE_MOST_LIMITS], int count)
{
    int is_in[SURROGATE_MOST_LIMITS];
    int first[SURROGATE_MOST_LIMITS];
    int second[SURROGATE_MOST_LIMITS];
    double kept = 1.0 - own->broken[0];
    int round;
    int k;
    for (k = 0; k < SURROGATE_MOST_LIMITS; k++) {
        is_in[k] = 0;
        first[k] = 0;
        second[k] = -1;
    }
    is_in[0] = 1;
    for (round = 1; round < count; round++) {
        int next = 0;
        double alone;
        for (k = 0; k < count; k++) {
            if ((is_in[k] == 0) && ((is_in[next] != 0) || (own->both[k][first[k]] > (own->both[next][first[next]] + SURROGATE_ALIKE)))) {
                next = k;
            }
        }
        alone = own->broken[next] - own->both[next][first[next]];
        if ((second[next] >= 0) && (surrogate_lesser(alone, own->both[next][second[next]]) > 1e-6)) {
            const double three = surrogate_three(own, correlation, next, first[next], second[next]);
            if (three >= 0.0) {
                alone = alone + (three - own->both[next][second[next]]);
            }
        }
        kept = kept - surrogate_greater(alone, 0.0);
        is_in[next] = 1;
        for (k = 0; k < count; k++) {
            if (own->both[k][next] > (own->both[k][first[k]] + SURROGATE_ALIKE)) {
                second[k] = first[k];
                first[k] = next;
            } else if ((second[k] < 0) || (own->both[k][next] > (own->both[k][second[k]] + SURROGATE_ALIKE))) {
                second[k] = next;
            } else {
                /* nearer ones are known */
            }
        }
    }
    return surrogate_greater(kept, 0.0);
}

/* About the probability that all of some limits are kept: one after the other, each given those before, as if what is left
   stayed normal (Mendell and Elston 1974). */
static double surrogate_one_by_one(const surrogate_critical *limits, int count, double correlation[SURROGATE_MOST_LIMITS][SURROGATE_MOST_LIMITS])
{
    double slack[SURROGATE_MOST_LIMITS];
    int same[SURROGATE_MOST_LIMITS];
    double together = 1.0;
    int none = 0;
    int i;
    int j;
    int k;
    for (i = 0; i < SURROGATE_MOST_LIMITS; i++) {
        slack[i] = (i < count) ? limits[i].slack : 0.0;
        same[i] = 0;
    }
    for (i = 0; i < count; i++) {
        if ((same[i] == 0) && (none == 0)) {
            const double own = surrogate_probability_below(slack[i]);
            together = together * own;
            if (own < SURROGATE_NEVER) {
                none = 1;
            } else {
                const double a = (0.3989422804014327 * surrogate_exp_minus((0.5 * slack[i]) * slack[i])) / own;
                const double loss = (a > 0.0) ? (a * (a + slack[i])) : 0.0;
                for (j = i + 1; j < count; j++) {
                    const double r = correlation[i][j];
                    if (r > SURROGATE_SAME) {
                        same[j] = 1;
                    } else {
                        const double left = 1.0 - ((r * r) * loss);
                        slack[j] = slack[j] + (r * a);
                        if (left > SURROGATE_NOTHING) {
                            slack[j] = slack[j] / sqrt(left);
                        }
                    }
                }
                for (j = i + 1; j < count; j++) {
                    for (k = i + 1; k < count; k++) {
                        if (j != k) {
                            const double left_j = 1.0 - ((correlation[i][j] * correlation[i][j]) * loss);
                            const double left_k = 1.0 - ((correlation[i][k] * correlation[i][k]) * loss);
                            const double scale = sqrt(surrogate_greater(left_j, SURROGATE_NOTHING) * surrogate_greater(left_k, SURROGATE_NOTHING));
                            correlation[j][k] = surrogate_clamped((correlation[j][k] - ((correlation[i][j] * correlation[i][k]) * loss)) / scale, -1.0, 1.0);
                        }
                    }
                }
            }
        }
    }
    return (none != 0) ? 0.0 : together;
}

/* Probability that all of some limits are kept: the bound, and of more than three limits an estimate where that is low. */
static double surrogate_all_kept(const surrogate_critical *limits, int count, double correlation[SURROGATE_MOST_LIMITS][SURROGATE_MOST_LIMITS])
{
    surrogate_breaking own;
    double most = 1.0;
    double least;
    int i;
    int j;
    for (i = 0; i < SURROGATE_MOST_LIMITS; i++) {
        own.bound[i] = (i < count) ? surrogate_clamped(-limits[i].slack, -40.0, 40.0) : 0.0;
        own.broken[i] = (i < count) ? limits[i].broken : 0.0;
        most = surrogate_lesser(1.0 - own.broken[i], most);
        for (j = 0; j <= i; j++) {
            const double lesser = surrogate_lesser(own.broken[i], own.broken[j]);
            own.both[i][j] = 0.0;
            if ((j < i) && (lesser > 1e-7)) {
                own.both[i][j] = surrogate_clamped(surrogate_both_below(own.bound[i], own.bound[j], correlation[i][j], own.broken[i], own.broken[j]), 0.0, lesser);
            }
            own.both[j][i] = own.both[i][j];
        }
    }
    least = surrogate_least_kept(&own, correlation, count);
    if ((count > 3) && (least < 0.9)) {
        const double more = surrogate_lesser(surrogate_one_by_one(limits, count, correlation), most) - least;
        least = least + (surrogate_greater(more, 0.0) * surrogate_lesser((0.9 - least) / (0.9 - 0.7), 1.0));
    }
    return least;
}

/* Puts a limit into the list of those most likely broken; returns the one that has no place there. */
static surrogate_critical surrogate_insert(surrogate_critical worst[SURROGATE_MOST_LIMITS], surrogate_critical own)
{
    surrogate_critical left = own;
    int i;
    for (i = 0; i < SURROGATE_MOST_LIMITS; i++) {
        if ((left.index >= 0) && ((worst[i].index < 0) || (left.slack < worst[i].slack))) {
            const surrogate_critical other = worst[i];
            worst[i] = left;
            left = other;
        }
    }
    return left;
}

/* The verdict on all limits together, given the points' values. */
//? uncertain
static void surrogate_judge(const double x[SURROGATE_VARIABLES], double confidence, const surrogate_here *here, const double values[SURROGATE_POINTS], surrogate_chance *chance)
//? else
static void surrogate_judge(const double x[SURROGATE_VARIABLES], double confidence, const double values[SURROGATE_POINTS], surrogate_chance *chance)
//? end
{
    surrogate_critical worst[SURROGATE_MOST_LIMITS];
    double correlation[SURROGATE_MOST_LIMITS][SURROGATE_MOST_LIMITS];
    double broken_elsewhere = 0.0;
    double together;
    int count = 0;
    int limit;
    int i;
    int j;
    int is_number = 1;
    chance->state = SURROGATE_UNCERTAIN;
    chance->in_domain = surrogate_in_domain(x);
    chance->probability = 0.0;
    chance->binding = SURROGATE_NO_LIMIT;
    for (i = 0; i < SURROGATE_MOST_LIMITS; i++) {
        worst[i].index = -1;
        worst[i].slack = 0.0;
        worst[i].broken = 0.0;
        worst[i].variance = 0.0;
        for (j = 0; j < SURROGATE_MOST_LIMITS; j++) {
            correlation[i][j] = (i == j) ? 1.0 : 0.0;
        }
    }
    for (limit = 0; (limit < SURROGATE_LIMITS) && (is_number != 0); limit++) {
        surrogate_limit_chance own;
//? uncertain
        surrogate_chance_of(limit, x, here, values, &own);
//? else
        surrogate_chance_of(limit, x, values, &own);
//? end
        if (!(own.probability >= 0.0)) {
            chance->binding = limit;
            chance->probability = own.probability;
            is_number = 0;
        } else {
            surrogate_critical critical;
            critical.index = limit;
            critical.slack = (own.maximum - own.value) / surrogate_greater(own.band.total, SURROGATE_TINY);
            critical.broken = 1.0 - own.probability;
            critical.variance = own.band.total * own.band.total;
            critical = surrogate_insert(worst, critical);
            if (critical.index < 0) {
                count = count + 1;
            } else {
                broken_elsewhere = broken_elsewhere + critical.broken;
            }
        }
    }
    if (is_number != 0) {
        /* What is as good as never broken depends on nothing. */
        int doubtful = 1;
        while ((doubtful < count) && (worst[doubtful].broken > SURROGATE_NOTHING)) {
            doubtful = doubtful + 1;
        }
//? uncertain
        for (i = 0; i < doubtful; i++) {
            surrogate_direction a;
            surrogate_limit_direction(worst[i].index, here, values, &a);
            for (j = 0; j < i; j++) {
                const double scale = sqrt(worst[i].variance * worst[j].variance);
                surrogate_direction b;
                surrogate_limit_direction(worst[j].index, here, values, &b);
                correlation[i][j] = (scale > 0.0) ? surrogate_clamped(surrogate_shared(&a, &b) / scale, -1.0, 1.0) : 0.0;
                correlation[j][i] = correlation[i][j];
            }
        }
//? end
        together = surrogate_all_kept(worst, doubtful, correlation) - broken_elsewhere;
        chance->probability = (together > 0.0) ? together : 0.0;
        chance->binding = worst[0].index;
        if (chance->in_domain != 0) {
            chance->state = surrogate_judged(chance->probability, confidence);
        }
    }
}
//? !uncertain

/* The largest upper end minus the smallest lower end of the bands of two different points. */
static double surrogate_widest_pair(const surrogate_limit_entry *limit, const double values[SURROGATE_POINTS])
{
    double widest = 0.0;
    int is_first = 1;
    int i;
    int j;
    for (i = 0; i < limit->count; i++) {
        for (j = 0; j < limit->count; j++) {
            if (i != j) {
                const int p = (int)limit->points[i];
                const int q = (int)limit->points[j];
                const double apart = (values[p] + surrogate_half_widths[p]) - (values[q] - surrogate_half_widths[q]);
                if ((is_first != 0) || (apart > widest)) {
                    widest = apart;
                    is_first = 0;
                }
            }
        }
    }
    return widest;
}

/* The ends of the band of a spread. */
static void surrogate_spread_ends(const surrogate_limit_entry *limit, const double values[SURROGATE_POINTS], double *low, double *high)
{
    double largest_low = 0.0;
    double smallest_high = 0.0;
    int i;
    for (i = 0; i < limit->count; i++) {
        const int point = (int)limit->points[i];
        const double own_low = values[point] - surrogate_half_widths[point];
        const double own_high = values[point] + surrogate_half_widths[point];
        largest_low = ((i == 0) || (own_low > largest_low)) ? own_low : largest_low;
        smallest_high = ((i == 0) || (own_high < smallest_high)) ? own_high : smallest_high;
    }
    *low = surrogate_greater(largest_low - smallest_high, 0.0);
    *high = surrogate_widest_pair(limit, values);
}
//? end
//? end

int surrogate_in_domain(const double x[SURROGATE_VARIABLES])
{
    int inside = 1;
    int v;
    for (v = 0; v < SURROGATE_VARIABLES; v++) {
        if (!((surrogate_low[v] <= x[v]) && (x[v] <= surrogate_high[v]))) {
            inside = 0;
        }
    }
    return inside;
}

void surrogate_evaluate(const double x[SURROGATE_VARIABLES], double values[SURROGATE_POINTS])
{
//? known
    surrogate_here here;
    surrogate_direction direction;
    int point;
//? end
    surrogate_evaluate_fit(x, values);
//? known
    surrogate_at(x, &here);
    for (point = 0; point < SURROGATE_POINTS; point++) {
        surrogate_direct(&here, point, -1, &direction);
        values[point] = values[point] + surrogate_mean_of(&direction);
    }
//? end
}
//? displaced

void surrogate_offset(const double x[SURROGATE_VARIABLES], double offsets[SURROGATE_POINTS])
{
    int point;
    surrogate_evaluate(x, offsets);
    for (point = 0; point < SURROGATE_POINTS; point++) {
        offsets[point] = surrogate_displaced[point] ? -offsets[point] : 0.0;
    }
}
//? end

int surrogate_gradient(const double x[SURROGATE_VARIABLES], int point, double gradient[SURROGATE_VARIABLES])
{
    const int exists = surrogate_is_place(point, SURROGATE_POINTS);
    double u[SURROGATE_VARIABLES];
    double slopes[SURROGATE_VARIABLES];
    int model;
    int c;
    int v;
//? bases !paired
    int centre;
//? end
    for (v = 0; v < SURROGATE_VARIABLES; v++) {
        gradient[v] = 0.0;
    }
    for (model = 0; (model < SURROGATE_POLYNOMIALS) && (exists != 0); model++) {
        const surrogate_polynomial_entry *const own = &surrogate_polynomials[model];
        for (c = 0; c < own->columns; c++) {
            if ((int)own->points[c] == point) {
                surrogate_scale(x, own->scalings, u);
                for (v = 0; v < SURROGATE_VARIABLES; v++) {
                    slopes[v] = 0.0;
                }
                surrogate_polynomial_slopes(u, own->exponents, own->terms, &own->coefficients[c], own->columns, slopes);
                for (v = 0; v < SURROGATE_VARIABLES; v++) {
                    gradient[v] = gradient[v] + (slopes[v] * surrogate_scale_slope(x, own->scalings, v));
                }
            }
        }
    }
//? known
    if (exists != 0) {
        surrogate_scale(x, surrogate_slope_scalings, u);
        for (v = 0; v < SURROGATE_VARIABLES; v++) {
            slopes[v] = 0.0;
        }
        surrogate_polynomial_slopes(u, surrogate_slope_exponents, SURROGATE_SLOPE_TERM_COUNT, &surrogate_shift_table[point * SURROGATE_SLOPE_TERM_COUNT], 1, slopes);
        for (v = 0; v < SURROGATE_VARIABLES; v++) {
            gradient[v] = gradient[v] + (slopes[v] * surrogate_scale_slope(x, surrogate_slope_scalings, v));
        }
    }
//? end
//? bases
    for (model = 0; (model < SURROGATE_BASES) && (exists != 0); model++) {
        const surrogate_basis_entry *const own = &surrogate_bases[model];
        for (c = 0; c < own->columns; c++) {
            if ((int)own->points[c] == point) {
//? paired
                surrogate_basis_slopes(x, own, c, slopes);
//? else
                surrogate_scale(x, own->scalings, u);
                for (v = 0; v < SURROGATE_VARIABLES; v++) {
                    slopes[v] = 0.0;
                }
                for (centre = 0; centre < own->count; centre++) {
                    const double square = surrogate_squared_distance(own, u, centre);
                    const double slope = (own->weights[(centre * own->columns) + c] * 2.0) * surrogate_kernel_slope(own->kernel, square);
                    for (v = 0; v < SURROGATE_VARIABLES; v++) {
                        const double d = (u[v] - own->centres[(centre * SURROGATE_VARIABLES) + v]) * own->scales[v];
                        slopes[v] = slopes[v] + (slope * (d * own->scales[v]));
                    }
                }
//? end
                for (v = 0; v < SURROGATE_VARIABLES; v++) {
                    gradient[v] = gradient[v] + (slopes[v] * surrogate_scale_slope(x, own->scalings, v));
                }
            }
        }
    }
//? end
    return (exists != 0) ? 0 : -1;
}

void surrogate_bands(const double x[SURROGATE_VARIABLES], double values[SURROGATE_POINTS], surrogate_band bands[SURROGATE_POINTS])
{
    int point;
//? uncertain
    surrogate_here here;
    surrogate_direction direction;
    surrogate_evaluate_fit(x, values);
    surrogate_at(x, &here);
    for (point = 0; point < SURROGATE_POINTS; point++) {
        surrogate_direct(&here, point, -1, &direction);
//? known
        values[point] = values[point] + surrogate_mean_of(&direction);
//? end
        surrogate_band_of(&direction, &bands[point]);
    }
//? else
    surrogate_evaluate_fit(x, values);
    for (point = 0; point < SURROGATE_POINTS; point++) {
        bands[point].fit = surrogate_half_widths[point] / SURROGATE_NINETY_FIVE;
        bands[point].parameters = 0.0;
        bands[point].misses = 0.0;
        bands[point].total = bands[point].fit;
    }
//? end
}

int surrogate_limit_probability(int limit, const double x[SURROGATE_VARIABLES], const double values[SURROGATE_POINTS], surrogate_limit_chance *out)
{
    int status = -1;
//? limits
    if ((limit >= 0) && (limit < SURROGATE_LIMITS)) {
//? uncertain
        surrogate_here here;
        surrogate_at(x, &here);
        surrogate_chance_of(limit, x, &here, values, out);
//? else
        surrogate_chance_of(limit, x, values, out);
//? end
        status = 0;
    }
//? else
    (void)limit;
    (void)x;
    (void)values;
    (void)out;
//? end
    return status;
}

int surrogate_limit(int limit, const double x[SURROGATE_VARIABLES], const double values[SURROGATE_POINTS], surrogate_limit_value *out)
{
    int status = -1;
//? limits
    if ((limit >= 0) && (limit < SURROGATE_LIMITS)) {
//? uncertain
        surrogate_limit_chance chance;
        double half;
        status = surrogate_limit_probability(limit, x, values, &chance);
        half = SURROGATE_NINETY_FIVE * chance.band.total;
        out->value = chance.value;
        out->low = out->value - half;
        out->high = out->value + half;
        out->maximum = chance.maximum;
        out->margin = out->maximum - out->value;
        out->state = surrogate_judged(chance.probability, SURROGATE_CONFIDENCE);
//? else
        const surrogate_limit_entry *const own = &surrogate_limits[limit];
        double width = surrogate_half_widths[own->points[0]];
        status = 0;
        out->value = surrogate_limited(limit, x, values);
        out->maximum = own->maximum;
        out->margin = out->maximum - out->value;
        if (own->kind == 2) {
            width = width + surrogate_half_widths[own->points[1]];
        }
        out->low = out->value - width;
        out->high = out->value + width;
        if ((own->kind == 3) && (surrogate_is_finite(out->value) != 0)) {
            surrogate_spread_ends(own, values, &out->low, &out->high);
        }
        if ((out->high <= out->maximum) && (out->low > -HUGE_VAL)) {
            out->state = SURROGATE_ACCEPTABLE;
        } else if (out->low > out->maximum) {
            out->state = SURROGATE_NOT_ACCEPTABLE;
        } else {
            out->state = SURROGATE_UNCERTAIN;
        }
//? end
    }
//? else
    (void)limit;
    (void)x;
    (void)values;
    (void)out;
//? end
    return status;
}

void surrogate_assess(const double x[SURROGATE_VARIABLES], double confidence, double values[SURROGATE_POINTS], surrogate_band bands[SURROGATE_POINTS], surrogate_chance *chance)
{
//? limits uncertain
    surrogate_here here;
//? end
    surrogate_bands(x, values, bands);
//? limits
//? uncertain
    surrogate_at(x, &here);
    surrogate_judge(x, confidence, &here, values, chance);
//? else
    surrogate_judge(x, confidence, values, chance);
//? end
//? else
    (void)confidence;
    chance->state = SURROGATE_UNCERTAIN;
    chance->in_domain = surrogate_in_domain(x);
    chance->binding = SURROGATE_NO_LIMIT;
    chance->probability = (double)NAN;
//? end
}

void surrogate_query(const double x[SURROGATE_VARIABLES], double values[SURROGATE_POINTS], surrogate_verdict *verdict)
{
//? limits uncertain
    surrogate_here here;
    surrogate_chance chance;
//? end
//? limits !uncertain
    double margin = HUGE_VAL;
    int worst = SURROGATE_ACCEPTABLE;
    int limit;
//? end
    surrogate_evaluate(x, values);
    verdict->state = SURROGATE_UNCERTAIN;
    verdict->in_domain = surrogate_in_domain(x);
    verdict->binding = SURROGATE_NO_LIMIT;
    verdict->value = (double)NAN;
    verdict->margin = (double)NAN;
//? limits uncertain
    surrogate_at(x, &here);
    surrogate_judge(x, SURROGATE_CONFIDENCE, &here, values, &chance);
    verdict->state = chance.state;
    verdict->binding = chance.binding;
    verdict->value = surrogate_limited(chance.binding, x, values);
    verdict->margin = surrogate_limits[chance.binding].maximum - verdict->value;
//? end
//? limits !uncertain
    for (limit = 0; limit < SURROGATE_LIMITS; limit++) {
        surrogate_limit_value own;
        if ((surrogate_limit(limit, x, values, &own) == 0)
            && ((own.state > worst) || ((own.state == worst) && (own.margin < margin)))) {
            worst = own.state;
            verdict->binding = limit;
            verdict->value = own.value;
            verdict->margin = own.margin;
            margin = own.margin;
        }
    }
    if ((verdict->binding >= 0) && (verdict->in_domain != 0)) {
        verdict->state = worst;
    }
//? end
}

//? moving
/* The pole of the steps, the weights of one, two and three solves, and of their third difference as an estimate. */
#define SURROGATE_POLE 0.435866521508459
#define SURROGATE_ESTIMATE 0.5
/* Error of a step that is allowed at any point, and the shortest share of a step that it is cut into. */
#define SURROGATE_TIME_TOLERANCE 1e-4
#define SURROGATE_SHORTEST 1e-6

static int surrogate_is_condition(const double x[SURROGATE_VARIABLES])
{
    int v;
    int all = 1;
    for (v = 0; v < SURROGATE_VARIABLES; v++) {
        if (surrogate_is_finite(x[v]) == 0) {
            all = 0;
        }
    }
    return all;
}

static void surrogate_terms(const double x[SURROGATE_VARIABLES], const unsigned char *scalings, const unsigned char *exponents, int count, double *terms)
{
    double u[SURROGATE_VARIABLES];
    double powers[SURROGATE_VARIABLES][SURROGATE_POWERS];
    int t;
    surrogate_scale(x, scalings, u);
    surrogate_powers(u, powers);
    for (t = 0; t < count; t++) {
        terms[t] = surrogate_monomial(powers, &exponents[t * SURROGATE_VARIABLES]);
    }
}

/* Sums of so many terms times rows of coefficients, a row one coefficient per state. */
static void surrogate_combine(const double *terms, int count, const double *coefficients, double values[SURROGATE_TIME_STATES])
{
    int t;
    int k;
    for (k = 0; k < SURROGATE_TIME_STATES; k++) {
        values[k] = 0.0;
    }
    for (t = 0; t < count; t++) {
        for (k = 0; k < SURROGATE_TIME_STATES; k++) {
            values[k] = values[k] + (terms[t] * coefficients[(t * SURROGATE_TIME_STATES) + k]);
        }
    }
}

static void surrogate_steady_states(const double x[SURROGATE_VARIABLES], double values[SURROGATE_TIME_STATES])
{
    double terms[SURROGATE_STEADY_TERMS];
    surrogate_terms(x, surrogate_steady_scalings, surrogate_steady_exponents, SURROGATE_STEADY_TERMS, terms);
    surrogate_combine(terms, SURROGATE_STEADY_TERMS, surrogate_steady_coefficients, values);
}

static double surrogate_dot(const double a[SURROGATE_TIME_STATES], const double b[SURROGATE_TIME_STATES])
{
    double sum = 0.0;
    int k;
    for (k = 0; k < SURROGATE_TIME_STATES; k++) {
        sum = sum + (a[k] * b[k]);
    }
    return sum;
}

/* LU factors of I + pole length L by columns, rows exchanged by the largest pivot. */
typedef struct {
    double columns[SURROGATE_TIME_STATES][SURROGATE_TIME_STATES];
    double inverse[SURROGATE_TIME_STATES];
    int order[SURROGATE_TIME_STATES];
} surrogate_factors;

static void surrogate_swap(double *a, double *b)
{
    const double kept = *a;
    *a = *b;
    *b = kept;
}

static void surrogate_factorise(const double *terms, double length, surrogate_factors *own)
{
    int t;
    int i;
    int j;
    int k;
    for (j = 0; j < SURROGATE_TIME_STATES; j++) {
        own->order[j] = j;
        for (i = 0; i < SURROGATE_TIME_STATES; i++) {
            double rate = 0.0;
            for (t = 0; t < SURROGATE_MOVING_TERMS; t++) {
                rate = rate + (terms[t] * surrogate_rates[(((t * SURROGATE_TIME_STATES) + j) * SURROGATE_TIME_STATES) + i]);
            }
            own->columns[j][i] = rate * (SURROGATE_POLE * length);
        }
        own->columns[j][j] = own->columns[j][j] + 1.0;
    }
    for (k = 0; k < SURROGATE_TIME_STATES; k++) {
        double *const pivots = own->columns[k];
        int largest = k;
        int kept;
        for (i = k + 1; i < SURROGATE_TIME_STATES; i++) {
            if (fabs(pivots[i]) > fabs(pivots[largest])) {
                largest = i;
            }
        }
        kept = own->order[k];
        own->order[k] = own->order[largest];
        own->order[largest] = kept;
        for (j = 0; j < SURROGATE_TIME_STATES; j++) {
            surrogate_swap(&own->columns[j][k], &own->columns[j][largest]);
        }
        own->inverse[k] = 1.0 / pivots[k];
        for (i = k + 1; i < SURROGATE_TIME_STATES; i++) {
            pivots[i] = pivots[i] * own->inverse[k];
        }
        for (j = k + 1; j < SURROGATE_TIME_STATES; j++) {
            const double above = own->columns[j][k];
            for (i = k + 1; i < SURROGATE_TIME_STATES; i++) {
                own->columns[j][i] = own->columns[j][i] - (pivots[i] * above);
            }
        }
    }
}

static void surrogate_solve(const surrogate_factors *own, const double right[SURROGATE_TIME_STATES], double x[SURROGATE_TIME_STATES])
{
    int i;
    int k;
    for (i = 0; i < SURROGATE_TIME_STATES; i++) {
        x[i] = right[own->order[i]];
    }
    for (k = 0; k < SURROGATE_TIME_STATES; k++) {
        for (i = k + 1; i < SURROGATE_TIME_STATES; i++) {
            x[i] = x[i] - (own->columns[k][i] * x[k]);
        }
    }
    for (k = SURROGATE_TIME_STATES - 1; k >= 0; k--) {
        x[k] = x[k] * own->inverse[k];
        for (i = 0; i < k; i++) {
            x[i] = x[i] - (own->columns[k][i] * x[k]);
        }
    }
}

int surrogate_at_rest(const double x[SURROGATE_VARIABLES], surrogate_state *state)
{
    int result = -1;
    if (surrogate_is_condition(x) != 0) {
        surrogate_steady_states(x, state->states);
        state->length = 0.0;
        result = 0;
    }
    return result;
}

int surrogate_at_temperature(double temperature, surrogate_state *state)
{
    int result = -1;
    if (surrogate_is_finite(temperature) != 0) {
        int k;
        for (k = 0; k < SURROGATE_TIME_STATES; k++) {
            state->states[k] = surrogate_uniform[k] + (surrogate_uniform[SURROGATE_TIME_STATES + k] * temperature);
        }
        state->length = 0.0;
        result = 0;
    }
    return result;
}

/* The states that readings tell, each with its share of the surprise. */
static void surrogate_tell(const double x[SURROGATE_VARIABLES], const double readings[SURROGATE_POINTS], double deviation, double states[SURROGATE_TIME_STATES])
{
    double covariance[SURROGATE_TIME_STATES][SURROGATE_TIME_STATES];
    double terms[SURROGATE_MOVING_TERMS];
    double steady[SURROGATE_POINTS];
    double away[SURROGATE_TIME_STATES];
    int point;
    int i;
    int j;
    surrogate_evaluate(x, steady);
    surrogate_terms(x, surrogate_moving_scalings, surrogate_moving_exponents, SURROGATE_MOVING_TERMS, terms);
    for (i = 0; i < SURROGATE_TIME_STATES; i++) {
        away[i] = 0.0;
        for (j = 0; j <= i; j++) {
            covariance[i][j] = surrogate_spread[((i * (i + 1)) / 2) + j];
            covariance[j][i] = covariance[i][j];
        }
    }
    for (point = 0; point < SURROGATE_POINTS; point++) {
        double row[SURROGATE_TIME_STATES];
        double gain[SURROGATE_TIME_STATES];
        double variance;
        double surprise;
        if (surrogate_is_finite(readings[point]) != 0) {
            surrogate_combine(terms, SURROGATE_MOVING_TERMS, &surrogate_outputs[point * SURROGATE_MOVING_TERMS * SURROGATE_TIME_STATES], row);
            for (i = 0; i < SURROGATE_TIME_STATES; i++) {
                gain[i] = surrogate_dot(covariance[i], row);
            }
            variance = surrogate_dot(row, gain) + ((deviation * deviation) + (surrogate_time_errors[point] * surrogate_time_errors[point]));
            surprise = (readings[point] - steady[point]) - surrogate_dot(row, away);
            for (i = 0; i < SURROGATE_TIME_STATES; i++) {
                away[i] = away[i] + ((gain[i] * surprise) / variance);
                for (j = 0; j < SURROGATE_TIME_STATES; j++) {
                    covariance[i][j] = covariance[i][j] - ((gain[i] * gain[j]) / variance);
                }
            }
        }
    }
    surrogate_steady_states(x, states);
    for (i = 0; i < SURROGATE_TIME_STATES; i++) {
        states[i] = states[i] + away[i];
    }
}

int surrogate_at_readings(const double x[SURROGATE_VARIABLES], const double readings[SURROGATE_POINTS], double deviation, surrogate_state *state)
{
    int result = -1;
    if ((surrogate_is_condition(x) != 0) && (surrogate_is_finite(deviation) != 0) && (deviation > 0.0)) {
        surrogate_tell(x, readings, deviation, state->states);
        state->length = 0.0;
        result = 0;
    }
    return result;
}

/* The states after a step, which is cut where its error asks for it. */
static void surrogate_advance(surrogate_state *state, double duration, const double x[SURROGATE_VARIABLES])
{
    const double first = 1.0 / SURROGATE_POLE;
    const double second = 0.5 / (SURROGATE_POLE * SURROGATE_POLE);
    const double third_weight = (second - first) - (first - 1.0);
    const double second_weight = (first - 1.0) - (2.0 * third_weight);
    const double first_weight = (1.0 - second_weight) - third_weight;
    double terms[SURROGATE_MOVING_TERMS];
    double steady[SURROGATE_TIME_STATES];
    double away[SURROGATE_TIME_STATES];
    double solves[4][SURROGATE_TIME_STATES];
    surrogate_factors factors;
    double known = -1.0;
    double left = duration;
    double next;
    int k;
    surrogate_steady_states(x, steady);
    surrogate_terms(x, surrogate_moving_scalings, surrogate_moving_exponents, SURROGATE_MOVING_TERMS, terms);
    for (k = 0; k < SURROGATE_TIME_STATES; k++) {
        away[k] = state->states[k] - steady[k];
    }
    next = (state->length > 0.0) ? state->length : duration;
    while (left > 0.0) {
        double length = next;
        double error = 0.0;
        int is_last = 0;
        if (next >= (left * (1.0 - 1e-9))) {
            length = left;
            is_last = 1;
        }
        if (known != length) {
            surrogate_factorise(terms, length, &factors);
            known = length;
        }
        surrogate_solve(&factors, away, solves[0]);
        surrogate_solve(&factors, solves[0], solves[1]);
        surrogate_solve(&factors, solves[1], solves[2]);
        surrogate_solve(&factors, solves[2], solves[3]);
        for (k = 0; k < SURROGATE_TIME_STATES; k++) {
            const double difference = ((solves[0][k] - (3.0 * solves[1][k])) + (3.0 * solves[2][k])) - solves[3][k];
            error = error + (fabs(difference) * surrogate_reach[k]);
        }
        error = SURROGATE_ESTIMATE * error;
        if ((error > SURROGATE_TIME_TOLERANCE) && (length > (SURROGATE_SHORTEST * duration))) {
            next = 0.5 * length;
        } else {
            double grown = length;
            for (k = 0; k < SURROGATE_TIME_STATES; k++) {
                away[k] = ((first_weight * solves[0][k]) + (second_weight * solves[1][k])) + (third_weight * solves[2][k]);
            }
            left = left - length;
            if (error < (0.05 * SURROGATE_TIME_TOLERANCE)) {
                grown = 2.0 * length;
            }
            if ((is_last == 0) || (next <= grown)) {
                next = grown;
            }
        }
    }
    for (k = 0; k < SURROGATE_TIME_STATES; k++) {
        state->states[k] = steady[k] + away[k];
    }
    state->length = next;
}

int surrogate_step(surrogate_state *state, double duration, const double x[SURROGATE_VARIABLES])
{
    int result = -1;
    if ((surrogate_is_condition(x) != 0) && (surrogate_is_finite(duration) != 0) && (duration >= 0.0)) {
        surrogate_advance(state, duration, x);
        result = 0;
    }
    return result;
}

int surrogate_read(const surrogate_state *state, const double x[SURROGATE_VARIABLES], double values[SURROGATE_POINTS])
{
    double terms[SURROGATE_MOVING_TERMS];
    double steady[SURROGATE_TIME_STATES];
    double away[SURROGATE_TIME_STATES];
    double row[SURROGATE_TIME_STATES];
    int point;
    int k;
    int result = -1;
    if (surrogate_is_condition(x) != 0) {
        surrogate_evaluate(x, values);
        surrogate_steady_states(x, steady);
        surrogate_terms(x, surrogate_moving_scalings, surrogate_moving_exponents, SURROGATE_MOVING_TERMS, terms);
        for (k = 0; k < SURROGATE_TIME_STATES; k++) {
            away[k] = state->states[k] - steady[k];
        }
        for (point = 0; point < SURROGATE_POINTS; point++) {
            surrogate_combine(terms, SURROGATE_MOVING_TERMS, &surrogate_outputs[point * SURROGATE_MOVING_TERMS * SURROGATE_TIME_STATES], row);
            values[point] = values[point] + surrogate_dot(row, away);
        }
        result = 0;
    }
    return result;
}

int surrogate_slopes(const surrogate_state *state, const double x[SURROGATE_VARIABLES], double slopes[SURROGATE_TIME_STATES])
{
    double terms[SURROGATE_MOVING_TERMS];
    double steady[SURROGATE_TIME_STATES];
    int i;
    int k;
    int t;
    int result = -1;
    if (surrogate_is_condition(x) != 0) {
        surrogate_steady_states(x, steady);
        surrogate_terms(x, surrogate_moving_scalings, surrogate_moving_exponents, SURROGATE_MOVING_TERMS, terms);
        for (i = 0; i < SURROGATE_TIME_STATES; i++) {
            slopes[i] = 0.0;
        }
        for (t = 0; t < SURROGATE_MOVING_TERMS; t++) {
            for (k = 0; k < SURROGATE_TIME_STATES; k++) {
                const double away = terms[t] * (state->states[k] - steady[k]);
                for (i = 0; i < SURROGATE_TIME_STATES; i++) {
                    slopes[i] = slopes[i] - (away * surrogate_rates[(((t * SURROGATE_TIME_STATES) + k) * SURROGATE_TIME_STATES) + i]);
                }
            }
        }
        result = 0;
    }
    return result;
}

double surrogate_time_error(int point)
{
    return (surrogate_is_place(point, SURROGATE_POINTS) != 0) ? surrogate_time_errors[point] : 0.0;
}

//? end
//? single
double surrogate_value_error(int point)
{
    return (surrogate_is_place(point, SURROGATE_POINTS) != 0) ? surrogate_value_errors[point] : 0.0;
}

//? end
int surrogate_self_test(void)
{
    surrogate_band bands[SURROGATE_POINTS];
    double values[SURROGATE_POINTS];
    int failed = 0;
    int test;
    int point;
    for (test = 0; test < SURROGATE_SELF_TESTS; test++) {
        surrogate_bands(&surrogate_test_conditions[test * SURROGATE_VARIABLES], values, bands);
        for (point = 0; point < SURROGATE_POINTS; point++) {
            const double expected = surrogate_test_values[(test * SURROGATE_POINTS) + point];
            int close = 0;
//? single
            const double allowed = surrogate_value_errors[point] + (1e-6 * surrogate_greater(fabs(expected), 1.0));
//? else
            const double allowed = 1e-7 * surrogate_greater(fabs(expected), 1.0);
//? end
//? uncertain single
            const double share = 1e-3;
//? end
//? uncertain !single
            const double share = 1e-7;
//? end
            if (fabs(values[point] - expected) <= allowed) {
                close = 1;
            }
//? uncertain
            const double deviation = surrogate_test_deviations[(test * SURROGATE_POINTS) + point];
            if (!(fabs(bands[point].total - deviation) <= (share * surrogate_greater(deviation, 1.0)))) {
                close = 0;
            }
//? end
            if ((close == 0) && (failed == 0)) {
                failed = test + 1;
            }
        }
    }
    return failed;
}
