/* Sums whose parts cancel keep the digits that remain: every number in them is the sum of two, the second below the last
   place of the first (Dekker 1971). */
static surrogate_pair surrogate_alone(double x)
{
    surrogate_pair alone;
    alone.high = x;
    alone.low = 0.0;
    return alone;
}

/* The same number as a pair; the second part is below the first. */
static surrogate_pair surrogate_settled(double high, double low)
{
    surrogate_pair pair;
    pair.high = high + low;
    pair.low = low - (pair.high - high);
    return pair;
}

static surrogate_pair surrogate_negative(surrogate_pair a)
{
    surrogate_pair negative;
    negative.high = -a.high;
    negative.low = -a.low;
    return negative;
}

static surrogate_pair surrogate_plus(surrogate_pair a, surrogate_pair b)
{
    const double sum = a.high + b.high;
    const double part = sum - a.high;
    const double lost = (a.high - (sum - part)) + (b.high - part);
    return surrogate_settled(sum, lost + (a.low + b.low));
}

/* What rounding the product of two numbers leaves out. */
static double surrogate_lost(double a, double b, double product)
{
#ifdef FP_FAST_FMAF
    return fma(a, b, -product);
#else
    const double wide_a = 4097.0 * a;
    const double wide_b = 4097.0 * b;
    const double high_a = wide_a - (wide_a - a);
    const double high_b = wide_b - (wide_b - b);
    const double low_a = a - high_a;
    const double low_b = b - high_b;
    return (((high_a * high_b) - product) + ((high_a * low_b) + (low_a * high_b))) + (low_a * low_b);
#endif
}

static surrogate_pair surrogate_times(surrogate_pair a, surrogate_pair b)
{
    const double product = a.high * b.high;
    const double lost = surrogate_lost(a.high, b.high, product);
    return surrogate_settled(product, lost + ((a.high * b.low) + (a.low * b.high)));
}

//? pair_quotient
static surrogate_pair surrogate_quotient(surrogate_pair a, surrogate_pair b)
{
    const double quotient = a.high / b.high;
    const surrogate_pair back = surrogate_times(surrogate_alone(quotient), b);
    return surrogate_settled(quotient, ((a.high - back.high) + (a.low - back.low)) / b.high);
}

//? end
//? pair_root
static surrogate_pair surrogate_pair_root(surrogate_pair a)
{
    surrogate_pair root = surrogate_alone(a.high);
    if (a.high > 0.0) {
        const double first = sqrt(a.high);
        const double square = first * first;
        const double rest = ((a.high - square) - surrogate_lost(first, first, square)) + a.low;
        root = surrogate_settled(first, rest / (first + first));
    }
    return root;
}

//? end
//? pair_exp
/* From where on exp(-x) is zero in pairs. */
#define SURROGATE_PAIR_FAR 87.0

static surrogate_pair surrogate_pair_exp(surrogate_pair x)
{
    static const surrogate_pair ln2 = {0.6931471824645996, -1.9046542121259336e-9};
    /* 1/7!, 1/6!, ..., 1/0! */
    static const surrogate_pair series[8] = {
        {0.00019841270113829523, -2.725596874933456e-12},
        {0.0013888889225199819, -3.3631094437103215e-11},
        {0.008333333767950535, -4.34617203337595e-10},
        {0.0416666679084301, -1.2417634698280722e-9},
        {0.1666666716337204, -4.967053879312289e-9},
        {0.5, 0.0},
        {1.0, 0.0},
        {1.0, 0.0}
    };
    surrogate_pair result = surrogate_alone((x.high < -SURROGATE_PAIR_FAR) ? 0.0 : x.high);
    int i;
    if (x.high >= -SURROGATE_PAIR_FAR) {
        const double k = nearbyint(x.high * 1.4426950408889634);
        const surrogate_pair r = surrogate_plus(x, surrogate_times(surrogate_alone(-k), ln2));
        /* What is left of the series is small enough for its first digits to do. */
        double rest = 1.0 / 6227020800.0;
        rest = (rest * r.high) + (1.0 / 479001600.0);
        rest = (rest * r.high) + (1.0 / 39916800.0);
        rest = (rest * r.high) + (1.0 / 3628800.0);
        rest = (rest * r.high) + (1.0 / 362880.0);
        rest = (rest * r.high) + (1.0 / 40320.0);
        result = surrogate_alone(rest);
        for (i = 0; i < 8; i++) {
            result = surrogate_plus(surrogate_times(result, r), series[i]);
        }
        result.high = ldexp(result.high, (int)k);
        result.low = ldexp(result.low, (int)k);
    }
    return result;
}

//? end
//? pair_ln
/* ln x, from its first digits y: ln x = y + ln(x exp(-y)). */
static surrogate_pair surrogate_pair_ln(surrogate_pair x)
{
    surrogate_pair result = surrogate_alone(log(x.high));
    if ((x.high >= SURROGATE_TINY) && (surrogate_is_finite(x.high) != 0)) {
        const double first = surrogate_ln_normal(x.high);
        const surrogate_pair ratio = surrogate_times(x, surrogate_pair_exp(surrogate_alone(-first)));
        const double rest = (ratio.high - 1.0) + ratio.low;
        result = surrogate_settled(first, rest - ((0.5 * rest) * rest));
    }
    return result;
}

//? end
static void surrogate_pair_scale(const double x[SURROGATE_VARIABLES], const unsigned char *scalings, surrogate_pair u[SURROGATE_VARIABLES])
{
    int v;
    for (v = 0; v < SURROGATE_VARIABLES; v++) {
        const surrogate_pair_scaling *const own = &surrogate_pair_scalings[scalings[v]];
        surrogate_pair g = surrogate_alone(x[v]);
//? reciprocal
        if (own->transform == 1) {
            g = surrogate_quotient(surrogate_alone(1.0), g);
        }
//? end
//? log
        if (own->transform == 2) {
            g = surrogate_pair_ln(g);
        }
//? end
        u[v] = surrogate_plus(surrogate_times(surrogate_plus(g, surrogate_negative(own->low)), own->factor), own->offset);
    }
}

/* A coordinate's share in the distance to a centre. */
static surrogate_pair surrogate_distance(const surrogate_basis_entry *basis, const surrogate_pair u[SURROGATE_VARIABLES], int centre, int v)
{
    const surrogate_pair away = surrogate_plus(u[v], surrogate_negative(basis->centres[(centre * SURROGATE_VARIABLES) + v]));
    return surrogate_times(away, basis->scales[v]);
}

static surrogate_pair surrogate_squared_distance(const surrogate_basis_entry *basis, const surrogate_pair u[SURROGATE_VARIABLES], int centre)
{
    surrogate_pair square = surrogate_alone(0.0);
    int v;
    for (v = 0; v < SURROGATE_VARIABLES; v++) {
        const surrogate_pair d = surrogate_distance(basis, u, centre, v);
        square = surrogate_plus(square, surrogate_times(d, d));
    }
    return square;
}

/* Squared distances become kernel values. */
static surrogate_pair surrogate_kernel(int kernel, surrogate_pair square)
{
    surrogate_pair value = surrogate_alone(0.0);
//? thin_plate
    if (kernel == 0) {
        const surrogate_pair normal = (square.high < SURROGATE_TINY) ? surrogate_alone(SURROGATE_TINY) : square;
        value = surrogate_times(surrogate_times(surrogate_alone(0.5), square), surrogate_pair_ln(normal));
    }
//? end
//? cubic
    if (kernel == 1) {
        value = surrogate_times(square, surrogate_pair_root(square));
    }
//? end
//? multiquadric
    if (kernel == 2) {
        value = surrogate_pair_root(surrogate_plus(surrogate_alone(1.0), square));
    }
//? end
//? gaussian
    if (kernel == 3) {
        value = surrogate_pair_exp(surrogate_negative(square));
    }
//? end
    return value;
}

/* Twice the derivative of the kernel along the squared distance; zero at a centre. */
static surrogate_pair surrogate_twice_kernel_slope(int kernel, surrogate_pair square)
{
    surrogate_pair value = surrogate_alone(0.0);
//? thin_plate
    if ((kernel == 0) && (square.high >= SURROGATE_TINY)) {
        value = surrogate_plus(surrogate_pair_ln(square), surrogate_alone(1.0));
    }
//? end
//? cubic
    if (kernel == 1) {
        value = surrogate_times(surrogate_alone(3.0), surrogate_pair_root(square));
    }
//? end
//? multiquadric
    if (kernel == 2) {
        value = surrogate_quotient(surrogate_alone(1.0), surrogate_pair_root(surrogate_plus(surrogate_alone(1.0), square)));
    }
//? end
//? gaussian
    if (kernel == 3) {
        value = surrogate_times(surrogate_alone(-2.0), surrogate_pair_exp(surrogate_negative(square)));
    }
//? end
    return value;
}

/* Adds the bases to the values of the points. */
static void surrogate_add_bases(const double x[SURROGATE_VARIABLES], double values[SURROGATE_POINTS])
{
    surrogate_pair u[SURROGATE_VARIABLES];
    surrogate_pair sums[SURROGATE_POINTS];
    int model;
    int centre;
    int c;
    for (model = 0; model < SURROGATE_BASES; model++) {
        const surrogate_basis_entry *const own = &surrogate_bases[model];
        surrogate_pair_scale(x, own->scalings, u);
        for (c = 0; c < own->columns; c++) {
            sums[c] = surrogate_alone(0.0);
        }
        for (centre = 0; centre < own->count; centre++) {
            const surrogate_pair value = surrogate_kernel(own->kernel, surrogate_squared_distance(own, u, centre));
            for (c = 0; c < own->columns; c++) {
                sums[c] = surrogate_plus(sums[c], surrogate_times(value, own->weights[(centre * own->columns) + c]));
            }
        }
        for (c = 0; c < own->columns; c++) {
            values[own->points[c]] = values[own->points[c]] + sums[c].high;
        }
    }
}

/* Derivatives of one column of a basis along the scaled variables. */
static void surrogate_basis_slopes(const double x[SURROGATE_VARIABLES], const surrogate_basis_entry *own, int column, double slopes[SURROGATE_VARIABLES])
{
    surrogate_pair u[SURROGATE_VARIABLES];
    surrogate_pair sums[SURROGATE_VARIABLES];
    int centre;
    int v;
    surrogate_pair_scale(x, own->scalings, u);
    for (v = 0; v < SURROGATE_VARIABLES; v++) {
        sums[v] = surrogate_alone(0.0);
    }
    for (centre = 0; centre < own->count; centre++) {
        const surrogate_pair square = surrogate_squared_distance(own, u, centre);
        const surrogate_pair slope = surrogate_times(own->weights[(centre * own->columns) + column], surrogate_twice_kernel_slope(own->kernel, square));
        for (v = 0; v < SURROGATE_VARIABLES; v++) {
            const surrogate_pair pull = surrogate_times(surrogate_distance(own, u, centre, v), own->scales[v]);
            sums[v] = surrogate_plus(sums[v], surrogate_times(slope, pull));
        }
    }
    for (v = 0; v < SURROGATE_VARIABLES; v++) {
        slopes[v] = sums[v].high;
    }
}
