//! Sweep files into conditions, and what is wrong with them.

use coldplate_base::document::Document;
use coldplate_base::units::{self, Dimension};
use coldplate_describe::machine::DescribedVariable;
use coldplate_explore::sweep::{Plan, Purpose, SweepDefinition};

pub fn variables() -> Vec<DescribedVariable> {
    let variable = |name: &str, unit: &str, dimension, default| DescribedVariable {
        name: name.into(),
        unit: unit.into(),
        dimension,
        default,
        range: None,
    };
    vec![
        variable("coolant_flow", "L/min", Dimension::VOLUME_FLOW, None),
        variable("coolant_temperature", "degC", Dimension::TEMPERATURE, None),
        variable("motor_speed", "rpm", Dimension::ANGULAR_SPEED, None),
        variable("ambient_temperature", "degC", Dimension::TEMPERATURE, Some(293.15)),
    ]
}

pub fn plan_of(text: &str) -> coldplate_base::error::Result<Plan> {
    let text = format!("name = 'test'\nmachine = '../machines/rig.toml'\n{text}");
    SweepDefinition::new(Document::parse(&text, "sweeps/test.toml")?)?.plan(&variables())
}

pub const HOLD: &str = "[hold]\ncoolant_temperature = '20 degC'\nmotor_speed = '2500 rpm'\n";

#[test]
fn the_ranges_of_a_design_are_filled_and_the_rest_is_held() {
    let text = "[design]\nkind = 'latin_hypercube'\nruns = 20\nseed = 3\n[range]\nmotor_speed = ['250 rpm', '2500 rpm']\n\
         coolant_flow = ['2.355 L/min', '18.84 L/min']\n[hold]\ncoolant_temperature = '20.5 degC'\n[validation]\nruns = 7\nseed = 9\n";
    let plan = plan_of(text).unwrap();
    assert_eq!(
        plan.groups.iter().map(|g| (g.purpose, g.rows.clone())).collect::<Vec<_>>(),
        [(Purpose::Fit, 0..20), (Purpose::Validation, 20..27)]
    );
    assert_eq!(plan.groups[0].varied, [0, 2]);
    let column = |v: usize| plan.shown[..20].iter().map(|row| row[v]).collect::<Vec<_>>();
    let ends = |values: Vec<f64>| values.into_iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    assert_eq!(ends(column(0)), (2.355, 18.84));
    assert_eq!(ends(column(2)), (250.0, 2500.0));
    assert!(column(1).iter().all(|v| *v == 20.5) && column(3).iter().all(|v| *v == 20.0));
    // A row of the table, typed with its unit, is the very same condition.
    for (shown, si) in plan.shown.iter().zip(&plan.conditions) {
        for ((shown, si), variable) in shown.iter().zip(si).zip(&plan.variables) {
            assert_eq!(units::parse(&format!("{shown} {}", variable.unit), variable.dimension).unwrap(), *si);
        }
    }
    assert_ne!(plan.hash(), plan_of(&text.replace("seed = 3", "seed = 4")).unwrap().hash());
    assert_eq!(plan.hash(), plan_of(text).unwrap().hash());
}

#[test]
fn the_papers_one_factor_sweeps_can_be_written() {
    let plan = plan_of(
        "[[one_factor]]\nname = 'table 7'\nvariable = 'coolant_flow'\nlow = '3.925e-5 m3/s'\nhigh = '3.14e-4 m3/s'\npoints = 9\ndegree = 3\n\
         hold = { coolant_temperature = '20 degC', motor_speed = '2500 rpm', ambient_temperature = '20 degC' }\n\
         [[one_factor]]\nname = 'table 9'\nvariable = 'motor_speed'\nlow = '250 rpm'\nhigh = '2500 rpm'\npoints = 10\ndegree = 2\n\
         hold = { coolant_temperature = '20 degC', coolant_flow = '1.57e-4 m3/s', ambient_temperature = '23.5 degC' }\n",
    )
    .unwrap();
    assert_eq!(
        plan.groups.iter().map(|g| (g.name.as_str(), g.degree, g.rows.clone())).collect::<Vec<_>>(),
        [("table 7", Some(3), 0..9), ("table 9", Some(2), 9..19)]
    );
    assert_eq!(plan.shown[0], [2.355, 20.0, 2500.0, 20.0]);
    assert_eq!(plan.shown[8], [18.84, 20.0, 2500.0, 20.0]);
    assert_eq!(plan.shown[10], [9.42, 20.0, 500.0, 23.5]);
}

#[test]
fn one_factor_sweeps_may_stand_beside_a_design() {
    let plan = plan_of(&format!(
        "[design]\nkind = 'sobol'\nruns = 4\n[range]\ncoolant_flow = ['3 L/min', '9 L/min']\n[validation]\nruns = 2\n\
         [[one_factor]]\nvariable = 'motor_speed'\nlow = '250 rpm'\nhigh = '750 rpm'\npoints = 3\nhold = {{ coolant_flow = '5 L/min' }}\n{HOLD}"
    ))
    .unwrap();
    let names: Vec<_> = plan.groups.iter().map(|g| (g.name.as_str(), g.rows.clone())).collect();
    assert_eq!(names, [("design", 0..4), ("validation", 4..6), ("motor_speed", 6..9)]);
    assert_eq!(plan.shown[7], [5.0, 20.0, 500.0, 20.0]);
}

#[test]
fn factorial_sobol_and_corners() {
    let plan = plan_of(&format!(
        "[design]\nkind = 'factorial'\npoints = 3\n[range]\ncoolant_flow = ['3 L/min', '9 L/min']\n\
         [levels]\nambient_temperature = ['18 degC', '24 degC']\n{HOLD}"
    ))
    .unwrap();
    assert_eq!(
        plan.shown.iter().map(|r| (r[0], r[3])).collect::<Vec<_>>(),
        [(3.0, 18.0), (3.0, 24.0), (6.0, 18.0), (6.0, 24.0), (9.0, 18.0), (9.0, 24.0)]
    );
    let range = "[range]\ncoolant_flow = ['3 L/min', '9 L/min']\nambient_temperature = ['18 degC', '24 degC']\n";
    let plan = plan_of(&format!("[design]\nkind = 'sobol'\nruns = 4\n{range}{HOLD}")).unwrap();
    assert_eq!(plan.shown.iter().map(|r| (r[0], r[3])).collect::<Vec<_>>(), [(3.0, 18.0), (6.0, 21.0), (7.5, 19.5), (4.5, 22.5)]);
    let plan = plan_of(&format!("[design]\nkind = 'latin_hypercube'\nruns = 12\ncorners = true\n{range}{HOLD}")).unwrap();
    assert_eq!(plan.shown.len(), 12);
    for corner in [(3.0, 18.0), (3.0, 24.0), (9.0, 18.0), (9.0, 24.0)] {
        assert!(plan.shown.iter().any(|r| (r[0], r[3]) == corner));
    }
    let plan =
        plan_of(&format!("[design]\nkind = 'latin_hypercube'\nruns = 3\n{range}[spacing]\ncoolant_flow = 'reciprocal'\n{HOLD}")).unwrap();
    assert!(plan.shown.iter().any(|r| r[0] == 4.5), "the middle of 1/3 and 1/9 is 1/4.5: {:?}", plan.shown);
}

#[test]
fn a_list_comes_from_a_table() {
    let folder = std::env::temp_dir().join(format!("coldplate-design-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let read = |csv: &str| {
        std::fs::write(folder.join("list.csv"), csv).unwrap();
        let text = format!("name = 't'\nmachine = 'm.toml'\n[design]\nkind = 'list'\nfile = 'list.csv'\n{HOLD}");
        SweepDefinition::new(Document::parse(&text, folder.join("s.toml")).unwrap()).unwrap().plan(&variables())
    };
    let plan = read("test,coolant_flow [m3/s],ambient_temperature [K],motor [degC]\na,1.57e-4,296.65,20\nb,3.14e-4,293.15,21\n").unwrap();
    assert_eq!(plan.shown, [[9.42, 20.0, 2500.0, 23.5], [18.84, 20.0, 2500.0, 20.0]]);
    for (csv, needles) in [
        ("coolant_flw [L/min]\n1\n", ["coolant_flw", "did you mean 'coolant_flow'"]),
        ("coolant_flow\n1\n", ["list.csv", "coolant_flow [unit]"]),
        ("coolant_flow [degC]\n1\n", ["coolant_flow [degC]", "L/min"]),
        ("coolant_flow [L/min],ambient_temperature [degC]\n1,\n", ["ambient_temperature", "row 1 is missing"]),
        ("motor [degC]\n1\n", ["no conditions", "coolant_flow"]),
    ] {
        let message = read(csv).unwrap_err().to_string();
        assert!(needles.iter().all(|n| message.contains(n)), "{csv}: {message}");
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn changes_to_the_machine_are_handed_on() {
    let text = "name = 't'\nmachine = '../m/rig.toml'\ncells = 5000\n[set]\n'contact.motor.conductance' = '600 +- 40 W/(m2 K)'\n\
                channel.a.bend_factor = 1.5\npart.bed.at = ['1 m', '2 m']\npart.bed.fine = true\n";
    let definition = SweepDefinition::new(Document::parse(text, "sweeps/x.toml").unwrap()).unwrap();
    assert_eq!(definition.machine.as_deref(), Some(std::path::Path::new("sweeps/../m/rig.toml")));
    assert_eq!(definition.cells, Some(5000));
    let expected = [
        // What is stated as uncertain stays so.
        ("contact.motor.conductance", "600 W/(m2 K) +- 40.0 W/(m2 K)"),
        ("channel.a.bend_factor", "1.5"),
        ("part.bed.at", "[\"1 m\", \"2 m\"]"),
        ("part.bed.fine", "true"),
    ];
    assert_eq!(definition.set, expected.map(|(k, v)| (k.to_string(), v.to_string())));
}

#[test]
fn mistakes_name_line_key_and_remedy() {
    let lhs = "[design]\nkind = 'latin_hypercube'\nruns = 10\n";
    let flow = "[range]\ncoolant_flow = ['3 L/min', '9 L/min']\n";
    for (text, needles) in [
        (format!("{lhs}{flow}[hold]\nmotor_speed = '1 rpm'\n"), vec!["coolant_temperature", "neither a range nor a value", "[hold]"]),
        (
            format!("{lhs}[range]\ncoolant_flo = ['3 L/min', '9 L/min']\n{HOLD}"),
            vec!["sweeps/test.toml:7", "coolant_flo", "did you mean 'coolant_flow'"],
        ),
        (
            format!("{lhs}[range]\ncoolant_flow = ['3 L/min', '9 bar']\n{HOLD}"),
            vec!["sweeps/test.toml:7", "coolant_flow", "9 bar", "L/min"],
        ),
        (format!("{lhs}[range]\ncoolant_flow = ['9 L/min', '3 L/min']\n{HOLD}"), vec!["sweeps/test.toml:7", "lowest, highest"]),
        (format!("{lhs}[range]\nmotor_speed = ['1 rpm', '2 rpm']\n{HOLD}"), vec!["sweeps/test.toml:7", "both varied and held"]),
        (format!("{lhs}seeed = 3\n{flow}{HOLD}"), vec!["sweeps/test.toml:6", "seeed", "did you mean 'seed'"]),
        (format!("[design]\nkind = 'latin'\n{flow}{HOLD}"), vec!["sweeps/test.toml:4", "latin", "latin_hypercube"]),
        (format!("{lhs}{HOLD}"), vec!["no variable is varied", "[range]"]),
        (
            format!("{lhs}[range]\ncoolant_flow = ['0 L/min', '9 L/min']\n[spacing]\ncoolant_flow = 'reciprocal'\n{HOLD}"),
            vec!["above zero"],
        ),
        (format!("{lhs}{flow}[spacing]\nmotor_speed = 'log'\n{HOLD}"), vec!["motor_speed", "spacing but no range"]),
        (format!("[design]\nkind = 'factorial'\n{flow}{HOLD}"), vec!["points = 3"]),
        (format!("[design]\nkind = 'factorial'\npoints = 2000000\n{flow}{HOLD}"), vec!["sweeps/test.toml:4", "1000000"]),
        (format!("[design]\nkind = 'latin_hypercube'\nruns = 3\ncorners = true\n{flow}{HOLD}"), vec!["sweeps/test.toml:5", "corners"]),
        (
            "[[one_factor]]\nvariable = 'coolant_flow'\nlow = '9 L/min'\nhigh = '3 L/min'\npoints = 3\n".into(),
            vec!["sweeps/test.toml:6", "exchange"],
        ),
        (format!("{lhs}{flow}[validation]\nrun = 3\n{HOLD}"), vec!["sweeps/test.toml:8", "runs"]),
        (
            "[[one_factor]]\nvariable = 'coolant_flow'\nlow = '3 L/min'\nhigh = '9 L/min'\npoints = 3\n[validation]\nruns = 3\n[hold]\n\
             coolant_temperature = '20 degC'\nmotor_speed = '1 rpm'\n"
                .into(),
            vec!["sweeps/test.toml:8", "validation"],
        ),
        (String::new(), vec!["design"]),
    ] {
        let message = plan_of(&text).unwrap_err().to_string();
        assert!(needles.iter().all(|n| message.contains(n)), "{text}\n{message}");
    }
}

/// Every followed variable is moved alone at as many conditions as asked for, however many that are, and all together at others.
#[test]
fn followed_variables_are_moved_alone_and_together() {
    for runs in [5, 7, 14, 21] {
        let text = format!(
            "name = \"f\"\nmachine = \"m.toml\"\n[range]\ncoolant_flow = [\"2 L/min\", \"8 L/min\"]\nmotor_speed = [\"500 rpm\", \"3000 rpm\"]\n\
             [design]\nkind = \"sobol\"\nruns = 32\n[follow]\nvariables = \"all\"\nruns = {runs}\n"
        );
        let machine =
            coldplate_describe::machine::Machine::read(coldplate_testing::root().join("examples/tutorial/machine.toml"), &[]).unwrap();
        let definition =
            coldplate_explore::sweep::SweepDefinition::new(coldplate_base::document::Document::parse(&text, "f.toml").unwrap()).unwrap();
        let plan = definition.plan(&machine.variables).unwrap();
        let group = |name: &str| plan.groups.iter().find(|g| g.name == name).unwrap().rows.clone();
        let alone = group("follow");
        assert_eq!(alone.len(), 2 * 2 * runs);
        for (own, held) in [(1, 293.15), (3, 295.15)] {
            let moved: Vec<&Vec<f64>> = plan.conditions[alone.clone()].iter().filter(|row| (row[own] - held).abs() > 1e-9).collect();
            // The held value itself may be among those that lie evenly.
            assert!(moved.len() + 2 >= 2 * runs, "{}", moved.len());
            let mut at: Vec<u64> = moved.iter().map(|row| row[0].to_bits()).collect();
            at.sort_unstable();
            at.dedup();
            assert_eq!(at.len(), runs, "every condition is met");
        }
        assert!(group("follow together").len() >= 12 && group("follow check").len() >= 10);
    }
    let machine =
        coldplate_describe::machine::Machine::read(coldplate_testing::root().join("examples/tutorial/machine.toml"), &[]).unwrap();
    let refused = |follow: &str| {
        let text = format!(
            "name = \"f\"\nmachine = \"m.toml\"\n[range]\ncoolant_flow = [\"2 L/min\", \"8 L/min\"]\nmotor_speed = [\"500 rpm\", \"3000 rpm\"]\n\
             [design]\nkind = \"sobol\"\nruns = 32\n[follow]\n{follow}\n"
        );
        let document = coldplate_base::document::Document::parse(&text, "f.toml").unwrap();
        coldplate_explore::sweep::SweepDefinition::new(document).and_then(|d| d.plan(&machine.variables)).unwrap_err().to_string()
    };
    assert!(refused("variables = [\"motor_speed\"]").contains("is varied, not held"));
    assert!(refused("variables = [\"motor_sped\"]").contains("did you mean 'motor_speed'"));
    assert!(refused("variables = \"some\"").contains("is a list, or \"all\""));
    assert!(refused("").contains("variables"));
}
