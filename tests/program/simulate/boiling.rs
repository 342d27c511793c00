//! Walls at which the water boils are said by every command that solves.

use crate::simulate::{coldplate, scratch, write};

const PLATE: &str = r#"
name = "plate"
[variables]
coolant_flow = "4 L/min"
coolant_temperature = "90 degC"
motor_speed = "1000 rpm"
ambient_temperature = "20 degC"
[part.plate]
material = "aluminium 6061"
box = ["0.2 m", "0.1 m", "20 mm"]
[channel.pass]
in = "plate"
diameter = "8 mm"
path = [["0 mm", "50 mm", "10 mm"], ["200 mm", "50 mm", "10 mm"]]
[circuit.loop]
layout = ["pass"]
flow = "coolant_flow"
inlet_temperature = "coolant_temperature"
[source.heat]
in = "plate"
power = "1.5 * motor_speed_rpm"
[sensor.plate]
part = "plate"
"#;

#[test]
fn boiling_walls_are_said() {
    let folder = scratch("boiling");
    let machine = write(&folder, "m.toml", PLATE);
    let schedule = write(&folder, "s.csv", "time [s],motor_speed [rpm]\n0,0\n0,1000\n600,1000\n");
    let sweep = "name = \"s\"\nmachine = \"m.toml\"\n[hold]\ncoolant_flow = \"4 L/min\"\ncoolant_temperature = \"90 degC\"\n\
                 ambient_temperature = \"20 degC\"\n[[one_factor]]\nvariable = \"motor_speed\"\nlow = \"0 rpm\"\nhigh = \"1000 rpm\"\npoints = 5\n";
    let sweep = write(&folder, "s.toml", sweep);
    let out = folder.join("out");
    for (command, when) in [
        (&["simulate", &machine, &schedule, "--cells", "200"][..], " s on"),
        (&["sweep", &sweep, "--cells", "200", "--out", out.to_str().unwrap()], "of the conditions solved now"),
    ] {
        let output = coldplate(command);
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{said}");
        for word in ["channel 'pass'", when, "the wall reaches", "boils at 99.97 degC"] {
            assert!(said.contains(word), "{word}: {said}");
        }
    }
    // Half the heat, and nothing boils.
    let cool = write(&folder, "m.toml", PLATE.replace("1.5 *", "0.1 *"));
    let output = coldplate(&["simulate", &cool, &schedule, "--cells", "200"]);
    assert!(output.status.success() && !String::from_utf8_lossy(&output.stderr).contains("boils"));
}
