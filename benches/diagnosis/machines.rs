//! The machines of the benchmark: two rigs in vacuum, a spindle of two circuits, a lumped cabinet in air; in steady tables and logs.

use coldplate_base::document::Document;
use coldplate_base::random::Random;

use coldplate_testing::machines::SMALL;
use coldplate_testing::twin::between;

/// A machine with the kind of data that is had from it.
pub struct Setting {
    /// Its name.
    pub name: &'static str,
    /// Share of the cases, in per cent.
    pub share: f64,
    /// Cells of the model that diagnoses, and the least and most of the truth; none of a lumped machine.
    pub cells: Option<[usize; 3]>,
    /// Length of a log, s; none of steady tables.
    pub log: Option<f64>,
    sizes: &'static [Size],
}

/// What of a machine can be a little larger or smaller than drawn, without its parts coming apart.
enum Size {
    /// Edges of a box, mm, and which of them.
    Box(&'static str, [f64; 3], [bool; 3]),
    /// A number and its unit.
    Number(&'static str, f64, &'static str),
}

/// All of them.
pub const SETTINGS: [Setting; 6] = [
    Setting { name: "small", share: 38.0, cells: Some([300, 4500, 7000]), log: None, sizes: SMALL_SIZES },
    Setting { name: "rig", share: 2.0, cells: Some([600, 9000, 13_000]), log: None, sizes: RIG_SIZES },
    Setting { name: "spindle", share: 22.0, cells: Some([200, 3500, 5500]), log: None, sizes: SPINDLE_SIZES },
    Setting { name: "cabinet", share: 27.0, cells: None, log: None, sizes: CABINET_SIZES },
    Setting { name: "cabinet, logs", share: 10.5, cells: None, log: Some(5400.0), sizes: CABINET_SIZES },
    Setting { name: "spindle, logs", share: 0.5, cells: Some([120, 1800, 2400]), log: Some(4800.0), sizes: SPINDLE_SIZES },
];

const SMALL_SIZES: &[Size] = &[
    Size::Box("part.plate.box", [200.0, 160.0, 20.0], [true, true, false]),
    Size::Box("part.motor.box", [120.0, 120.0, 140.0], [true, true, true]),
    Size::Box("part.gear.box", [100.0, 100.0, 110.0], [true, true, true]),
    Size::Box("part.bracket.box", [40.0, 60.0, 200.0], [true, true, false]),
    Size::Box("part.bearing.box", [80.0, 80.0, 60.0], [true, true, true]),
    Size::Number("channel.first.diameter", 8.0, "mm"),
    Size::Number("channel.second.diameter", 8.0, "mm"),
];

const RIG_SIZES: &[Size] = &[
    Size::Box("part.motor_plate.box", [240.0, 220.0, 20.0], [true, true, false]),
    Size::Box("part.reducer_plate.box", [200.0, 180.0, 20.0], [true, false, false]),
    Size::Number("part.motor.surface.area", 0.060, "m2"),
    Size::Number("part.reducer.surface.area", 0.035, "m2"),
    Size::Number("channel.motor_plate.diameter", 10.0, "mm"),
    Size::Number("channel.reducer_plate.diameter", 10.0, "mm"),
];

const SPINDLE_SIZES: &[Size] = &[
    Size::Box("part.front.box", [150.0, 140.0, 25.0], [true, true, false]),
    Size::Box("part.back.box", [170.0, 140.0, 25.0], [true, true, false]),
    Size::Box("part.bearing.box", [70.0, 90.0, 60.0], [false, true, true]),
    Size::Box("part.stator.box", [110.0, 110.0, 110.0], [true, true, true]),
    Size::Box("part.tool.box", [40.0, 60.0, 50.0], [false, true, true]),
    Size::Number("channel.front.diameter", 7.0, "mm"),
    Size::Number("channel.back.diameter", 7.0, "mm"),
];

/// Of a lumped machine shapes are in its conductances and capacities.
const CABINET_SIZES: &[Size] = &[
    Size::Number("contact.paste_a.total_conductance", 4.0, "W/K"),
    Size::Number("contact.paste_b.total_conductance", 3.0, "W/K"),
    Size::Number("contact.cooler.total_conductance", 6.0, "W/K"),
    Size::Number("contact.winding.total_conductance", 1.5, "W/K"),
    Size::Number("contact.board.total_conductance", 0.5, "W/K"),
    Size::Number("contact.fins.total_conductance", 1.0, "W/K"),
    Size::Number("contact.fan.total_conductance", 5.0, "W/K"),
    Size::Number("boundary.walls.area", 1.4, "m2"),
    Size::Number("node.drive_a.capacity", 900.0, "J/K"),
    Size::Number("node.drive_b.capacity", 700.0, "J/K"),
    Size::Number("node.transformer.capacity", 2500.0, "J/K"),
    Size::Number("node.sink.capacity", 1800.0, "J/K"),
    Size::Number("node.walls.capacity", 4000.0, "J/K"),
];

impl Setting {
    /// The machine file.
    pub fn document(&self) -> Document {
        let text = match self.name.split(',').next() {
            Some("small") => SMALL,
            Some("rig") => include_str!("../../machines/rig.toml"),
            Some("spindle") => include_str!("machines/spindle.toml"),
            _ => include_str!("machines/cabinet.toml"),
        };
        Document::parse(text, format!("{}.toml", self.name)).expect("a machine of the benchmark")
    }

    /// A size of a part or channel that is larger or smaller by `least` to `most` of itself: its place, and the line of the machine file.
    pub fn one_size(&self, least: f64, most: f64, random: &mut Random) -> Option<(String, (String, String))> {
        let factor = 1.0 + between(random, least, most) * if random.unit() < 0.5 { -1.0 } else { 1.0 };
        let size = &self.sizes[random.below(self.sizes.len())];
        let (key, value) = match size {
            Size::Box(key, edges, free) => {
                let may: Vec<usize> = (0..3).filter(|i| free[*i]).collect();
                let changed = may[random.below(may.len())];
                let edge = |(i, e): (usize, &f64)| format!("\"{:.4} mm\"", if i == changed { e * factor } else { *e });
                (*key, format!("[{}]", edges.iter().enumerate().map(edge).collect::<Vec<_>>().join(", ")))
            }
            Size::Number(key, value, unit) => (*key, format!("\"{:.6} {unit}\"", value * factor)),
        };
        let place = key.split('.').nth(1)?.to_string();
        // Conductances and capacities of lumped nodes are kinds of the catalogue.
        let is_shape = key.starts_with("part.") || key.starts_with("channel.");
        is_shape.then(|| (place, (key.to_string(), value)))
    }

    /// Lines of the machine file that make every size up to `most` of it larger or smaller.
    pub fn resized(&self, most: f64, random: &mut Random) -> Vec<(String, String)> {
        let mut factor = || 1.0 + between(random, -most, most);
        let line = |size: &Size| match size {
            Size::Box(key, edges, free) => {
                let edge = |(e, free): (&f64, &bool)| format!("\"{:.4} mm\"", if *free { e * factor() } else { *e });
                (key.to_string(), format!("[{}]", edges.iter().zip(free).map(edge).collect::<Vec<_>>().join(", ")))
            }
            Size::Number(key, value, unit) => (key.to_string(), format!("\"{:.6} {unit}\"", value * factor())),
        };
        self.sizes.iter().map(line).collect()
    }
}
