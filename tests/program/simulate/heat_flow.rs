//! Heat-flow sensors over time: columns in W, against closed forms, and as they were after a run is taken up again.

use super::{coldplate, json, numbers, scratch, write};

/// A node of 1000 J/K that 2 W/K join to 20 degC: 2 W/K x 40 K exp(-t / 500 s).
#[test]
fn heat_through_a_contact_falls_exponentially() {
    let folder = scratch("heat-flow");
    let machine = r#"
name = "a node that cools"
[variables]
coolant_temperature = "20 degC"
[node.coil]
capacity = "1000 J/K"
[node.plate]
temperature = "coolant_temperature"
[contact.joint]
between = ["coil", "plate"]
total_conductance = "2 W/K"
[sensor.coil]
node = "coil"
[heat_flow.out]
contact = "joint"
[heat_flow.coil]
contact = "joint"
out_of = "plate"
"#;
    let machine = write(&folder, "m.toml", machine);
    let schedule = write(&folder, "s.csv", "time [s],coolant_temperature [degC]\n0,20\n1500,20\n");
    let out = folder.join("out.csv").to_str().unwrap().to_string();
    let args = ["simulate", &machine, &schedule, "--from", "60 degC", "--tolerance", "1e-8 K", "--every", "100 s", "--json", "--out", &out];
    let found = json(&coldplate(&args));
    let (times, heats, back) =
        (numbers(&found["series"]["time_s"]), numbers(&found["heat_flows"]["out"]), numbers(&found["heat_flows"]["coil"]));
    assert_eq!(times.len(), 16);
    for ((t, heat), back) in times.iter().zip(&heats).zip(&back) {
        let exact = 80.0 * (-t / 500.0).exp();
        assert!((heat - exact).abs() < 1e-5 && (heat + back).abs() < 1e-12, "{t} s: {heat} W, exact {exact} W");
    }
    let table = std::fs::read_to_string(&out).unwrap();
    let header = table.lines().find(|l| !l.starts_with('#')).unwrap();
    assert!(header.ends_with("coil [degC],out [W],coil (heat flow) [W]"), "{header}");
    // What was written serves as a schedule: columns of heat flows are passed over like those of sensors.
    let again = json(&coldplate(&["simulate", &machine, &out, "--from", "60 degC", "--tolerance", "1e-8 K", "--json"]));
    assert!((numbers(&again["heat_flows"]["out"]).last().unwrap() - heats[15]).abs() < 1e-6);
    let text = coldplate(&["simulate", &machine, &schedule, "--from", "60 degC"]);
    let text = String::from_utf8_lossy(&text.stdout).to_string();
    assert!(text.contains("heat flow") && text.contains("+80.000"), "{text}");
}

/// Into the water: in the steady state what `solve` says, at the start and after an hour, and where a checkpoint is taken up.
#[test]
fn heat_into_water_over_time() {
    let folder = scratch("heat-flow-water");
    let machine = r#"
name = "a cooled plate"
[part.plate]
material = "aluminium"
box = ["0.4 m", "60 mm", "20 mm"]
[channel.hole]
in = "plate"
diameter = "8 mm"
path = [["0 mm", "30 mm", "10 mm"], ["400 mm", "30 mm", "10 mm"]]
[circuit.water]
layout = ["hole"]
[source.plate]
in = "plate"
power = "motor_speed_rpm"
[sensor.out]
outlet = "hole"
[heat_flow.water]
channel = "hole"
"#;
    let machine = write(&folder, "m.toml", machine);
    let columns = "time [s],coolant_flow [L/min],coolant_temperature [degC],motor_speed [rpm]\n";
    let schedule = write(&folder, "s.csv", format!("{columns}0,1,20,100\n0,1,20,300\n3600,1,20,300\n"));
    let checkpoint = folder.join("state").to_str().unwrap().to_string();
    let base = ["simulate", &machine, &schedule, "--cells", "1000", "--every", "60 s", "--json"];
    let whole = json(&coldplate(&base));
    let heats = numbers(&whole["heat_flows"]["water"]);
    assert!((heats[0] - 100.0).abs() < 1e-4 && heats[2] > 101.0, "{heats:?}");
    assert!((heats[heats.len() - 1] - 300.0).abs() < 1e-4, "{heats:?}");
    let with = [&base[..], &["--checkpoint", &checkpoint, "--checkpoint-every", "0 s"]].concat();
    json(&coldplate(&with));
    let resumed = json(&coldplate(&[&with[..], &["--resume"]].concat()));
    assert_eq!(numbers(&resumed["heat_flows"]["water"]), heats);
}
