//! The machine that the tables are taken apart with: which numbers it may change, between which bounds, and why these.

/// A number that is to be found.
pub struct Number {
    /// Key of the machine file.
    pub key: &'static str,
    /// Meaning in words.
    pub what: &'static str,
    pub bounds: &'static str,
    /// Why these bounds.
    pub because: &'static str,
    /// Whether one value of it serves all tables together.
    pub is_common: bool,
    /// Tables in which it has a value of its own when they stand together.
    pub own: &'static [usize],
    /// Tables that can tell it alone.
    pub alone: &'static [usize],
    /// Sources whose heat it is.
    pub sources: &'static [&'static str],
}

/// Unpublished features of the motor group, changed before anything is found: the motor's flange is bolted to its base as well, and
/// the point of the base is where neck and deck meet, 7 cm nearer to the plates than in the machine file.
pub const CHANGES: [(&str, &str); 2] = [
    ("contact.y_motor_base", "{ between = [\"y_motor\", \"y_base\"], total_conductance = \"20 W/K\" }"),
    ("sensor.\"Y motor base\".point", "[\"100 mm\", \"240 mm\", \"25 mm\"]"),
];

const BOLTED: &str = "bolted metal in vacuum, 0.03 to 2 MPa (Cooper, Mikic, Yovanovich)";
const MOTOR: &str = "one hundredth: the heat of 250 r/min at a tenth; 1.1: efficiencies are printed to one digit";
const PRELOAD: &str = "from the published load without preload (0.05) to a preload of 10 kN at the heat of ten times the speed";

pub const NUMBERS: [Number; 11] = [
    Number {
        key: "contact.y_reducer.conductance",
        what: "joint of reducer and plate",
        bounds: "100 W/(m2 K)..5000 W/(m2 K)",
        because: BOLTED,
        is_common: true,
        own: &[],
        alone: &[7, 8],
        sources: &[],
    },
    Number {
        key: "contact.y_motor_base.total_conductance",
        what: "flange of the motor on its base",
        bounds: "0.01 W/K..70 W/K",
        because: "up to the motor's foot of 0.0143 m2 at 5000 W/(m2 K)",
        is_common: true,
        own: &[],
        alone: &[7],
        sources: &[],
    },
    Number {
        key: "contact.y_base.conductance",
        what: "joint of base and seat",
        bounds: "5 W/(m2 K)..5000 W/(m2 K)",
        because: "from a shim with a thermal break, as under the seats, to bolted metal",
        is_common: true,
        own: &[],
        alone: &[8, 9, 10],
        sources: &[],
    },
    Number {
        key: "contact.y_shaft.total_conductance",
        what: "joint of output shaft and reducer",
        bounds: "0.01 W/K..20 W/K",
        because: "up to a hub in the reducer's hollow shaft, 40 cm2 at 5000 W/(m2 K)",
        is_common: false,
        own: &[],
        alone: &[7, 8],
        sources: &[],
    },
    Number {
        key: "contact.y_screw_clamp.conductance",
        what: "joint of screw and coupling",
        bounds: "1 W/(m2 K)..5000 W/(m2 K)",
        because: "from a spider of elastomer, 0.2 W/(m K), through a part of the face, to clamped metal",
        is_common: true,
        own: &[],
        alone: &[7, 8],
        sources: &[],
    },
    Number {
        key: "source.y_motor.power",
        what: "heat of the motor",
        bounds: "0.01..1.1",
        because: MOTOR,
        is_common: false,
        own: &[8, 9, 10],
        alone: &[8, 9, 10],
        sources: &["y_motor"],
    },
    Number {
        key: "source.y_reducer.power",
        what: "heat of the reducer",
        bounds: "0.01..1.1",
        because: MOTOR,
        is_common: false,
        own: &[8, 9],
        alone: &[8, 9, 10],
        sources: &["y_reducer"],
    },
    Number {
        key: "source.y_bearing.power",
        what: "heat of the bearing, motor side",
        bounds: "0.05..33",
        because: PRELOAD,
        is_common: false,
        own: &[7, 8, 9, 10],
        alone: &[7, 8, 9, 10],
        sources: &["y_bearing"],
    },
    Number {
        key: "source.y_far_bearing.power",
        what: "heat of the bearing, far side",
        bounds: "0.05..33",
        because: PRELOAD,
        is_common: false,
        own: &[9, 10],
        alone: &[9, 10],
        sources: &["y_far_bearing"],
    },
    Number {
        key: "define.y_nut_and_screw_W",
        what: "heat of nut and screw",
        bounds: "0.05..33",
        because: PRELOAD,
        is_common: false,
        own: &[9, 10],
        alone: &[9, 10],
        sources: &["y_nut", "y_screw"],
    },
    Number {
        key: "define.y_guide_heat_W",
        what: "heat of the guides",
        bounds: "0.5..30",
        because: "twice the printed law, which halves the friction, with seals, at the heat of ten times the speed",
        is_common: false,
        own: &[10],
        alone: &[10],
        sources: &["y_sliders", "y_rails"],
    },
];

/// How a table is called in the data.
pub fn test(table: usize) -> String {
    format!("table {table}")
}

/// Free numbers, as `--free` has it: in one table alone, or in all together.
pub fn free(table: Option<usize>) -> Vec<String> {
    let of = |n: &Number| -> Vec<String> {
        match table {
            Some(table) if n.alone.contains(&table) => vec![format!("{}={}", n.key, n.bounds)],
            Some(_) => Vec::new(),
            None if n.is_common => vec![format!("{}={}", n.key, n.bounds)],
            None => n.own.iter().map(|t| format!("{}@{}={}", n.key, test(*t), n.bounds)).collect(),
        }
    };
    NUMBERS.iter().flat_map(of).collect()
}
