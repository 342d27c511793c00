//! The temperatures of all cells from a reduced state, against full solves.

use coldplate_base::progress::Silent;
use coldplate_base::random::Random;
use coldplate_describe::machine::Condition;
use coldplate_network::Load;
use coldplate_reduce::{ReduceSettings, ReducedModel, reduce};
use coldplate_solve::Solver;

use super::{settings, study};

/// What the largest error of any node may be beyond that at the conditions of the calibration.
const BEYOND: f64 = 3.0;

#[test]
fn the_field_is_that_of_the_full_model() {
    // Blocks, tetrahedra, and held boundaries of a lumped circuit.
    for (machine, cells, conditions, most) in [("five_axis", 2500, 12, 0.01), ("bracket", 1000, 12, 0.01), ("rig", 1500, 12, 0.01)] {
        let study = study(machine, cells);
        let settings = ReduceSettings { with_field: true, ..settings(&study, false) };
        let model = reduce(&study, &settings, &Silent).expect("a reduced model");
        let bytes = model.to_bytes(study.document()).expect("bytes");
        let bare = ReducedModel { field: None, ..model.clone() }.to_bytes(study.document()).expect("bytes");
        let model = ReducedModel::from_bytes(&bytes).expect("the file is read");
        let (own, network) = (&study.model.machine, &study.model.network);
        let stated = model.field.as_ref().expect("a field").largest_error;
        let mut random = Random::new(7);
        let (mut error, mut hottest_error): (f64, f64) = (0.0, 0.0);
        for _ in 0..conditions {
            let condition = Condition::from_si(model.ranges.iter().map(|(low, high)| low + random.unit() * (high - low)).collect());
            let load = Load::at(own, &condition).expect("a load");
            let truth = Solver::new(network, &load).and_then(|s| s.steady(&load)).expect("a full solve").temperatures;
            let answer = model.steady(&condition, &[]).expect("an answer");
            let found = model.temperatures(&answer, &condition, network).expect("a field");
            assert_eq!(found.len(), truth.len());
            error = found.iter().zip(&truth).fold(error, |most, (a, b)| most.max((a - b).abs()));
            let (spots, true_spots) = (study.model.mesh.hottest(&found), study.model.mesh.hottest(&truth));
            assert!(!spots.is_empty() && spots.len() == true_spots.len());
            for (spot, truth) in spots.iter().zip(&true_spots) {
                assert_eq!(spot.part, truth.part);
                hottest_error = hottest_error.max((spot.temperature - truth.temperature).abs());
            }
        }
        println!(
            "{machine}: {} nodes, {} modes, field {:.0} kB of {:.0}; largest error of any node {error:.1e} K, of the hottest places \
             {hottest_error:.1e} K, stated {stated:.1e} K",
            network.nodes,
            model.fine.len(),
            (bytes.len() - bare.len()) as f64 / 1e3,
            bytes.len() as f64 / 1e3
        );
        assert!(error <= most && error <= BEYOND * stated.max(1e-5), "{machine}: {error} K where {stated} K are stated");
        assert!(hottest_error <= error);
    }
}

#[test]
fn a_model_without_its_field_says_so() {
    let study = study("rig", 800);
    let model = reduce(&study, &settings(&study, false), &Silent).expect("a reduced model");
    let condition = Condition::from_si(model.ranges.iter().map(|(low, high)| 0.5 * (low + high)).collect());
    let answer = model.steady(&condition, &[]).expect("an answer");
    let text = model.temperatures(&answer, &condition, &study.model.network).expect_err("no field").to_string();
    assert!(text.contains("--field"), "{text}");
    let with = reduce(&study, &ReduceSettings { with_field: true, ..settings(&study, false) }, &Silent).expect("a reduced model");
    let other = super::study("rig", 1500);
    let text = with.temperatures(&answer, &condition, &other.model.network).expect_err("another mesh").to_string();
    assert!(text.contains("mesh") && text.contains("anew"), "{text}");
}
