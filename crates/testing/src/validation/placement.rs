//! Where sensors tell most: of what is uncertain, and of the hottest points.

use coldplate_base::error::{Error, Result};
use coldplate_solve::sensitivity::DerivativeTarget;
use coldplate_solve::study::MachineParameter;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::validation::common::{Outcome, Records, Section, study, table, verdict};

const CELLS: usize = 3000;
/// Standard deviation of one reading, K: scanner and sensor.
const NOISE: f64 = 0.0816;
/// Uncertain numbers with their standard deviations, relative (of factors and quantities) or in kelvin (of temperatures).
const UNCERTAIN: [(&str, f64); 13] = [
    ("contact.y_motor.conductance", 0.2),
    ("contact.y_reducer.conductance", 0.2),
    ("contact.y_base.conductance", 0.5),
    ("contact.y_seat_foot.conductance", 1.0),
    ("contact.y_nut_bracket.conductance", 0.5),
    ("contact.y_sliders.total_conductance", 0.5),
    ("contact.y_bearing_balls.total_conductance", 0.5),
    ("source.y_motor.power", 0.1),
    ("source.y_bearing.power", 0.5),
    ("source.y_far_bearing.power", 0.5),
    ("define.y_nut_and_screw_W", 0.5),
    ("surfaces.effective_emissivity", 0.3),
    ("circuit.y.inlet_temperature", 0.3),
];
/// The hottest points, whose prediction matters.
const HOT: [&str; 4] = ["Y motor", "Y bearing motor side", "Y bearing far side", "Y nut"];

/// A place a sensor could sit: name, part, change of its reading by one standard deviation of every uncertain number, K.
pub struct Place {
    pub name: String,
    pub part: String,
    pub slopes: Vec<f64>,
}

/// Worth of one place alone.
pub struct Rank {
    pub place: usize,
    /// Information about the uncertain numbers, nats.
    pub gain: f64,
    /// Root mean square uncertainty of the hottest points that is left, K.
    pub left: f64,
}

/// Best cell of every part, and the slopes of the hottest points.
pub fn places() -> Result<(Vec<Place>, Vec<Vec<f64>>)> {
    let study = study("five_axis.toml", &[], Some(CELLS))?;
    let machine = &study.model.machine;
    let condition = machine.condition(&[
        ("coolant_flow", "1.57e-4 m3/s"),
        ("coolant_temperature", "20 degC"),
        ("motor_speed", "2500 rpm"),
        ("ambient_temperature", "23.5 degC"),
    ])?;
    let at = study.at(&condition)?;
    let parameters = UNCERTAIN.iter().map(|(name, _)| study.parameter(name)).collect::<Result<Vec<MachineParameter>>>()?;
    let scale = |k: usize| {
        let p = &parameters[k];
        if p.per_percent(1.0, 1.0).is_some() { UNCERTAIN[k].1 * at.value_of(p) } else { UNCERTAIN[k].1 }
    };
    let fields = parameters.par_iter().map(|p| at.field(&at.partial(p)?)).collect::<Result<Vec<Vec<f64>>>>()?;
    let network = &study.model.network;
    let slopes = |node: usize| fields.iter().enumerate().map(|(k, f)| f[node] * scale(k)).collect::<Vec<f64>>();
    let size = |s: &[f64]| s.iter().map(|v| v * v).sum::<f64>();
    let mut best: Vec<Option<(f64, usize)>> = vec![None; network.groups.len()];
    for node in 0..network.solids {
        // What belongs to no part (a circuit's mixing points) holds no sensor.
        let Some(best) = best.get_mut(network.group[node] as usize) else { continue };
        let told = size(&slopes(node));
        if best.is_none_or(|b| told > b.0) {
            *best = Some((told, node));
        }
    }
    let mut places: Vec<Place> = best
        .iter()
        .enumerate()
        .filter_map(|(g, b)| {
            b.map(|(_, node)| Place { name: network.groups[g].clone(), part: network.groups[g].clone(), slopes: slopes(node) })
        })
        .collect();
    // The water at the outlet of the Y circuit, which a flow meter's neighbour can read.
    for stream in network.streams.iter().filter(|s| s.name == "y_reducer_plate") {
        places.push(Place { name: "water outlet of Y".into(), part: String::new(), slopes: slopes(stream.outlet() as usize) });
    }
    let target = |name: &&str| at.target(name);
    let targets = HOT.iter().map(target).collect::<Result<Vec<DerivativeTarget>>>()?;
    let table = at.jacobian(&targets, &parameters)?;
    let hot = table.slopes.iter().map(|row| row.iter().enumerate().map(|(k, s)| s * scale(k)).collect()).collect();
    Ok((places, hot))
}

/// Gain of readings in nats and what is left of the hottest points' uncertainty, K.
pub fn told(chosen: &[&Place], hot: &[Vec<f64>]) -> Result<(f64, f64)> {
    let count = UNCERTAIN.len();
    let mut information = DMatrix::<f64>::identity(count, count);
    for place in chosen {
        let s = DVector::from_vec(place.slopes.clone()) / NOISE;
        information += &s * s.transpose();
    }
    let gain = 0.5 * information.determinant().ln();
    let covariance = information.try_inverse().ok_or_else(|| Error::numerics("the information is singular"))?;
    let variance = |h: &Vec<f64>| {
        let h = DVector::from_vec(h.clone());
        (h.transpose() * &covariance * &h)[(0, 0)]
    };
    Ok((gain, (hot.iter().map(variance).sum::<f64>() / hot.len() as f64).sqrt()))
}

/// Single places, best first.
pub fn ranked(places: &[Place], hot: &[Vec<f64>]) -> Result<Vec<Rank>> {
    let one = |p: usize| -> Result<Rank> { told(&[&places[p]], hot).map(|(gain, left)| Rank { place: p, gain, left }) };
    let mut found = (0..places.len()).map(one).collect::<Result<Vec<_>>>()?;
    found.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    Ok(found)
}

/// One place after the other, each the one that leaves least uncertainty of the hottest points.
pub fn greedy(places: &[Place], hot: &[Vec<f64>], count: usize) -> Result<Vec<(usize, f64, f64)>> {
    let mut chosen: Vec<usize> = Vec::new();
    let mut steps = Vec::new();
    for _ in 0..count {
        let mut best: Option<(usize, f64, f64)> = None;
        for p in (0..places.len()).filter(|p| !chosen.contains(p)) {
            let all: Vec<&Place> = chosen.iter().chain([&p]).map(|i| &places[*i]).collect();
            let (gain, left) = told(&all, hot)?;
            if best.is_none_or(|b| left < b.2) {
                best = Some((p, gain, left));
            }
        }
        let Some(step) = best else { break };
        chosen.push(step.0);
        steps.push(step);
    }
    Ok(steps)
}

/// The section.
pub fn section() -> Result<Section> {
    let mut section = Section::default();
    let (places, hot) = places()?;
    let records = Records::read("figure_16.csv")?;
    let is_published = |part: &str| records.rows.iter().any(|r| r[1] == part);
    let (_, before) = told(&[], &hot)?;
    let published: Vec<&Place> = places.iter().filter(|p| is_published(&p.part)).collect();
    let (published_gain, published_left) = told(&published, &hot)?;
    let rows: Vec<Vec<String>> = ranked(&places, &hot)?
        .iter()
        .take(14)
        .map(|r| {
            let place = &places[r.place];
            vec![
                place.name.replace('_', " "),
                format!("{:.2}", r.gain),
                format!("{:.2}", r.left),
                if is_published(&place.part) { "yes" } else { "" }.into(),
            ]
        })
        .collect();
    let names: Vec<String> = UNCERTAIN.iter().map(|(n, d)| format!("`{n}` {d}")).collect();
    section.text = format!(
        "At 2500 r/min, 9.42 L/min of 20 °C, a chamber of 23.5 °C. {} numbers of the machine file are taken as uncertain, with relative standard deviations (kelvin for the \
         water): {}. A place tells as much as it moves with them beside the {NOISE} K of a reading. Every cell of every part is tried; the table has the best \
         of each part, by the information it gives alone. *Left* is the uncertainty (rms of {}) that remains, {before:.2} K before any reading. About {CELLS} cells.\n\n",
        UNCERTAIN.len(),
        names.join(", "),
        HOT.join(", ")
    );
    section.text += &table(&["part", "information, nats", "left, K", "in Figure 16"], &rows);
    let steps = greedy(&places, &hot, published.len())?;
    let rows: Vec<Vec<String>> = steps
        .iter()
        .enumerate()
        .map(|(i, (p, gain, left))| {
            let place = &places[*p];
            vec![
                (i + 1).to_string(),
                place.name.replace('_', " "),
                format!("{gain:.2}"),
                format!("{left:.2}"),
                if is_published(&place.part) { "yes" } else { "" }.into(),
            ]
        })
        .collect();
    section.text += "One after the other, each where it leaves least:\n\n";
    section.text += &table(&["", "part", "information so far, nats", "left, K", "in Figure 16"], &rows);
    let (gain, left) = steps.last().map_or((f64::NAN, f64::NAN), |s| (s.1, s.2));
    let shared = steps.iter().filter(|s| is_published(&places[s.0].part)).count();
    section.text += &format!(
        "The {} sensors of Figure 16 (each at the best cell of its part) give {published_gain:.2} nats and leave {published_left:.2} K; the same number chosen here \
         {gain:.2} nats and {left:.2} K, {shared} of them on the same parts.\n\n",
        published.len()
    );
    let enough = steps.iter().position(|s| s.2 < published_left).map_or(steps.len(), |i| i + 1);
    let these: Vec<String> = steps.iter().take(4).map(|s| places[s.0].name.replace('_', " ")).collect();
    section.verdicts.push(verdict(
        Outcome::Improved,
        format!("where {} sensors of the Y drive go (Figure 16)", published.len()),
        format!(
            "{before:.2} K of uncertainty of the hottest points fall to {published_left:.2} K; {enough} chosen by information do better, four ({}) leave {:.2} K",
            these.join(", "),
            steps.get(3).map_or(f64::NAN, |s| s.2)
        ),
    ));
    Ok(section)
}
