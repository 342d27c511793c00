//! The laws of contacts and sources, from a machine file on.

use coldplate_describe::machine::{ContactLaw, Interface, LinearPower, Machine, Slope, SourceLaw};
use coldplate_solve::meshed::MeshedMachine;

/// Every law as lines of a contact between two steel blocks.
const LAWS: [(&str, &str); 7] = [
    ("conductance", "conductance = \"500 W/(m2 K)\""),
    ("total_conductance", "total_conductance = \"5 W/K\""),
    ("temperature_table", "temperature_table = [[\"0 degC\", \"300 W/(m2 K)\"], [\"100 degC\", \"900 W/(m2 K)\"]]"),
    ("pressure_table", "pressure_table = [[\"0.1 MPa\", \"300 W/(m2 K)\"], [\"1 MPa\", \"900 W/(m2 K)\"]]\npressure = \"0.4 MPa\""),
    (
        "rough",
        "rough = { roughness = \"1 um\", slope = 0.1, hardness = \"2 GPa\", pressure = \"1 MPa\", gas = { pressure = \"10 Pa\" }, emissivity = \
         [0.2, 0.3] }",
    ),
    ("bonded", "bonded = true"),
    ("insulated", "insulated = true"),
];

fn machine(law: &str) -> Machine {
    let text = format!(
        "name = \"two blocks\"\n[variables]\ncoolant_flow = \"1 L/min\"\ncoolant_temperature = \"20 degC\"\nmotor_speed = \"0 rpm\"\n\
         ambient_temperature = \"20 degC\"\n\
         [part.low]\nmaterial = \"steel\"\nbox = [\"0.1 m\", \"0.1 m\", \"20 mm\"]\n\
         [part.high]\nmaterial = \"steel\"\nbox = [\"0.1 m\", \"0.1 m\", \"20 mm\"]\non = \"low.+z\"\n\
         [contact.joint]\nbetween = [\"low.+z\", \"high.-z\"]\n{law}\n\
         [boundary.cold]\nfaces = [\"low.-z\"]\ntemperature = \"20 degC\"\n[boundary.hot]\nfaces = [\"high.+z\"]\ntemperature = \"80 degC\"\n\
         [sensor.low]\nface = \"low.+z\"\n[sensor.high]\nface = \"high.-z\"\n"
    );
    text.parse().unwrap()
}

#[test]
fn every_contact_law_runs_from_a_machine_file() {
    assert_eq!(LAWS.map(|(name, _)| name), ContactLaw::names(), "every law has its lines here");
    for (name, lines) in LAWS {
        let machine = machine(lines);
        let law = machine.contacts[0].law.clone();
        let steel = |temperature: f64| machine.materials[0].conductivity[0].with_slope(temperature);
        let at = |temperature: f64| {
            let (value, slope) = steel(temperature);
            law.conductance(&Interface { area: 0.01, temperature, conductivities: [Some(Slope { value, slope }); 2] })
        };
        let (here, step) = (at(323.0), 0.01);
        let difference = (at(323.0 + step).value - at(323.0 - step).value) / (2.0 * step);
        if here.value.is_finite() {
            assert!((here.slope - difference).abs() <= 1e-6 * here.value, "{name}: {} and {difference}", here.slope);
            assert!(law.follows_temperature() || here.slope == 0.0, "{name}");
        }
        // One-dimensional: steel, contact, steel in series.
        let expected = 60.0 / (2.0 * 0.02 / (steel(323.15).0 * 0.01) + 1.0 / (at(323.15).value * 0.01));
        let model = MeshedMachine::new(machine, Some(200)).unwrap();
        let condition = model.machine.condition(&[]).unwrap();
        let state = model.solve(&model.solver(&condition).unwrap(), &condition).unwrap();
        let joints = model.network.contacts[0].joints.clone();
        let heat: f64 = model.network.joints[joints]
            .iter()
            .map(|j| model.network.joint_heat(j, &state.solution.temperatures, &state.load.contacts))
            .sum();
        assert!((heat.abs() - expected).abs() <= 1e-3 * expected.abs() + 1e-9, "{name}: {heat} W and {expected} W");
    }
}

/// The law of a source on the lower block, stated by these lines.
fn source_law(lines: &str) -> SourceLaw {
    let source = format!("conductance = \"500 W/(m2 K)\"\n[source.heater]\nin = \"low\"\npower = \"20 W\"\n{lines}");
    machine(&source).sources[0].law.clone()
}

#[test]
fn laws_of_sources_are_read_with_their_derivatives() {
    let constant = source_law("");
    assert_eq!(constant, source_law("temperature_coefficient = \"0 1/K\"\nreference_temperature = \"20 degC\""));
    assert_eq!((constant.power(20.0, 350.0), constant.follows_temperature()), (Slope::constant(20.0), false));

    let copper = source_law("temperature_coefficient = \"0.39 %/K\"\nreference_temperature = \"25 degC\"");
    let power = |temperature: f64| copper.power(20.0, temperature).value;
    assert!(copper.follows_temperature() && (power(308.15) - 20.78).abs() < 1e-12, "{}", power(308.15));
    let difference = power(309.0) - power(308.0);
    assert!((copper.power(20.0, 308.5).slope - difference).abs() < 1e-12, "{difference}");
    let law = copper.linear().unwrap();
    let more = LinearPower { coefficient: law.coefficient + 0.001, ..law };
    let difference = (SourceLaw::Linear(more).power(20.0, 320.0).value - power(320.0)) / 0.001;
    assert!((law.per_coefficient(20.0, 320.0) - difference).abs() < 1e-9, "{difference}");
    // A source never turns into a sink.
    assert_eq!(copper.power(20.0, 1.0), Slope::constant(0.0));

    let only_reference = source_law("reference_temperature = \"25 degC\"");
    assert!(!only_reference.follows_temperature() && only_reference.note().is_some() && copper.note().is_none());
}
