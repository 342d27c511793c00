//! What flows in circuits, from a machine file on: hot water, boiling, standing water, oils and mixtures by table.

use coldplate_base::error::Result;
use coldplate_describe::machine::Machine;
use coldplate_physics::liquid::Liquid;
use coldplate_solve::meshed::{MeshedMachine, SolveRecord};

/// A heated plate with one straight channel; `circuit` holds the keys of its circuit.
fn plate(heat: f64, circuit: &str, more: &str) -> String {
    format!(
        "name = \"plate\"\n[variables]\ncoolant_flow = \"2 L/min\"\ncoolant_temperature = \"20 degC\"\nmotor_speed = \"0 rpm\"\n\
         ambient_temperature = \"20 degC\"\n\
         [part.plate]\nmaterial = \"aluminium 6061\"\nbox = [\"0.2 m\", \"0.1 m\", \"20 mm\"]\n\
         [channel.pass]\nin = \"plate\"\ndiameter = \"8 mm\"\npath = [[\"0 mm\", \"50 mm\", \"10 mm\"], [\"200 mm\", \"50 mm\", \"10 mm\"]]\n\
         [circuit.loop]\nlayout = [\"pass\"]\n{circuit}\n\
         [boundary.room]\nfaces = [\"plate.+z\"]\nfilm = \"10 W/(m2 K)\"\nfluid_temperature = \"20 degC\"\n\
         [source.heat]\nin = \"plate\"\npower = \"{heat} W\"\n[sensor.plate]\npart = \"plate\"\n[sensor.out]\noutlet = \"pass\"\n{more}\n"
    )
}

fn solved(text: &str) -> Result<SolveRecord> {
    let model = MeshedMachine::new(text.parse::<Machine>()?, Some(2000))?;
    let condition = model.machine.condition(&[])?;
    let state = model.steady(&condition)?;
    Ok(model.record(&state))
}

/// Words that an error must hold.
fn refused(text: &str, words: &[&str]) {
    let error = solved(text).unwrap_err().to_string();
    words.iter().for_each(|word| assert!(error.contains(word), "'{word}' is missing in:\n{error}"));
}

#[test]
fn water_is_known_to_150_degrees_under_pressure() {
    let hot = solved(&plate(100.0, "inlet_temperature = \"140 degC\"\npressure = \"8 bar\"", "")).unwrap();
    // The film in turbulent flow at 140 degC is some 2.5 times that at 20 degC.
    let cold = solved(&plate(100.0, "", "")).unwrap();
    assert!(hot.coolant["pass"].h_W_m2K > 1.5 * cold.coolant["pass"].h_W_m2K && hot.coolant["pass"].note.is_none());
    refused(&plate(100.0, "inlet_temperature = \"151 degC\"\npressure = \"8 bar\"", ""), &["circuit.loop", "151.00 degC", "150 degC"]);
    // 420 W heat 0.3 L/min by some 20 K.
    refused(
        &plate(420.0, "inlet_temperature = \"140 degC\"\nflow = \"0.3 L/min\"\npressure = \"10 bar\"", ""),
        &["'pass'", "leaves the range", "150.0 degC"],
    );
}

#[test]
fn boiling_is_refused_in_bulk_and_said_at_the_wall() {
    let circuit = "inlet_temperature = \"90 degC\"\nflow = \"0.5 L/min\"";
    refused(&plate(800.0, circuit, ""), &["'pass'", "boils", "1.0132 bar", "99.97 degC", "circuit.loop.pressure"]);
    assert!(solved(&plate(800.0, &format!("{circuit}\npressure = \"3 bar\""), "")).is_ok());
    // The bulk stays at 90 degC, the wall does not.
    let wall = solved(&plate(1500.0, "inlet_temperature = \"90 degC\"\nflow = \"4 L/min\"", "")).unwrap();
    let note = wall.coolant["pass"].note.clone().unwrap_or_default();
    assert!(note.contains("the wall reaches") && note.contains("99.97 degC"), "{note}");
    refused(&plate(1.0, "inlet_temperature = \"105 degC\"", ""), &["steam", "100.0 degC", "inlet_temperature"]);
    refused(&plate(1.0, "pressure = \"20 bar\"", ""), &["0.01 to 10 bar"]);
}

/// Water at rest carries nothing: what the plate gets leaves through its film, and the water has the temperature of its wall.
#[test]
fn without_flow_the_water_stands_still() {
    let still = solved(&plate(10.0, "flow = \"0 L/min\"", "")).unwrap();
    // 10 W through 10 W/(m2 K) on 0.02 m2; the aluminium is even to a hundredth of that.
    assert!((still.sensors["plate"] - 70.0).abs() < 0.1 && (still.sensors["out"] - still.sensors["plate"]).abs() < 0.1);
    assert!(still.coolant["pass"].note.as_deref().unwrap_or_default().contains("stands still"));
    refused(&plate(20.0, "flow = \"0 L/min\"", ""), &["stands still and boils", "99.97 degC"]);
}

const OIL: &str = "[fluid.oil]\nsource = \"a maker's sheet\"\ndensity = [[\"0 degC\", \"880 kg/m3\"], [\"100 degC\", \"820 kg/m3\"]]\n\
                   specific_heat = \"1900 J/(kg K)\"\nconductivity = [[\"0 degC\", \"0.135 W/(m K)\"], [\"100 degC\", \"0.125 W/(m K)\"]]\n\
                   viscosity = [[\"0 degC\", \"0.3 Pa s\"], [\"40 degC\", \"0.03 Pa s\"], [\"100 degC\", \"0.004 Pa s\"]]";

#[test]
fn a_fluid_follows_its_tables() {
    let machine: Machine = plate(1.0, "liquid = \"oil\"", OIL).parse().unwrap();
    let liquid = machine.circuits[0].liquid.clone();
    let at = |celsius: f64| liquid.at(celsius + 273.15).unwrap();
    assert!((at(25.0).density - 865.0).abs() < 1e-9 && at(25.0).specific_heat == 1900.0);
    assert!((at(50.0).conductivity - 0.13).abs() < 1e-12);
    assert!((at(40.0).viscosity - 0.03).abs() < 1e-12);
    // Andrade's law ln mu = a + b/T between two points is met exactly.
    let b = (0.3f64 / 0.03).ln() / (1.0 / 273.15 - 1.0 / 313.15);
    assert!((at(20.0).viscosity / (0.03 * (b * (1.0 / 293.15 - 1.0 / 313.15)).exp()) - 1.0).abs() < 1e-12);
    assert!(matches!(liquid, Liquid::Table(_)) && liquid.at(374.0).is_err() && liquid.boils_at(1e5).is_none());
    refused(&plate(1.0, "liquid = \"oil\"\ninlet_temperature = \"-5 degC\"", OIL), &["'oil'", "-5.00 degC", "0.0 and 100.0 degC"]);
    refused(&plate(1.0, "liquid = \"oli\"", OIL), &["there is no liquid 'oli'", "oil"]);
    refused(&plate(1.0, "", "[fluid.water]\ndensity = \"1 kg/m3\""), &["'water' is there already"]);
    refused(
        &plate(1.0, "", &OIL.replace("[[\"0 degC\", \"880 kg/m3\"], [\"100 degC\", \"820 kg/m3\"]]", "[[\"0 degC\", \"880 kg/m3\"]]")),
        &["two points"],
    );
}

/// The balance of the coolant holds whatever flows: heat is mass flow times the rise of the enthalpy.
#[test]
fn oils_and_mixtures_carry_the_heat() {
    for name in ["oil", "ethylene glycol 30 %", "propylene glycol 50 %"] {
        let text = plate(200.0, &format!("liquid = \"{name}\"\ninlet_temperature = \"30 degC\"\ndissipation = false"), OIL);
        let text = text.replace("film = \"10 W/(m2 K)\"\nfluid_temperature = \"20 degC\"", "heat_flux = \"0 W/m2\"");
        let machine: Machine = text.parse().unwrap();
        let (liquid, found) = (&machine.circuits[0].liquid, solved(&text).unwrap());
        let mass_flow = 2e-3 / 60.0 * liquid.at(303.15).unwrap().density;
        let outlet = found.sensors["out"];
        let rise = 200.0 / (mass_flow * liquid.mean_specific_heat(303.15, outlet + 273.15));
        assert!((outlet - 30.0 - rise).abs() < 1e-6, "{name}: {outlet} and {}", 30.0 + rise);
    }
}

/// Between the points of the built-in tables: SecCool's fits of the ASHRAE tables, evaluated with CoolProp 8.0.
#[test]
fn mixtures_stand_beside_their_source() {
    let cases = [
        ("ethylene glycol 30 %", 25.0, 1043.31, 3659.6, 0.45885, 1.88383e-03),
        ("ethylene glycol 50 %", 75.0, 1042.04, 3493.0, 0.40992, 1.08591e-03),
        ("propylene glycol 30 %", 5.0, 1034.46, 3806.7, 0.42866, 5.70363e-03),
        ("propylene glycol 50 %", 35.0, 1034.15, 3589.8, 0.36957, 3.60496e-03),
        ("ethylene glycol 20 %", 95.0, 990.09, 3987.3, 0.55466, 4.52270e-04),
    ];
    for (name, celsius, density, heat, conductivity, viscosity) in cases {
        let machine: Machine = plate(1.0, &format!("liquid = \"{name}\""), "").parse().unwrap();
        let state = machine.circuits[0].liquid.at(celsius + 273.15).unwrap();
        let near = |value: f64, expected: f64, tolerance: f64| {
            assert!((value / expected - 1.0).abs() < tolerance, "{name} at {celsius} degC: {value} and {expected}");
        };
        near(state.density, density, 3e-4);
        near(state.specific_heat, heat, 3e-4);
        near(state.conductivity, conductivity, 1.5e-3);
        near(state.viscosity, viscosity, 6e-3);
    }
}

#[test]
fn films_by_a_formula_are_read_or_refused() {
    let with = |lines: &str| plate(1.0, "", "").replace("diameter = \"8 mm\"", &format!("diameter = \"8 mm\"\n{lines}"));
    assert!(solved(&with("nusselt = \"0.023 * Re^0.8 * Pr^0.4\"")).is_ok());
    refused(&with("nusselt = \"0.023 * Ré^0.8\""), &["channel.pass.nusselt", "Re, Pr, Pr_wall"]);
    refused(&with("nusselt = \"4\"\nfilm = \"correlation\""), &["nusselt", "film"]);
    refused(&with("nusselt = \"4\"\nbend_factor = 1.2"), &["a given film has no 'bend_factor'"]);
    refused(&with("nusselt = \"10 - Re\""), &["channel.pass.nusselt", "not larger than zero", "10 - Re at Re = "]);
    refused(&with("nusselt = \"1 / (Re - Re)\""), &["channel.pass", "not finite"]);
    let taken = with("nusselt = \"Re\"").replace("[part.plate]", "[define]\nRe = \"3\"\n[part.plate]");
    refused(&taken, &["channel.pass.nusselt", "'Re'", "rename"]);
}
