//! Machine files as text, small enough to be solved many times.

/// Two blocks that make heat, each joined to a water-cooled plate, in a radiating chamber.
pub const BLOCKS: &str = r#"
name = "two blocks on a plate"
# Nearly one temperature in each part, so that two meshes agree to a few millikelvin.
[material.even]
conductivity = "20000 W/(m K)"
density = "2700 kg/m3"
specific_heat = "900 J/(kg K)"
[part.plate]
material = "even"
box = ["200 mm", "120 mm", "20 mm"]
surface = { emissivity = 0.1 }
[part.motor]
material = "even"
box = ["80 mm", "60 mm", "40 mm"]
at = ["10 mm", "30 mm", "20 mm"]
surface = { emissivity = 0.8 }
[part.reducer]
material = "even"
box = ["60 mm", "60 mm", "40 mm"]
at = ["120 mm", "30 mm", "20 mm"]
surface = { emissivity = 0.6 }
[contact.motor]
between = ["motor", "plate"]
conductance = "700 W/(m2 K)"
[contact.reducer]
between = ["reducer", "plate"]
conductance = "500 W/(m2 K)"
[source.motor]
in = "motor"
power = "0.05 * motor_speed_rpm"
[source.reducer]
in = "reducer"
power = "0.02 * motor_speed_rpm"
[channel.hole]
in = "plate"
diameter = "8 mm"
path = [["0 mm", "60 mm", "10 mm"], ["200 mm", "60 mm", "10 mm"]]
[circuit.water]
flow = "coolant_flow"
inlet_temperature = "coolant_temperature"
layout = ["hole"]
[chamber]
temperature = "ambient_temperature"
[sensor.motor]
part = "motor"
[sensor.reducer]
part = "reducer"
[sensor.plate]
part = "plate"
[sensor.outlet]
outlet = "hole"
"#;

/// A source behind two conductances in series: motor = ambient + Q/G1 + Q/G2, middle = ambient + Q/G1.
pub const SERIES: &str = r#"# two nodes in a row
name = "two nodes in a row"
[node.base]
temperature = "ambient_temperature"
[node.middle]
capacity = "200 J/K"
[node.motor] # keep this remark
capacity = "1000 J/K"
[contact.first]
between = ["base", "middle"]
total_conductance = "2 W/K" # a guess
[contact.second]
between = ["middle", "motor"]
conductance = "400 W/(m2 K)" # 4 W/K over the area
area = "100 cm2"
[source.motor]
in = "motor"
power = "30 W"
[sensor.motor]
node = "motor"
[sensor.middle]
node = "middle"
"#;

/// A motor and a gear on two cold plates in series, a bracket with a bearing that only radiates and conducts.
pub const SMALL: &str = r#"
name = "Small machine"
[variables.coolant_flow]
unit = "L/min"
default = "4 L/min"
range = ["2 L/min", "8 L/min"]
[variables.coolant_temperature]
unit = "degC"
default = "20 degC"
range = ["18 degC", "26 degC"]
[variables.motor_speed]
unit = "rpm"
default = "2500 rpm"
range = ["250 rpm", "2500 rpm"]
[variables.ambient_temperature]
unit = "degC"
default = "23 degC"
range = ["20 degC", "28 degC"]
[chamber]
temperature = "ambient_temperature"
[material.aluminium]
conductivity = "167 W/(m K)"
density = "2700 kg/m3"
specific_heat = "896 J/(kg K)"
[material.steel]
conductivity = "45 W/(m K)"
density = "7800 kg/m3"
specific_heat = "470 J/(kg K)"
[surfaces]
effective_emissivity = 0.5
[part.plate]
material = "aluminium"
box = ["200 mm", "160 mm", "20 mm"]
surface = { effective_emissivity = 0.2 }
[part.motor]
material = "steel"
box = ["120 mm", "120 mm", "140 mm"]
at = ["40 mm", "20 mm", "20 mm"]
surface = { effective_emissivity = 0.55 }
[part.second_plate]
material = "aluminium"
box = ["160 mm", "160 mm", "20 mm"]
at = ["260 mm", "0 mm", "0 mm"]
surface = { effective_emissivity = 0.2 }
[part.gear]
material = "steel"
box = ["100 mm", "100 mm", "110 mm"]
at = ["290 mm", "30 mm", "20 mm"]
surface = { effective_emissivity = 0.5 }
[part.bracket]
material = "steel"
box = ["40 mm", "60 mm", "200 mm"]
at = ["420 mm", "40 mm", "0 mm"]
surface = { effective_emissivity = 0.3 }
[part.bearing]
material = "steel"
box = ["80 mm", "80 mm", "60 mm"]
at = ["420 mm", "40 mm", "200 mm"]
surface = { effective_emissivity = 0.4 }
[contact.motor]
between = ["motor", "plate"]
conductance = "500 W/(m2 K)"
[contact.gear]
between = ["gear", "second_plate"]
conductance = "600 W/(m2 K)"
[contact.foot]
between = ["bracket", "second_plate"]
conductance = "300 W/(m2 K)"
[contact.seat]
between = ["bearing", "bracket"]
conductance = "800 W/(m2 K)"
[source.motor]
in = ["motor"]
power = "0.036 * motor_speed_rpm"
[source.gear]
in = ["gear"]
power = "0.016 * motor_speed_rpm"
[source.bearing]
in = ["bearing"]
power = "0.0016 * motor_speed_rpm"
[channel.first]
in = "plate"
diameter = "8 mm"
serpentine = { passes = 5, along = "+y", across = "+x", pitch = "35 mm" }
bend_factor = 1.0
[channel.second]
in = "second_plate"
diameter = "8 mm"
serpentine = { passes = 5, along = "+y", across = "+x", pitch = "30 mm" }
bend_factor = 1.0
[circuit.water]
layout = ["first", "second"]
[sensor.motor]
part = "motor"
[sensor.gear]
part = "gear"
[sensor.plate]
point = ["20 mm", "80 mm", "10 mm"]
in = "plate"
[sensor."second plate"]
point = ["10 mm", "80 mm", "10 mm"]
in = "second_plate"
[sensor.bearing]
part = "bearing"
[sensor.bracket]
part = "bracket"
[sensor.outlet]
outlet = "second"
"#;
