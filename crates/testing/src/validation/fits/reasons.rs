//! Why a published curve and ours differ: which other printed number it contradicts, or what is not published.

use crate::validation::fits::{Published, value};

/// For one row of Tables 7 to 10; the numbers are those of the printed (or corrected) curves.
pub fn reason(all: &[Published], table: usize, part: &str) -> String {
    let at = |table: usize, part: &str, x: f64| {
        all.iter().find(|p| p.table == table && p.part == part).map_or(f64::NAN, |p| value(p.curve(), x))
    };
    let motor_side = "bearing set of the motor side";
    // 1.57e-4 m3/s is held in Tables 8 to 10.
    const FLOW: f64 = 15.7;
    match (table, part) {
        (7, "bearing") => format!(
            "Table 9 has {:.1} at the same speed, flow and water with a chamber 3.5 K warmer, Table 10 moves it by {:.2} K per kelvin of chamber: {:.1} would follow here, not {:.1}",
            at(9, motor_side, 2500.0),
            (at(10, motor_side, 24.0) - at(10, motor_side, 18.0)) / 6.0,
            at(9, motor_side, 2500.0) - 3.5 * (at(10, motor_side, 24.0) - at(10, motor_side, 18.0)) / 6.0,
            at(7, "bearing", FLOW)
        ),
        (7, "motor base") => format!(
            "Table 9 has {:.2} at the same speed and flow in a warmer chamber, {:.2} here: a base cannot be colder for it",
            at(9, "motor base", 2500.0),
            at(7, "motor base", FLOW)
        ),
        (7, "reducer") => format!(
            "{:.1} K over its plate; 51.18 W through 510 W/(m2 K) and the flux area make {:.1} K. Table 9 has {:.2} for {:.2} here",
            at(7, "reducer", FLOW) - at(7, "reducer water-cooling plate", FLOW),
            51.178 / (510.0 * 0.018597),
            at(9, "reducer", 2500.0),
            at(7, "reducer", FLOW)
        ),
        (7, "motor") => format!(
            "{:.1} K over its plate, as 113.7 W through 560 W/(m2 K) and the flux area make ({:.1} K), not the 15 K of the rig; Table 9 has {:.2} for {:.2} here",
            at(7, "motor", FLOW) - at(7, "motor water-cooling plate", FLOW),
            113.729 / (560.0 * 0.042992),
            at(9, "motor", 2500.0),
            at(7, "motor", FLOW)
        ),
        (7, _) => format!("at 250 r/min Table 8 has {:.2}; heats of the joints beyond are not published", at(8, "coupling", 20.0)),
        (8, "reducer water-cooling plate") => format!(
            "{:.2} at 20 °C of water, hotter than the reducer that heats it ({:.2}); Table 9 has {:.2}",
            at(8, part, 20.0),
            at(8, "reducer", 20.0),
            at(9, "water-cooling plate", 250.0)
        ),
        (8, "reducer" | "motor") => format!(
            "{:.2} at 20 °C of water where Table 9 has {:.2} at 250 and {:.2} at the 2500 r/min printed here; {:.2} in Table 7 in a colder chamber",
            at(8, part, 20.0),
            at(9, part, 250.0),
            at(9, part, 2500.0),
            at(7, part, FLOW)
        ),
        (8, "bearing") => format!(
            "{:.2} at 20 °C of water; Table 9 has {:.2} at 250 and {:.2} at 2500 r/min, same chamber and flow",
            at(8, part, 20.0),
            at(9, motor_side, 250.0),
            at(9, motor_side, 2500.0)
        ),
        (8, "coupling") => format!(
            "{:.2} at 20 °C of water, {:.2} in Table 7 in a chamber 3.5 K colder; what joins it to reducer and screw is not published",
            at(8, part, 20.0),
            at(7, part, FLOW)
        ),
        (8, _) => format!(
            "{:.2} at 20 °C of water, {:.2} in Table 9 at 250 r/min, {:.2} at the printed 2500: run at 250. The point of the base is not published; theirs is nearer to the plates",
            at(8, part, 20.0),
            at(9, part, 250.0),
            at(9, part, 2500.0)
        ),
        (9, "water-cooling plate") => format!(
            "{:.2} at 2500 r/min, hotter than the motor on it ({:.2}); Table 7 has {:.2}: rows mislabelled",
            at(9, part, 2500.0),
            at(9, "motor", 2500.0),
            at(7, "motor water-cooling plate", FLOW)
        ),
        (9, "motor" | "reducer") => {
            let rise = |t: usize, x: f64| at(t, part, x) - 20.0;
            format!(
                "{:.2} K over the water at 2500 r/min, {:.2} in Table 7: a heat {:.0} times smaller",
                rise(9, 2500.0),
                rise(7, FLOW),
                rise(7, FLOW) / rise(9, 2500.0)
            )
        }
        (9, "motor base") => format!("{:.2} at 2500 r/min, {:.2} in Table 7 in a colder chamber", at(9, part, 2500.0), at(7, part, FLOW)),
        (9, "bearing set of the motor side") => format!(
            "{:.2} at 250 r/min, {:.2} in Table 10 and {:.2} in Table 8 at the same condition",
            at(9, part, 250.0),
            at(10, part, 23.5),
            at(8, "bearing", 20.0)
        ),
        (9, "bearing set of the non-motor side") => {
            format!("{:.2} at 250 r/min, {:.2} in Table 10 at the same condition", at(9, part, 250.0), at(10, part, 23.5))
        }
        (9, "nut") => format!("{:.2} at 250 r/min, {:.2} in Table 10 at the same condition", at(9, part, 250.0), at(10, part, 23.5)),
        (9, _) => format!(
            "as printed {:.2} at 2500 r/min, a heated part below its chamber: the sign of the slope; {:.2} at 250 against {:.2} in Table 10",
            all.iter().find(|p| p.table == 9 && p.part == part).map_or(f64::NAN, |p| value(&p.printed, 2500.0)),
            at(9, part, 250.0),
            at(10, part, 23.5)
        ),
        (10, "motor base") => {
            format!(
                "printed without the exponent of its square; follows the chamber by {:.2} K per kelvin, ours by more: the point is not published",
                (at(10, part, 24.0) - at(10, part, 18.0)) / 6.0
            )
        }
        (10, "nut" | "slider" | "bearing set of the non-motor side" | "bearing set of the motor side") => format!(
            "{:.2} in a chamber of 23.5 °C, printed for 250 r/min; Table 9 has {:.2} at 250 and {:.2} at 2500 r/min",
            at(10, part, 23.5),
            at(9, part, 250.0),
            at(9, part, 2500.0)
        ),
        (10, "motor" | "reducer") => format!(
            "{:.2} K over the water with the 11.4 and 5.1 W of 250 r/min; Table 7 asks for a tenth of {:.2} K",
            at(10, part, 23.5) - 20.0,
            at(7, part, FLOW) - 20.0
        ),
        _ => "as printed below its water".into(),
    }
}
