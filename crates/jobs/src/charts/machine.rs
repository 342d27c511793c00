//! `figure = "machine"`: a picture of the machine, coloured by temperature.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use super::super::gallery::Gallery;
use super::results::Results;
use super::state::{SolvedState, StateKeys};
use super::{Head, chosen};
use coldplate_base::document::Section;
use coldplate_base::error::{Error, Result};
use coldplate_base::units::{Celsius, Kelvin, Measurand};
use coldplate_describe::machine::{Face, Machine, SensorReading};
use coldplate_figures::chart::machine::{MachineFigure, Pipe, Probe, SurfacePiece, View};
use coldplate_figures::chart::style::Quantity;
use coldplate_solve::meshed::{MeshedMachine, SteadyState};
use coldplate_tables::Table;

/// Number of pieces along an edge of a block, if the definition does not say. Chosen: smooth colours against the size
/// of the file.
const DETAIL: usize = 8;

/// Keys: those of its state; optional `view` (`corner`, `front`, `side`, `top`), `parts` (those shown), `points` (the
/// sensors shown), `detail` (pieces along an edge of a block), `places` (a CSV file with the columns `place` and `part`:
/// proposed places of sensors) and `place_name` (a name for these places).
#[derive(Debug, Clone)]
pub(super) struct MachineChart {
    state: StateKeys,
    view: View,
    detail: usize,
    places: Option<PathBuf>,
    place_name: String,
}

impl MachineChart {
    pub(super) fn read(root: &Section<'_>, folder: &Path) -> Result<Self> {
        for key in ["parts", "points"] {
            root.opt_texts(key)?;
        }
        let view = root.opt_choice("view", &View::NAMES)?.map(|v| View::ALL[v]).unwrap_or_default();
        let detail = root.opt_integer("detail", 1)?.unwrap_or(DETAIL);
        let places = root.opt_text("places")?.map(|p| folder.join(p));
        let place_name = root.opt_text("place_name")?.unwrap_or_else(|| "proposed place".into());
        Ok(Self { state: StateKeys::read(root, folder)?, view, detail, places, place_name })
    }

    pub(super) fn draw(&self, head: &Head, results: &mut Results<'_>, gallery: &mut Gallery) -> Result<()> {
        let SolvedState { study, state, fixed, .. } = self.state.open(head, results)?;
        let model = &study.model;
        let machine = &model.machine;
        let parts: Vec<&str> = machine.parts.iter().map(|p| p.name.as_str()).collect();
        let parts = chosen(&head.root(), "parts", &parts)?;
        let sensors: Vec<&str> = machine.sensors.iter().map(|s| s.name.as_str()).collect();
        let sensors = chosen(&head.root(), "points", &sensors)?;
        let mut figure = figure(model, &state, &parts, &sensors, self.detail);
        if let Some(file) = &self.places {
            figure.probes.extend(proposed(model, file)?.into_iter().filter(|(part, _)| parts.contains(part)).map(|(_, probe)| probe));
        }
        let figure = MachineFigure {
            title: head.title(format!("{}: temperatures", machine.name)),
            view: self.view,
            place_name: self.place_name.clone(),
            fixed,
            notes: head.notes(figure.notes),
            ..figure
        };
        head.add(gallery, &figure)
    }
}

/// All parts and sensors of a machine in a state.
pub(crate) fn whole(model: &MeshedMachine, state: &SteadyState) -> MachineFigure {
    let (parts, sensors) = (model.machine.parts.len(), model.machine.sensors.len());
    figure(model, state, &(0..parts).collect::<Vec<_>>(), &(0..sensors).collect::<Vec<_>>(), DETAIL)
}

/// These parts and sensors of a machine in a state, with `detail` pieces along an edge of a block.
fn figure(model: &MeshedMachine, state: &SteadyState, parts: &[usize], sensors: &[usize], detail: usize) -> MachineFigure {
    let (machine, temperatures) = (&model.machine, &state.solution.temperatures);
    let hull: Vec<_> = model.mesh.hull(detail).into_iter().filter(|f| parts.contains(&f.part)).collect();
    let bodies = |part: usize| hull.iter().filter(|f| f.part == part).map(|f| f.body).collect::<BTreeSet<_>>().into_iter().collect();
    let channels = machine.channels.iter().filter(|c| parts.contains(&c.part));
    let pipes = channels.map(|c| Pipe { name: c.name.clone(), path: c.path.clone(), bodies: bodies(c.part) }).collect();
    let readings = model.readings(state);
    let degrees = |s: usize| (machine.sensors[s].measurand() == Measurand::Temperature).then(|| readings[s]);
    let probe = |sensor: &usize| {
        let (part, at) = place_of(model, machine, *sensor)?;
        let shown = part.is_none_or(|p| parts.contains(&p));
        shown.then(|| Probe { name: machine.sensors[*sensor].name.clone(), at, reading: degrees(*sensor) })
    };
    let probes = sensors.iter().filter_map(probe).collect();
    let pieces = hull.into_iter().map(|facet| {
        let mean = facet.nodes.iter().map(|n| temperatures[*n]).sum::<f64>() / facet.nodes.len().max(1) as f64;
        SurfacePiece {
            body: facet.body,
            corners: facet.corners,
            edges: facet.edges,
            outward: facet.outward,
            temperature: Celsius::from(Kelvin(mean)).0,
        }
    });
    MachineFigure {
        quantity: Quantity::new("temperature", "degC"),
        pieces: pieces.collect(),
        pipes,
        probes,
        notes: vec!["Channels show through their own parts, sensors through all.".to_string()],
        ..MachineFigure::default()
    }
}

/// Proposed places, each in the middle of its part's surface, with the part's index.
fn proposed(model: &MeshedMachine, file: &Path) -> Result<Vec<(usize, Probe)>> {
    let table = Table::read(file)?;
    let column = |name: &str| {
        let missing = || Error::input(format!("there is no column '{name}'")).in_file(file).help("the columns are place and part");
        table.text(name).ok_or_else(missing)
    };
    let rows = column("place")?.values.iter().zip(&column("part")?.values);
    let one = |(place, part): (&String, &String)| {
        let unknown = || Error::input(format!("the machine has no part '{part}'")).in_file(file).at_key("part").read(part);
        let at = model.machine.parts.iter().position(|p| p.name == *part).ok_or_else(unknown)?;
        let place_at = centre(model, at).ok_or_else(unknown)?;
        Ok((at, Probe { name: place.clone(), at: place_at, reading: None }))
    };
    rows.map(one).collect()
}

/// Place of a sensor, with its part; `None` if it has no place (a lumped node).
pub(crate) fn place_of(model: &MeshedMachine, machine: &Machine, sensor: usize) -> Option<(Option<usize>, [f64; 3])> {
    let channel = |c: usize, end: fn(&[[f64; 3]]) -> Option<&[f64; 3]>| {
        let channel = &machine.channels[c];
        end(&channel.path).map(|at| (Some(channel.part), *at))
    };
    match &machine.sensors[sensor].reads {
        SensorReading::Point(part, at) => Some((Some(*part), *at)),
        SensorReading::FaceMean(face) => Some((Some(face.part), on_face(model, *face)?)),
        SensorReading::PartMean(part) => Some((Some(*part), centre(model, *part)?)),
        SensorReading::Displacement(own) => Some((Some(own.of.0), own.of.1)),
        SensorReading::Node(_) => None,
        SensorReading::Inlet(c) => channel(*c, |path| path.first()),
        SensorReading::Outlet(c) => channel(*c, |path| path.last()),
    }
}

/// The point of a face nearest to its middle. The middle itself lies beside the face if it is bent or in several
/// pieces.
fn on_face(model: &MeshedMachine, face: Face) -> Option<[f64; 3]> {
    let cells = model.mesh.face_cells(face).into_iter().map(|(g, c, area)| {
        let grid = &model.mesh.grids[g];
        let mut local = [0, 1, 2].map(|d| grid.centre(d, c[d]));
        let axis = face.side.axis();
        local[axis] = grid.edges[axis][c[axis] + usize::from(face.side.is_high())];
        (grid.to_machine(local), area)
    });
    let triangles = model.mesh.tetra_of(face.part).into_iter().flat_map(|tetra| {
        let middle = |t: usize| {
            let corners = tetra.triangle(t);
            [0, 1, 2].map(|d| corners.iter().map(|c| c[d]).sum::<f64>() / 3.0)
        };
        tetra.faces_of(face).into_iter().map(move |t| (middle(t), tetra.face_area(t)))
    });
    let pieces: Vec<([f64; 3], f64)> = cells.chain(triangles).collect();
    let area: f64 = pieces.iter().map(|p| p.1).sum();
    let middle = [0, 1, 2].map(|d| pieces.iter().map(|(at, own)| at[d] * own).sum::<f64>() / area);
    let apart = |at: &[f64; 3]| (0..3).map(|d| (at[d] - middle[d]).powi(2)).sum::<f64>();
    pieces.iter().map(|p| p.0).min_by(|a, b| apart(a).total_cmp(&apart(b)))
}

/// The middle of a part's surface.
fn centre(model: &MeshedMachine, part: usize) -> Option<[f64; 3]> {
    let hull = model.mesh.hull(1);
    let corners: Vec<[f64; 3]> = hull.into_iter().filter(|f| f.part == part).flat_map(|f| f.corners).collect();
    let count = corners.len() as f64;
    (count > 0.0).then(|| [0, 1, 2].map(|d| corners.iter().map(|c| c[d]).sum::<f64>() / count))
}

#[cfg(test)]
mod tests {
    use super::*;
    use coldplate_base::document::Document;
    use coldplate_solve::study::Study;

    /// A plate, a cover of two boxes over it, and a pin along x.
    const MACHINE: &str = r#"
name = "plate and cover"
[part.bed]
material = "steel"
box = ["400 mm", "200 mm", "20 mm"]
[part.cover]
material = "steel"
blocks = [
    { box = ["2 mm", "200 mm", "100 mm"], at = ["0 mm", "0 mm", "20 mm"] },
    { box = ["300 mm", "200 mm", "2 mm"], at = ["0 mm", "0 mm", "120 mm"] },
]
[part.pin]
material = "steel"
cylinder = { axis = "x", outer_diameter = "40 mm", length = "100 mm" }
at = ["200 mm", "100 mm", "60 mm"]
[source.pin]
in = "pin"
power = "1 W"
[sensor.bed]
face = "bed.+z"
[sensor.roof]
face = "cover[2].+z"
[sensor.side]
face = "bed.-y"
[sensor.pin]
face = "pin.outer"
[mesh]
cells = 2000
"#;

    #[test]
    fn a_sensor_of_a_face_sits_on_it() {
        let study = Study::new(Document::parse(MACHINE, "cover.toml").unwrap(), None).unwrap();
        let model = &study.model;
        let at = |name: &str| {
            let sensor = model.machine.sensors.iter().position(|s| s.name == name).unwrap();
            place_of(model, &model.machine, sensor).unwrap().1
        };
        let (bed, roof, side, pin) = (at("bed"), at("roof"), at("side"), at("pin"));
        assert!((bed[2] - 0.02).abs() < 1e-9 && (bed[0] - 0.2).abs() < 0.05 && (bed[1] - 0.1).abs() < 0.05, "{bed:?}");
        assert!((roof[2] - 0.122).abs() < 1e-9 && (roof[0] - 0.15).abs() < 0.05 && (roof[1] - 0.1).abs() < 0.05, "{roof:?}");
        assert!(side[1].abs() < 1e-9 && (side[0] - 0.2).abs() < 0.05, "{side:?}");
        assert!(((pin[1] - 0.1).hypot(pin[2] - 0.06) - 0.02).abs() < 1e-9 && (pin[0] - 0.25).abs() < 0.03, "{pin:?}");
    }
}
