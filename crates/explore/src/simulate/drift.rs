//! Drift of displacements over a schedule: the figures by which tests of machine tools state their thermal behaviour.

use serde::Serialize;

use super::{History, SimulatedMachine};
use coldplate_base::units::Measurand;
use coldplate_base::vector::{cross, dot, norm};
use coldplate_describe::machine::{Displacement, SensorReading};

/// Length of the first stretch that tests of spindles and axes report on its own, s. Chosen: one hour.
const FIRST: f64 = 3600.0;
/// Share of the whole way that may be left when a drift counts as done. Chosen, and stated in docs/how-to/displacement.md.
const LEFT: f64 = 0.1;
/// Largest deviation of two directions from parallel or square, as a sine. Chosen: room for rounding in the machine file.
const SQUARE: f64 = 1e-6;

/// The drift of one displacement; ranges are largest minus smallest.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(non_snake_case)]
pub struct Drift {
    /// Name of the sensor.
    pub sensor: String,
    /// Range over the whole schedule, um.
    pub range_um: f64,
    /// Range in the first hour, um.
    pub first_hour_um: f64,
    /// Displacement at the end less that at the beginning, um.
    pub end_um: f64,
    /// Displacement in the steady state of the last condition less that at the beginning, um, if there is a steady state.
    pub steady_um: Option<f64>,
    /// Time after which the displacement stays within a tenth of the whole way of the steady state, s; `None` if it does not.
    pub settled_s: Option<f64>,
}

/// The drift of an angle, told by two points of a part that are displaced alike along one direction and stand apart across it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Tilt {
    /// The two displacements.
    pub of: [String; 2],
    /// Axis of the rotation: x, y or z, or the three components of another axis.
    pub about: String,
    /// Distance of the two points, m.
    pub apart_m: f64,
    /// Range over the whole schedule, urad (um per m).
    pub range_urad: f64,
    /// Range in the first hour, urad.
    pub first_hour_urad: f64,
    /// Angle at the end less that at the beginning, urad.
    pub end_urad: f64,
    /// Angle in the steady state of the last condition less that at the beginning, urad, if there is a steady state.
    pub steady_urad: Option<f64>,
    /// Time after which the angle stays within a tenth of the whole way of the steady state, s; `None` if it does not.
    pub settled_s: Option<f64>,
}

/// The figures of one course, in its own unit.
struct Way {
    range: f64,
    first: f64,
    end: f64,
    steady: Option<f64>,
    settled: Option<f64>,
}

impl History {
    /// The drift of every displacement of `model`.
    pub fn drifts(&self, model: &SimulatedMachine<'_>) -> Vec<Drift> {
        let displacements = model.measurands.iter().zip(model.sensors).enumerate().filter(|(_, (own, _))| **own == Measurand::Displacement);
        let drift = |(s, (_, name)): (usize, (&Measurand, &String))| {
            let way = self.way(&|readings| readings[s])?;
            Some(Drift {
                sensor: name.clone(),
                range_um: way.range,
                first_hour_um: way.first,
                end_um: way.end,
                steady_um: way.steady,
                settled_s: way.settled,
            })
        };
        displacements.filter_map(drift).collect()
    }

    /// The drift of every angle that two displacements of `model` tell; none for models that do not know their machine.
    pub fn tilts(&self, model: &SimulatedMachine<'_>) -> Vec<Tilt> {
        let place = |name: &String| {
            let sensor = model.machine?.sensors.iter().find(|sensor| sensor.name == *name)?;
            if let SensorReading::Displacement(own) = &sensor.reads { Some(own) } else { None }
        };
        let own: Vec<(usize, &String, &Displacement)> =
            model.sensors.iter().enumerate().filter_map(|(s, name)| Some((s, name, place(name)?))).collect();
        let pairs = own.iter().enumerate().flat_map(|(i, a)| own[i + 1..].iter().map(move |b| (a, b)));
        let tilt = |((i, a, of_a), (j, b, of_b)): (&(usize, &String, &Displacement), &(usize, &String, &Displacement))| {
            // The axis is told along the machine's own if it is one of them.
            let ((i, a), (j, b), (apart, about)) = match lever(of_a, of_b)? {
                (_, about) if about.iter().sum::<f64>() < 0.0 => ((j, b), (i, a), lever(of_b, of_a)?),
                found => ((i, a), (j, b), found),
            };
            let way = self.way(&|readings| (readings[*i] - readings[*j]) / apart)?;
            Some(Tilt {
                of: [(*a).clone(), (*b).clone()],
                about: axis(about),
                apart_m: apart,
                range_urad: way.range,
                first_hour_urad: way.first,
                end_urad: way.end,
                steady_urad: way.steady,
                settled_s: way.settled,
            })
        };
        pairs.filter_map(tilt).collect()
    }

    /// The figures of the quantity `of` the readings.
    fn way(&self, of: &dyn Fn(&[f64]) -> f64) -> Option<Way> {
        let course: Vec<f64> = self.readings.iter().map(|readings| of(readings)).collect();
        let (start, begun) = (*self.times.first()?, *course.first()?);
        let range = |until: f64| {
            let own = self.times.iter().zip(&course).filter(|(t, _)| **t <= until).map(|(_, u)| *u);
            let (low, high) = own.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), u| (low.min(u), high.max(u)));
            high - low
        };
        let steady = self.steady.as_ref().ok().map(|steady| of(steady));
        Some(Way {
            range: range(f64::INFINITY),
            first: range(start + FIRST),
            end: course.last()? - begun,
            steady: steady.map(|steady| steady - begun),
            settled: steady.and_then(|steady| self.near_from(&course, steady, LEFT * (steady - begun).abs())).map(|at| at - start),
        })
    }

    /// The time from which on a course stays near its steady value, s, straight between the outputs.
    fn near_from(&self, course: &[f64], steady: f64, near: f64) -> Option<f64> {
        let far = |i: usize| (course[i] - steady).abs();
        let last_far = (0..self.times.len()).rev().find(|i| far(*i) > near);
        let Some(last) = last_far else { return self.times.first().copied() };
        let next = last + 1;
        let end = self.times.get(next)?;
        let share = (far(last) - near) / (far(last) - far(next));
        Some(self.times[last] + share.clamp(0.0, 1.0) * (end - self.times[last]))
    }
}

/// Distance of two displacements (m), and the axis about which the part turns to the right if the first displacement is the
/// larger one. `None` if the two tell no angle: for two parts, two directions, two references, or along the line between them.
fn lever(a: &Displacement, b: &Displacement) -> Option<(f64, [f64; 3])> {
    let d = a.direction;
    let is_alike = a.of.0 == b.of.0 && a.relative_to == b.relative_to && norm(cross(d, b.direction)) < SQUARE && dot(d, b.direction) > 0.0;
    let r: [f64; 3] = std::array::from_fn(|i| a.of.1[i] - b.of.1[i]);
    let apart = norm(r);
    if !is_alike || apart < SQUARE || dot(r, d).abs() > SQUARE * apart {
        return None;
    }
    Some((apart, cross(r.map(|x| x / apart), d)))
}

/// An axis in words.
fn axis(n: [f64; 3]) -> String {
    let along = |i: usize| (n[i].abs() - 1.0).abs() < SQUARE;
    match (0..3).find(|i| along(*i)) {
        Some(i) => format!("{}{}", if n[i] < 0.0 { "-" } else { "" }, ["x", "y", "z"][i]),
        None => format!("{:.3} {:.3} {:.3}", n[0], n[1], n[2]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_points_of_a_part_tell_how_it_turns() {
        let at = |place: [f64; 3], direction: [f64; 3]| Displacement { of: (0, place), relative_to: None, direction, line: 1 };
        let (low, high) = (at([0.6, 0.0, 0.5], [1.0, 0.0, 0.0]), at([0.6, 0.0, 0.7], [1.0, 0.0, 0.0]));
        // In a turn to the right about y the higher point moves along x.
        let (apart, about) = lever(&high, &low).unwrap();
        assert!((apart - 0.2).abs() < 1e-12);
        assert_eq!(axis(about), "y");
        assert_eq!(axis(lever(&low, &high).unwrap().1), "-y");
        assert_eq!(lever(&low, &at([0.6, 0.0, 0.7], [0.0, 1.0, 0.0])), None);
        assert_eq!(lever(&low, &at([0.8, 0.0, 0.5], [1.0, 0.0, 0.0])), None);
        assert_eq!(lever(&low, &Displacement { of: (1, [0.6, 0.0, 0.7]), ..low.clone() }), None);
        let slanted = [0.6, 0.8, 0.0];
        assert_eq!(axis(lever(&at([0.0, 0.0, 1.0], slanted), &at([0.0; 3], slanted)).unwrap().1), "-0.800 0.600 0.000");
    }
}
