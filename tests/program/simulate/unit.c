/* Runs a functional mock-up unit (version 2, co-simulation) from one temperature everywhere: for each row of the standard input, the
 * seconds and the inputs of a step, it prints the points after the step. */
#include "motor_fmi2.c"

#include <stdio.h>

int main(void)
{
    const fmi2ValueReference start = MOTOR_INITIAL_AT, rest = MOTOR_AT_REST_AT;
    const fmi2Boolean no = 0;
    fmi2ValueReference inputs[MOTOR_VARIABLES], points[MOTOR_POINTS];
    fmi2Real seconds, x[MOTOR_VARIABLES], now[MOTOR_POINTS], time = 0.0, from;
    fmi2Component unit = FMI2(fmi2Instantiate)("unit", fmi2CoSimulation, MOTOR_TOKEN, "", NULL, 0, 0);
    size_t i;
    for (i = 0; i < MOTOR_VARIABLES; i++) {
        inputs[i] = (fmi2ValueReference)i;
    }
    for (i = 0; i < MOTOR_POINTS; i++) {
        points[i] = (fmi2ValueReference)(MOTOR_NOW_AT + i);
    }
    if ((unit == NULL) || (scanf("%lf", &from) != 1)) {
        return 1;
    }
    if ((FMI2(fmi2SetReal)(unit, &start, 1, &from) != fmi2OK) || (FMI2(fmi2SetBoolean)(unit, &rest, 1, &no) != fmi2OK)
        || (FMI2(fmi2EnterInitializationMode)(unit) != fmi2OK) || (FMI2(fmi2ExitInitializationMode)(unit) != fmi2OK)) {
        return 2;
    }
    while (scanf("%lf", &seconds) == 1) {
        for (i = 0; i < MOTOR_VARIABLES; i++) {
            if (scanf("%lf", &x[i]) != 1) {
                return 3;
            }
        }
        if ((FMI2(fmi2SetReal)(unit, inputs, MOTOR_VARIABLES, x) != fmi2OK) || (FMI2(fmi2DoStep)(unit, time, seconds, 1) != fmi2OK)
            || (FMI2(fmi2GetReal)(unit, points, MOTOR_POINTS, now) != fmi2OK)) {
            return 4;
        }
        time += seconds;
        for (i = 0; i < MOTOR_POINTS; i++) {
            printf("%.9f ", now[i]);
        }
        printf("\n");
    }
    return 0;
}
