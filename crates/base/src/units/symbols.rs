//! Unit symbols, and wrong spellings of them.

use std::borrow::Cow;

use super::Dimension;

/// Unit symbols: name, factor to SI, dimension. Prefixes are written out where they are in use.
pub(super) const UNITS: &[(&str, f64, Dimension)] = &[
    ("m", 1.0, Dimension::LENGTH),
    ("cm", 1e-2, Dimension::LENGTH),
    ("mm", 1e-3, Dimension::LENGTH),
    ("um", 1e-6, Dimension::LENGTH),
    ("km", 1e3, Dimension::LENGTH),
    ("nm", 1e-9, Dimension::LENGTH),
    ("L", 1e-3, Dimension::VOLUME),
    ("l", 1e-3, Dimension::VOLUME),
    ("mL", 1e-6, Dimension::VOLUME),
    ("kg", 1.0, Dimension::MASS),
    ("g", 1e-3, Dimension::MASS),
    ("t", 1e3, Dimension::MASS),
    ("s", 1.0, Dimension::TIME),
    ("ms", 1e-3, Dimension::TIME),
    ("min", 60.0, Dimension::TIME),
    ("h", 3600.0, Dimension::TIME),
    ("d", 86400.0, Dimension::TIME),
    ("K", 1.0, Dimension::DIFFERENCE),
    ("degC", 1.0, Dimension::DIFFERENCE),
    ("°C", 1.0, Dimension::DIFFERENCE),
    ("rpm", std::f64::consts::PI / 30.0, Dimension::ANGULAR_SPEED),
    ("Hz", 2.0 * std::f64::consts::PI, Dimension::ANGULAR_SPEED),
    ("rad", 1.0, Dimension::NUMBER),
    ("deg", std::f64::consts::PI / 180.0, Dimension::NUMBER),
    ("%", 1e-2, Dimension::NUMBER),
    ("1", 1.0, Dimension::NUMBER),
    ("W", 1.0, Dimension::POWER),
    ("mW", 1e-3, Dimension::POWER),
    ("kW", 1e3, Dimension::POWER),
    ("MW", 1e6, Dimension::POWER),
    // 550 foot-pounds of force per second.
    ("hp", 745.699_871_582_270_2, Dimension::POWER),
    // 75 metres times kilograms of force per second.
    ("PS", 735.498_75, Dimension::POWER),
    ("J", 1.0, Dimension::TORQUE),
    ("kJ", 1e3, Dimension::TORQUE),
    ("MJ", 1e6, Dimension::TORQUE),
    ("GJ", 1e9, Dimension::TORQUE),
    // International table calorie of 4.1868 J times pound and degree Fahrenheit, ISO 80000-5.
    ("Btu", 1_055.055_852_62, Dimension::TORQUE),
    ("N", 1.0, Dimension::FORCE),
    ("kN", 1e3, Dimension::FORCE),
    ("Pa", 1.0, Dimension::PRESSURE),
    ("hPa", 1e2, Dimension::PRESSURE),
    ("kPa", 1e3, Dimension::PRESSURE),
    ("MPa", 1e6, Dimension::PRESSURE),
    ("GPa", 1e9, Dimension::PRESSURE),
    ("bar", 1e5, Dimension::PRESSURE),
    ("mbar", 1e2, Dimension::PRESSURE),
    ("mPa", 1e-3, Dimension::PRESSURE),
    ("cSt", 1e-6, Dimension::of(2, 0, -1, 0)),
    ("A", 1.0, Dimension::CURRENT),
    ("mA", 1e-3, Dimension::CURRENT),
    ("V", 1.0, Dimension::VOLTAGE),
    ("mV", 1e-3, Dimension::VOLTAGE),
    ("Ohm", 1.0, Dimension::RESISTANCE),
    ("mOhm", 1e-3, Dimension::RESISTANCE),
    ("kOhm", 1e3, Dimension::RESISTANCE),
    ("inch", 0.0254, Dimension::LENGTH),
    ("ft", 0.3048, Dimension::LENGTH),
    ("lbm", 0.453_592_37, Dimension::MASS),
    ("lbf", 4.448_221_615_260_5, Dimension::FORCE),
    ("psi", 6_894.757_293_168_361, Dimension::PRESSURE),
    // United States liquid gallons per minute, of 231 cubic inches each.
    ("gpm", 3.785_411_784e-3 / 60.0, Dimension::VOLUME_FLOW),
    ("degF", 5.0 / 9.0, Dimension::DIFFERENCE),
    ("°F", 5.0 / 9.0, Dimension::DIFFERENCE),
    ("degR", 5.0 / 9.0, Dimension::DIFFERENCE),
];

/// Wrong spellings of units, each with the right symbol.
pub(super) const MISTAKEN: &[(&str, &str)] = &[
    ("C", "degC"),
    ("Celsius", "degC"),
    ("celsius", "degC"),
    ("grad", "degC"),
    ("F", "degF"),
    ("Fahrenheit", "degF"),
    ("Kelvin", "K"),
    ("kelvin", "K"),
    ("in", "inch"),
    ("lb", "lbm or lbf"),
    ("Nm", "N m"),
    ("lpm", "L/min"),
    ("LPM", "L/min"),
    ("GPM", "gpm"),
    ("U", "rpm"),
    ("hr", "h"),
    ("Watt", "W"),
    ("pa", "Pa"),
    ("kw", "kW"),
    ("w", "W"),
    ("BTU", "Btu"),
    ("btu", "Btu"),
    ("HP", "hp"),
    ("ohm", "Ohm"),
    ("Amp", "A"),
    ("Volt", "V"),
    ("sec", "s"),
    ("Sec", "s"),
    ("secs", "s"),
    ("second", "s"),
    ("seconds", "s"),
    ("Seconds", "s"),
    ("Sekunden", "s"),
    ("Min", "min"),
    ("mins", "min"),
    ("minute", "min"),
    ("minutes", "min"),
    ("Minutes", "min"),
    ("Minuten", "min"),
    ("hrs", "h"),
    ("hour", "h"),
    ("hours", "h"),
    ("Hours", "h"),
    ("Stunden", "h"),
    ("watt", "W"),
    ("watts", "W"),
    ("Watts", "W"),
    ("KW", "kW"),
    ("Kw", "kW"),
];

/// Characters that keyboards, fonts and loggers put in place of those in [`UNITS`], each with the right spelling. The letter ø is
/// the degree sign of code page 850 read as Windows-1252.
const LOOK_ALIKES: &[(&str, &str)] = &[
    ("\u{2103}", "°C"),
    ("\u{2109}", "°F"),
    ("\u{c2}\u{b0}", "°"),
    ("\u{ba}", "°"),
    ("\u{2da}", "°"),
    ("\u{2218}", "°"),
    ("øC", "°C"),
    ("øF", "°F"),
    ("µ", "u"),
    ("μ", "u"),
    ("Ω", "Ohm"),
    ("\u{2126}", "Ohm"),
    ("\u{a0}", " "),
    ("\u{202f}", " "),
    ("\u{2009}", " "),
    ("° ", "°"),
];

/// A unit with its look-alikes replaced.
pub(super) fn plain(text: &str) -> Cow<'_, str> {
    let mut plain = Cow::Borrowed(text.trim());
    for (wrong, right) in LOOK_ALIKES {
        if plain.contains(wrong) {
            plain = Cow::Owned(plain.replace(wrong, right));
        }
    }
    plain
}
