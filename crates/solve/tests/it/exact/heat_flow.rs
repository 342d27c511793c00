//! Heat-flow sensors: through contacts, boundaries, faces and into water, with the sign each states.

use coldplate_describe::machine::Machine;
use coldplate_solve::meshed::MeshedMachine;

use crate::bench::{self, Solved, check, solve};

fn watts(run: &Solved, name: &str) -> f64 {
    run.model.record(&run.state).heat_flows[name]
}

/// Two slabs between 80 and 20 degC with a contact of 400 W/(m2 K): everywhere the same heat, exact on any mesh.
#[test]
fn two_slabs_and_their_contact() {
    let text = r#"
        [material.steel]
        conductivity = "20 W/(m K)"
        [part.left]
        material = "steel"
        box = ["0.1 m", "20 mm", "20 mm"]
        surface = "none"
        [part.right]
        material = "steel"
        box = ["0.1 m", "30 mm", "30 mm"]
        at = ["0.1 m", "-5 mm", "-5 mm"]
        surface = "none"
        [contact.joint]
        between = ["left", "right"]
        conductance = "400 W/(m2 K)"
        [boundary.hot]
        faces = ["left.-x"]
        temperature = "80 degC"
        [boundary.cold]
        faces = ["right.+x"]
        film = "50 W/(m2 K)"
        fluid_temperature = "20 degC"
        [heat_flow.joint]
        contact = "joint"
        [heat_flow.back]
        contact = "joint"
        out_of = "right"
        [heat_flow.hot]
        boundary = "hot"
        [heat_flow.cold]
        boundary = "cold"
        [heat_flow.enters]
        face = "left.-x"
        [heat_flow.leaves_left]
        face = "left.+x"
        [heat_flow.into_right]
        face = "right.-x"
        [heat_flow.leaves_right]
        face = "right.+x"
        [heat_flow.side]
        face = "left.+y"
    "#;
    let run = solve(text, 0.01);
    let heat = run.heat_in("hot");
    assert!(heat > 1.0, "{heat}");
    for (name, sign) in [
        ("joint", 1.0),
        ("back", -1.0),
        ("hot", -1.0),
        ("cold", 1.0),
        ("enters", -1.0),
        ("leaves_left", 1.0),
        ("into_right", -1.0),
        ("leaves_right", 1.0),
        ("side", 0.0),
    ] {
        check("own", &format!("heat flow '{name}', W"), watts(&run, name), sign * heat, heat, 1e-8);
    }
    // In a straight bar the heat is known: 60 K over two slabs, the contact and the film.
    let straight = solve(&text.replace("\"30 mm\", \"30 mm\"", "\"20 mm\", \"20 mm\"").replace("-5 mm", "0 mm"), 0.01);
    let exact = 4e-4 * 60.0 / (0.1 / 20.0 + 1.0 / 400.0 + 0.1 / 20.0 + 1.0 / 50.0);
    check("own", "heat flow through bars and contact, W", watts(&straight, "joint"), exact, exact, 1e-9);
    check("own", "heat flow out of a face under a film, W", watts(&straight, "leaves_right"), exact, exact, 1e-9);
}

/// A block with 50 W on a cooled plate: what its faces give off is its power, what the plate takes goes into the water.
#[test]
fn a_motor_on_a_plate() {
    let text = r#"
        [chamber]
        pressure = "1 Pa"
        [surfaces]
        emissivity = 0.7
        [part.plate]
        material = "aluminium"
        box = ["0.2 m", "0.1 m", "20 mm"]
        [part.motor]
        material = "steel"
        box = ["60 mm", "50 mm", "70 mm"]
        on = "plate.+z"
        [contact.foot]
        between = ["plate", "motor"]
        LAW
        [boundary.lamp]
        faces = ["plate.+z"]
        heat_flux = "500 W/m2"
        [boundary.air]
        faces = ["plate.-z", "plate.+z"]
        film = "7 W/(m2 K)"
        fluid_temperature = "30 degC"
        [source.motor]
        in = "motor"
        power = "50 W"
        [channel.hole]
        in = "plate"
        diameter = "8 mm"
        path = [["0 mm", "50 mm", "10 mm"], ["200 mm", "50 mm", "10 mm"]]
        [circuit.water]
        layout = ["hole"]
        dissipation = false
        liquid = { density = "1000 kg/m3", specific_heat = "4000 J/(kg K)", viscosity = "1 mPa s", conductivity = "0.6 W/(m K)" }
        [sensor.out]
        outlet = "hole"
        [heat_flow.water]
        channel = "hole"
        [heat_flow.foot]
        contact = "foot"
        out_of = "motor.-z"
    "#;
    for law in ["conductance = \"900 W/(m2 K)\"", "bonded = true"] {
        let mut text = text.replace("LAW", law);
        for part in ["plate", "motor"] {
            for side in ["-x", "+x", "-y", "+y", "-z", "+z"] {
                text += &format!("[heat_flow.\"{part} {side}\"]\nface = \"{part}.{side}\"\n");
            }
        }
        let run = solve(&text, 6e-3);
        let around =
            |part: &str| ["-x", "+x", "-y", "+y", "-z", "+z"].map(|side| watts(&run, &format!("{part} {side}"))).iter().sum::<f64>();
        check("own", "heat out of all faces of a motor, W", around("motor"), 50.0, 50.0, 1e-8);
        check("own", "heat out of all faces of its plate and into its water, W", around("plate") + watts(&run, "water"), 0.0, 50.0, 1e-8);
        check("own", "heat through the motor's foot, W", watts(&run, "foot"), watts(&run, "motor -z"), 50.0, 1e-8);
        let taken = 4e6 / 6e4 * (run.celsius("out") - 20.0);
        check("own", "heat into the water of a channel, W", watts(&run, "water"), taken, taken, 1e-9);
    }
}

#[test]
fn heat_flows_that_cannot_be() {
    let text = |flow: &str| {
        format!(
            r#"
        [material.steel]
        conductivity = "20 W/(m K)"
        [part.bar]
        material = "steel"
        box = ["0.1 m", "20 mm", "20 mm"]
        surface = "none"
        [part.far]
        material = "steel"
        box = ["0.1 m", "20 mm", "20 mm"]
        at = ["0.2 m", "0 mm", "0 mm"]
        surface = "none"
        [part.cover]
        material = "steel"
        box = ["0.1 m", "20 mm", "20 mm"]
        at = ["0 mm", "20 mm", "0 mm"]
        surface = "none"
        [contact.cover]
        between = ["bar", "cover"]
        conductance = "5 W/(m2 K)"
        [node.sink]
        temperature = "20 degC"
        [contact.sink]
        between = ["bar.+y", "sink"]
        conductance = "100 W/(m2 K)"
        area = "4 cm2"
        [contact.link]
        between = ["bar.+x", "far.-x"]
        total_conductance = "2 W/K"
        [source.heat]
        in = "far"
        power = "6 W"
        [heat_flow.q]
        {flow}
    "#
        )
    };
    let whole = |flow: &str| {
        let material = "[material.steel]\ndensity = \"7900 kg/m3\"\nspecific_heat = \"500 J/(kg K)\"";
        format!("name = \"case\"\n{}", text(flow).replace("[material.steel]", material))
    };
    for (flow, words) in [
        ("", "goes through nothing"),
        ("contact = \"sinks\"", "sink"),
        ("contact = \"sink\"\nout_of = \"far\"", "no such side"),
        ("face = \"bar\"", "face of a part"),
        ("face = \"bar.+x\"\nout_of = \"bar\"", "two sides"),
        ("boundary = \"air\"", "no boundary 'air'"),
        ("channel = \"hole\"", "no channel 'hole'"),
        ("contact = \"sink\"\nface = \"bar.+x\"", "contact"),
    ] {
        let error = Machine::from_text(&whole(flow), "case.toml", &[]).expect_err(flow).to_string();
        assert!(error.contains(words) && error.contains("heat_flow.q"), "{flow}: {error}");
    }
    // The covered face is joined to the sink all the same: the cells give that heat off, not the face's node.
    let machine = bench::machine(&text("face = \"bar.+y\""));
    let error = MeshedMachine::new(machine, Some(200)).unwrap_err().to_string();
    assert!(error.contains("stated area") && error.contains("heat_flow.q.face"), "{error}");
    // A link between places that do not touch, from either of them; an open face that one begins at.
    for (flow, heat) in [
        ("contact = \"link\"", -6.0),
        ("contact = \"link\"\nout_of = \"far\"", 6.0),
        ("face = \"far.-x\"", 6.0),
        ("contact = \"sink\"", 6.0),
    ] {
        let run = solve(&text(flow), 0.01);
        check("own", "heat flow through a link, W", watts(&run, "q"), heat, 6.0, 1e-8);
    }
}
