
/* There are no variables of the other types, and none but those of Float64 can be set. */
#define SURROGATE_NO_GET(type, name) \
    fmi3Status FMI3(fmi3Get##name)(fmi3Instance c, const fmi3ValueReference references[], size_t n, type values[], size_t n_values) \
    { \
        (void)c; \
        (void)references; \
        (void)values; \
        (void)n_values; \
        return surrogate_status((n == 0U) ? 1 : 0); \
    }
#define SURROGATE_NO_SET(type, name) \
    fmi3Status FMI3(fmi3Set##name)(fmi3Instance c, const fmi3ValueReference references[], size_t n, const type values[], size_t n_values) \
    { \
        (void)c; \
        (void)references; \
        (void)values; \
        (void)n_values; \
        return surrogate_status((n == 0U) ? 1 : 0); \
    }
SURROGATE_NO_GET(float, Float32)
SURROGATE_NO_GET(int8_t, Int8)
SURROGATE_NO_GET(uint8_t, UInt8)
SURROGATE_NO_GET(int16_t, Int16)
SURROGATE_NO_GET(uint16_t, UInt16)
SURROGATE_NO_GET(int32_t, Int32)
SURROGATE_NO_GET(uint32_t, UInt32)
SURROGATE_NO_GET(uint64_t, UInt64)
SURROGATE_NO_GET(fmi3String, String)
SURROGATE_NO_SET(float, Float32)
SURROGATE_NO_SET(int8_t, Int8)
SURROGATE_NO_SET(uint8_t, UInt8)
SURROGATE_NO_SET(int16_t, Int16)
SURROGATE_NO_SET(uint16_t, UInt16)
SURROGATE_NO_SET(int32_t, Int32)
SURROGATE_NO_SET(uint32_t, UInt32)
SURROGATE_NO_SET(int64_t, Int64)
SURROGATE_NO_SET(uint64_t, UInt64)
SURROGATE_NO_SET(fmi3String, String)

fmi3Status FMI3(fmi3GetBinary)(fmi3Instance c, const fmi3ValueReference references[], size_t n, size_t sizes[], const fmi3Byte *values[], size_t n_values)
{
    (void)c;
    (void)references;
    (void)sizes;
    (void)values;
    (void)n_values;
    return surrogate_status((n == 0U) ? 1 : 0);
}

fmi3Status FMI3(fmi3SetBinary)(fmi3Instance c, const fmi3ValueReference references[], size_t n, const size_t sizes[], const fmi3Byte *const values[], size_t n_values)
{
    (void)c;
    (void)references;
    (void)sizes;
    (void)values;
    (void)n_values;
    return surrogate_status((n == 0U) ? 1 : 0);
}

fmi3Status FMI3(fmi3GetClock)(fmi3Instance c, const fmi3ValueReference references[], size_t n, fmi3Boolean values[])
{
    (void)c;
    (void)references;
    (void)values;
    return surrogate_status((n == 0U) ? 1 : 0);
}

fmi3Status FMI3(fmi3SetClock)(fmi3Instance c, const fmi3ValueReference references[], size_t n, const fmi3Boolean values[])
{
    (void)c;
    (void)references;
    (void)values;
    return surrogate_status((n == 0U) ? 1 : 0);
}

/* Every output depends on every variable. */
fmi3Status FMI3(fmi3GetNumberOfVariableDependencies)(fmi3Instance c, fmi3ValueReference reference, size_t *n)
{
    (void)c;
    (void)reference;
    *n = 0U;
    return fmi3Error;
}

fmi3Status FMI3(fmi3GetVariableDependencies)(fmi3Instance c, fmi3ValueReference dependent, size_t elements[], fmi3ValueReference independents[], size_t independent_elements[], int kinds[], size_t n)
{
    (void)c;
    (void)dependent;
    (void)elements;
    (void)independents;
    (void)independent_elements;
    (void)kinds;
    (void)n;
    return fmi3Error;
}

fmi3Status FMI3(fmi3GetAdjointDerivative)(fmi3Instance c, const fmi3ValueReference unknowns[], size_t n_unknowns, const fmi3ValueReference knowns[], size_t n_knowns, const fmi3Float64 seeds[], size_t n_seeds, fmi3Float64 sensitivities[], size_t n_sensitivities)
{
    (void)c;
    (void)unknowns;
    (void)n_unknowns;
    (void)knowns;
    (void)n_knowns;
    (void)seeds;
    (void)n_seeds;
    (void)sensitivities;
    (void)n_sensitivities;
    return fmi3Error;
}

fmi3Status FMI3(fmi3EnterConfigurationMode)(fmi3Instance c)
{
    (void)c;
    return fmi3Error;
}

fmi3Status FMI3(fmi3ExitConfigurationMode)(fmi3Instance c)
{
    (void)c;
    return fmi3Error;
}

fmi3Status FMI3(fmi3GetIntervalDecimal)(fmi3Instance c, const fmi3ValueReference references[], size_t n, fmi3Float64 intervals[], int qualifiers[])
{
    (void)c;
    (void)references;
    (void)intervals;
    (void)qualifiers;
    return surrogate_status((n == 0U) ? 1 : 0);
}

fmi3Status FMI3(fmi3GetIntervalFraction)(fmi3Instance c, const fmi3ValueReference references[], size_t n, uint64_t counters[], uint64_t resolutions[], int qualifiers[])
{
    (void)c;
    (void)references;
    (void)counters;
    (void)resolutions;
    (void)qualifiers;
    return surrogate_status((n == 0U) ? 1 : 0);
}

fmi3Status FMI3(fmi3GetShiftDecimal)(fmi3Instance c, const fmi3ValueReference references[], size_t n, fmi3Float64 shifts[])
{
    (void)c;
    (void)references;
    (void)shifts;
    return surrogate_status((n == 0U) ? 1 : 0);
}

fmi3Status FMI3(fmi3GetShiftFraction)(fmi3Instance c, const fmi3ValueReference references[], size_t n, uint64_t counters[], uint64_t resolutions[])
{
    (void)c;
    (void)references;
    (void)counters;
    (void)resolutions;
    return surrogate_status((n == 0U) ? 1 : 0);
}

fmi3Status FMI3(fmi3SetIntervalDecimal)(fmi3Instance c, const fmi3ValueReference references[], size_t n, const fmi3Float64 intervals[])
{
    (void)c;
    (void)references;
    (void)intervals;
    return surrogate_status((n == 0U) ? 1 : 0);
}

fmi3Status FMI3(fmi3SetIntervalFraction)(fmi3Instance c, const fmi3ValueReference references[], size_t n, const uint64_t counters[], const uint64_t resolutions[])
{
    (void)c;
    (void)references;
    (void)counters;
    (void)resolutions;
    return surrogate_status((n == 0U) ? 1 : 0);
}

fmi3Status FMI3(fmi3SetShiftDecimal)(fmi3Instance c, const fmi3ValueReference references[], size_t n, const fmi3Float64 shifts[])
{
    (void)c;
    (void)references;
    (void)shifts;
    return surrogate_status((n == 0U) ? 1 : 0);
}

fmi3Status FMI3(fmi3SetShiftFraction)(fmi3Instance c, const fmi3ValueReference references[], size_t n, const uint64_t counters[], const uint64_t resolutions[])
{
    (void)c;
    (void)references;
    (void)counters;
    (void)resolutions;
    return surrogate_status((n == 0U) ? 1 : 0);
}

fmi3Status FMI3(fmi3ActivateModelPartition)(fmi3Instance c, fmi3ValueReference clock, fmi3Float64 time)
{
    (void)c;
    (void)clock;
    (void)time;
    return fmi3Error;
}
