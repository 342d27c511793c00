//! The published rig and machine: targets against the numbers of the study (data/), by the code that writes docs/record/validation.md.

use coldplate_testing::validation::rig::Case;
use coldplate_testing::validation::{common, fits, flow, machine, placement, plan, rig, settling, standstill, tables};

/// Cells of the rig: its shells move by less than 0.02 K from here to 8000.
const RIG: Option<usize> = Some(2000);

fn case(name: &str) -> Case {
    rig::cases().into_iter().find(|c| c.name.starts_with(name)).unwrap_or_else(|| panic!("no case {name}"))
}

fn worst(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |m, v| v.abs().max(m))
}

/// Condition 1 within what a reading is good to, condition 2 untouched within 0.6 K.
#[test]
fn rig_identified_on_one_condition_predicts_the_other() {
    for name in ["likely plates", "shells alone"] {
        let found = rig::found(&case(name), RIG).unwrap();
        assert!(worst(&found.shells[..2]) <= rig::reading_uncertainty(), "{name}: {:?}", found.shells);
        assert!(worst(&found.shells[2..]) <= 0.6, "{name}: {:?}", found.shells);
        // By hand 7.3 to 8.0 and 5.1 to 5.4 W/K, the lower ends for a plate of one temperature; sensor errors 2 %.
        assert!((7.3..8.2).contains(&found.products[0]) && (5.1..5.6).contains(&found.products[1]), "{name}: {:?}", found.products);
    }
}

/// Plates below the water cannot be met, plates as they probably read nearly.
#[test]
fn printed_plates_contradict_the_water() {
    let printed = rig::found(&case("plates as printed"), RIG).unwrap();
    let likely = rig::found(&case("likely plates"), RIG).unwrap();
    assert!(printed.estimate.probability < 1e-4, "{}", printed.estimate.probability);
    assert!(likely.estimate.misfit.1 < 0.5 * printed.estimate.misfit.1);
}

/// Another area, the same product; a joint between the blocks, other products and the same shells.
#[test]
fn only_the_product_is_determined_and_only_without_another_joint() {
    let own = rig::found(&case("likely plates"), RIG).unwrap();
    let flux = rig::found(&case("flux area"), RIG).unwrap();
    for k in 0..2 {
        assert!((flux.products[k] / own.products[k] - 1.0).abs() < 0.01, "{:?} {:?}", flux.products, own.products);
    }
    // By hand -7 and +15 %, -24 and +52 %.
    for (name, motor, reducer) in [("joint of 1.5", -0.07, 0.15), ("joint of 5", -0.24, 0.52)] {
        let found = rig::found(&case(name), RIG).unwrap();
        let change = [0, 1].map(|k: usize| found.products[k] / own.products[k] - 1.0);
        assert!((change[0] - motor).abs() < 0.03 && (change[1] - reducer).abs() < 0.08, "{name}: {change:?}");
        assert!(worst(&found.shells[..2]) <= rig::reading_uncertainty(), "{name}: {:?}", found.shells);
    }
}

/// Heat that warms the water by 0.5 K meets the printed plates and misses condition 2 by 0.7 K.
#[test]
fn less_heat_is_rejected_by_the_second_condition() {
    let less = rig::found(&case("42 %"), RIG).unwrap();
    assert!(less.estimate.misfit.1 < 2.0, "{}", less.estimate.misfit.1);
    assert!((less.shells[2] - 0.7).abs() < 0.15, "{:?}", less.shells);
}

/// About 40 and 25 min, told with readings that are good to 0.1 K each.
#[test]
fn settling_within_five_minutes() {
    let study = settling::identified(RIG).unwrap();
    for test in [rig::ONE, rig::TWO] {
        let minutes = settling::run(&study, test).unwrap().last_step_above(0.2);
        let observed = rig::minutes(test).unwrap();
        assert!((minutes - observed).abs() <= 5.0, "{test}: {minutes} min, observed {observed}");
    }
}

/// Every sensor within 0.5 K, the Y seat within 0.2 K, heat in balance; the heat is what a seat of this size needs.
#[test]
fn whole_machine_identified() {
    let (problem, estimate) = machine::identified(false, Some(3000)).unwrap();
    let (all, seat) = machine::worst(&problem.data, &estimate.predictions.1);
    assert!(all <= 0.5 && seat <= 0.2, "{all} {seat}");
    assert_eq!(problem.data.count(), 16);
    assert!(estimate.undetermined.is_empty(), "{:?}", estimate.undetermined);
    // All plates read 0.3 to 0.6 K above the supply.
    assert!((0.3..0.6).contains(&estimate.values[0]), "{}", estimate.values[0]);
    let study = problem.machine_at(&estimate.values).unwrap();
    let condition = &problem.data.rows[0].condition;
    let state = study.model.solve(&study.model.solver(condition).unwrap(), condition).unwrap();
    assert!(state.solution.balance.relative < 1e-8);
    let bearing = study.model.machine.sources.iter().position(|s| s.name == "y_bearing").unwrap();
    // 2.5 to 5 W for an ordinary seat by hand, 4.94 W for one of 1.19 W/K; the lump leaves out screw and coupling.
    assert!((4.0..6.5).contains(&state.load.powers[bearing]), "{}", state.load.powers[bearing]);
}

/// Bearing heat and the line's heat gain together, what each takes, and what is left at the seats of the resting axes.
#[test]
fn shares_of_bearing_and_line() {
    let cells = Some(2000);
    let (problem, estimate) = machine::identified(false, cells).unwrap();
    let shares = machine::shares(&problem, &estimate.predictions.1, cells).unwrap();
    assert!((0.6..0.8).contains(&shares.heat) && (0.2..0.45).contains(&shares.gain), "{} {}", shares.heat, shares.gain);
    assert!(shares.both > 0.9 && shares.rms.1 < 0.2 && shares.left[0].0.contains("seat"), "{} {:?}", shares.both, shares.left);
}

/// The rig's three joints are open with both conditions, and a motor fed at standstill tells them apart.
#[test]
fn a_test_at_standstill_settles_the_joint_of_motor_and_reducer() {
    let plan = plan::rig_plan().unwrap();
    let turns = plan.problem.study.model.machine.variables.iter().position(|v| v.name == "reducer_turns").unwrap();
    assert_eq!(plan.best[0].condition.si()[turns], 0.0);
    assert!(plan.best[0].shrink[2] < 0.3, "{:?}", plan.best[0].shrink);
}

/// Printed heats leave the seat 2 K and more below its reading; the consistent set brings every sensor within 0.5 K.
#[test]
fn printed_heats_do_not_warm_the_seat() {
    for (name, sets) in machine::given() {
        let set = machine::solved(name, &sets, Some(3000)).unwrap();
        let (all, seat) = machine::worst(&machine::data(&set.study).unwrap(), &set.values);
        if name == "consistent set" { assert!(all <= 0.5, "{all}") } else { assert!(seat > 2.0, "{name}: {seat}") }
    }
}

/// The thirty polynomials are read as printed: values the study's text states.
#[test]
fn published_curves_and_their_corrections() {
    let all = fits::published().unwrap();
    assert_eq!(all.len(), 30);
    let at = |table: usize, part: &str, x: f64, corrected: bool| {
        let p = all.iter().find(|p| p.table == table && p.part == part).unwrap();
        fits::value(if corrected { p.curve() } else { &p.printed }, x)
    };
    for (table, part, x, corrected, expected) in [
        (8, "motor water-cooling plate", 20.0, false, 14.165),
        (8, "motor water-cooling plate", 20.0, true, 20.165),
        (8, "motor", 20.0, true, 20.083),
        (9, "water-cooling plate", 2500.0, false, 21.227),
        (9, "slider", 2500.0, true, 25.02),
        (10, "motor base", 23.5, true, 20.457),
    ] {
        let found = at(table, part, x, corrected);
        assert!((found - expected).abs() < 6e-3, "table {table}, {part}: {found} {expected}");
    }
}

/// Plates of Tables 7, 8 and 10 agree as shipped, and every row has the published shape.
#[test]
fn published_fits_beside_ours() {
    for (sweep, rows) in fits::rows(Some(3000)).unwrap() {
        for row in &rows {
            let is_motor_plate = row.published.part.ends_with("water-cooling plate") && !row.published.part.starts_with("reducer");
            if is_motor_plate && sweep.table != 9 {
                assert!(row.differences[0].agrees(), "table {}: {:?}", sweep.table, row.differences[0]);
            }
            assert!(row.differences[0].shape < 0.2, "table {}, {}: {:?}", sweep.table, row.published.part, row.differences[0]);
        }
    }
}

/// A curve against itself, shifted and tilted.
#[test]
fn differences_of_curves() {
    let theirs = [1.0, 2.0, 3.0, 4.0, 5.0];
    let ours = [1.3, 2.4, 3.5, 4.6, 5.7];
    let d = fits::Difference::of(&ours, &theirs);
    assert!((d.offset - 0.5).abs() < 1e-12 && (d.rise - 0.4).abs() < 1e-12 && d.shape < 1e-12, "{d:?}");
}

/// Equation 6 with its arithmetic put right, and what radiation takes off it.
#[test]
fn flow_for_a_rise() {
    assert!((flow::by_equation(164.85, 1.0) - 3.925e-5).abs() < 1e-9);
    let study = common::study("rig.toml", &[], RIG).unwrap();
    let (flow, heat) = flow::flow_for(&study, 1.0).unwrap();
    // Real water at 26.5 degC: 996.6 kg/m3, 4181 J/(kg K) (IAPWS).
    assert!((flow * 996.6 * 4181.0 / heat - 1.0).abs() < 2e-3, "{flow} {heat}");
}

/// The motor-side seat tells most of the sensors of Figure 16; the chosen ones leave less than those do.
#[test]
fn sensors_chosen_by_information() {
    let (places, hot) = placement::places().unwrap();
    let ranked = placement::ranked(&places, &hot).unwrap();
    let published = ["y_seat", "y_nut_bracket", "y_sliders", "y_motor", "y_reducer", "y_motor_plate"];
    let first = ranked.iter().find(|r| published.contains(&places[r.place].part.as_str())).unwrap();
    assert_eq!(places[first.place].part, "y_seat");
    let theirs: Vec<_> = places.iter().filter(|p| published.contains(&p.part.as_str())).collect();
    assert_eq!(theirs.len(), published.len());
    let left = placement::told(&theirs, &hot).unwrap().1;
    let steps = placement::greedy(&places, &hot, published.len()).unwrap();
    assert!(steps.windows(2).all(|w| w[1].2 <= w[0].2 && w[1].1 >= w[0].1), "{steps:?}");
    assert!(steps[steps.len() - 1].2 < left);
}

/// An emissivity planted in a log of 17 h with noise and sensor errors is found again within its interval. One coarse mesh: this is
/// about the log; docs/record/validation.md does it across meshes.
#[test]
fn emissivity_from_a_standstill() {
    let (problem, estimate) = standstill::recovered((300, 300), 1).unwrap();
    let (low, high) = estimate.intervals[0];
    assert!((low..high).contains(&standstill::PLANTED), "{low} {high}");
    assert!(high / low < 1.5, "{low} {high}");
    assert_eq!(problem.data.count(), 8 * 16);
}

/// The committed measurements are the published polynomials.
#[test]
fn tables_as_measurements() {
    let written = std::fs::read_to_string(common::project(tables::search::DATA)).unwrap();
    assert_eq!(written, tables::search::table().unwrap(), "cargo bench --bench validation -- tables writes them anew");
}

/// One machine with heats of its own in each table gives all but three of the thirty curves; the numbers recorded are those found.
#[test]
fn one_machine_and_the_heats_of_each_table() {
    let mut problem = tables::search::problem(None, Some(1500)).unwrap();
    let records = common::Records::read(tables::search::FOUND).unwrap();
    for free in &mut problem.free {
        let row = records.rows.iter().find(|row| row[0] == free.name()).unwrap();
        let value = records.number(row, "value [1]").unwrap().unwrap();
        assert!(free.bounds.0 <= value && value <= free.bounds.1, "{}: {value} within {:?}", free.name(), free.bounds);
        free.parameter.value = value;
    }
    let found = tables::search::found(problem).unwrap();
    // 27 at 5000 cells; at least 24 were to be reached, and this is a coarser mesh.
    assert!(found.agreeing() >= 25, "{}", found.agreeing());
    for sensor in ["Y motor plate", "Y reducer"] {
        assert!(found.curves.iter().any(|c| c.sensor == sensor && c.difference.agrees()));
    }
    for (test, sensor) in [("table 8", "Y reducer plate"), ("table 9", "Y motor plate")] {
        assert!(!found.curve(test, sensor).unwrap().difference.agrees(), "{test}, {sensor}");
    }
    let number = |key: &str, table: usize| {
        let k = found.number(key, Some(table)).unwrap();
        (found.estimate.values[k], found.estimate.intervals[k])
    };
    // By hand a ninth: 0.56 K for 5.15 K; the base that it warms too makes it a sixth.
    let (value, (low, high)) = number("source.y_motor.power", 9);
    assert!((0.08..0.3).contains(&value) && low > 0.05 && high < 0.5, "{value} ({low} to {high})");
    // Friction of 2500 r/min in Table 10: at a tenth of the speed a factor ten times that of Table 9.
    let ratio = number("define.y_nut_and_screw_W", 10).0 / number("define.y_nut_and_screw_W", 9).0;
    assert!((7.0..13.0).contains(&ratio), "{ratio}");
}
