/* Opens a surrogate file and assesses the middle of its fitted range; where it moves, also ten minutes of it: query FILE */
#include <stdio.h>
#include <stdlib.h>

#include "coldplate.h"

#define MOST_VARIABLES 8
#define MOST_POINTS 256

int main(int count, char **arguments)
{
    static uint8_t bytes[1 << 20];
    double x[MOST_VARIABLES];
    double values[MOST_POINTS];
    coldplate_band bands[MOST_POINTS];
    coldplate_surrogate *surrogate = NULL;
    coldplate_verdict verdict;
    size_t length;
    size_t i;
    int code;
    FILE *file = (count == 2) ? fopen(arguments[1], "rb") : NULL;

    if (file == NULL) {
        fputs("usage: query FILE\n", stderr);
        return EXIT_FAILURE;
    }
    length = fread(bytes, 1, sizeof bytes, file);
    fclose(file);
    code = coldplate_open(bytes, length, &surrogate);
    if (code != COLDPLATE_DONE) {
        fprintf(stderr, "%s\n", coldplate_error_text(code));
        return EXIT_FAILURE;
    }
    for (i = 0; i < coldplate_variables(surrogate); i++) {
        coldplate_entry entry;
        if (coldplate_variable(surrogate, i, &entry) == COLDPLATE_DONE) {
            x[i] = 0.5 * (entry.low + entry.high);
            printf("%.*s %.17g %.*s\n", (int)entry.name.length, entry.name.data, x[i], (int)entry.unit.length, entry.unit.data);
        }
    }
    code = coldplate_assess(surrogate, x, coldplate_variables(surrogate), 0.95, values, bands, coldplate_points(surrogate), &verdict);
    if (code == COLDPLATE_DONE) {
        for (i = 0; i < coldplate_points(surrogate); i++) {
            printf("%.17g %.17g\n", values[i], bands[i].total);
        }
        printf("%d %d %.17g\n", verdict.state, verdict.binding, verdict.probability);
    }
    if (code == COLDPLATE_DONE && coldplate_states(surrogate) > 0) {
        /* Ten minutes from 20 degrees everywhere. */
        coldplate_state state;
        code = coldplate_at_temperature(surrogate, 20.0, &state);
        if (code == COLDPLATE_DONE) {
            code = coldplate_step(surrogate, &state, 600.0, x, coldplate_variables(surrogate));
        }
        if (code == COLDPLATE_DONE) {
            code = coldplate_read(surrogate, &state, x, coldplate_variables(surrogate), values, coldplate_points(surrogate));
        }
        for (i = 0; code == COLDPLATE_DONE && i < coldplate_points(surrogate); i++) {
            printf("%.17g\n", values[i]);
        }
    }
    coldplate_close(surrogate);
    return (code == COLDPLATE_DONE) ? EXIT_SUCCESS : EXIT_FAILURE;
}
