//! The least coolant flow for a stated rise: equation 6 with its arithmetic put right, and the solver's own answer.

use coldplate_base::error::{Error, Result};
use coldplate_physics::water;
use coldplate_solve::study::Study;

use crate::validation::common::{Outcome, Section, study, table, verdict};

/// Heat of motor and reducer (W) and volumetric heat of water (J/(m3 K)) as published.
const HEAT: f64 = 113.73 + 51.12;
const PAPER_WATER: f64 = 4.2e6;
/// Flow as printed, m3/s.
const PRINTED: f64 = 3.957e-5;

/// Rise of the rig's water (K) at a flow (m3/s), and the heat it takes up (W).
fn rise(study: &Study, flow: f64) -> Result<(f64, f64)> {
    let machine = &study.model.machine;
    let flow = format!("{flow:e} m3/s");
    let condition = machine.condition(&[
        ("coolant_flow", flow.as_str()),
        ("coolant_temperature", "26 degC"),
        ("motor_speed", "2500 rpm"),
        ("ambient_temperature", "28.5 degC"),
    ])?;
    let state = study.model.solve(&study.model.solver(&condition)?, &condition)?;
    let readings = study.model.readings(&state);
    let of = |name: &str| {
        let at = machine.sensors.iter().position(|s| s.name == name).ok_or_else(|| Error::input(format!("no sensor '{name}'")))?;
        Ok(readings[at])
    };
    Ok((of("water outlet")? - of("water inlet")?, -state.solution.balance.circuits.iter().sum::<f64>()))
}

/// The flow (m3/s) at which the rig's water rises by `wanted` (K), and the heat (W) it takes up then.
pub fn flow_for(study: &Study, wanted: f64) -> Result<(f64, f64)> {
    // Rise times flow hardly changes: a few steps of the secant in 1/flow.
    let mut flow = HEAT / (PAPER_WATER * wanted);
    for _ in 0..20 {
        let (found, heat) = rise(study, flow)?;
        if (found / wanted - 1.0).abs() < 1e-6 {
            return Ok((flow, heat));
        }
        flow *= found / wanted;
    }
    Err(Error::numerics("no flow gives this rise"))
}

/// Equation 6.
pub fn by_equation(heat: f64, rise: f64) -> f64 {
    heat / (PAPER_WATER * rise)
}

/// The section.
pub fn section() -> Result<Section> {
    let mut section = Section::default();
    let study = study("rig.toml", &[], None)?;
    let mut rows = Vec::new();
    let litres = |flow: f64| format!("{:.3}e-5 ({:.2} L/min)", flow * 1e5, flow * 6e4);
    let mut one = 0.0;
    for wanted in [0.5, 1.0, 2.0] {
        let (flow, heat) = flow_for(&study, wanted)?;
        if wanted == 1.0 {
            one = flow;
        }
        rows.push(vec![format!("{wanted} K"), litres(by_equation(HEAT, wanted)), litres(flow), format!("{heat:.2}")]);
    }
    let real = water::water(299.65)?.volumetric_heat();
    section.text = format!(
        "q = P / (c ρ ΔT). With the published P = {HEAT:.2} W, c ρ = 4.2e6 J/(m3 K) and ΔT = 1 K this is {:.3}e-5 m3/s; {:.3}e-5 is printed, {:+.1} % off. The \
         rig's machine file solved for the flow that gives the rise (real water, {:.4e} J/(m3 K); what the surfaces radiate does not reach the water):\n\n",
        by_equation(HEAT, 1.0) * 1e5,
        PRINTED * 1e5,
        100.0 * (PRINTED / by_equation(HEAT, 1.0) - 1.0),
        real
    );
    section.text += &table(&["rise", "equation 6, m3/s", "solved, m3/s", "heat into the water, W"], &rows);
    section.text += &format!(
        "* What is printed is {:.2} W over the volumetric heat of real water: {:.3}e-5 m3/s. It contradicts the constants printed beside it, not physics.\n\
         * The flow of the test, 3.33e-5 m3/s, is below both and was found enough all the same; its rise is {:.2} K by the equation.\n\
         * `coldplate check MACHINE.toml --rise \"1 K\"` prints the flow for any machine's sources at its default condition.\n\n",
        HEAT,
        HEAT / real * 1e5,
        HEAT / (PAPER_WATER * 3.33e-5)
    );
    section.verdicts.push(verdict(
        Outcome::Contradicted,
        "flow for a rise of 1 K, 3.957e-5 m3/s, by the constants of equation 6",
        format!(
            "164.85 / 4.2e6 = {:.3}e-5 m3/s; {:.3}e-5 with real water's {:.4e} J/(m3 K); solved, with what is radiated, {:.3}e-5",
            by_equation(HEAT, 1.0) * 1e5,
            HEAT / real * 1e5,
            real,
            one * 1e5
        ),
    ));
    Ok(section)
}
