//! The examples that are shipped, against what their problems have as exact results.

use coldplate_tables::Table;

use super::{folder, json, output, root, said};

/// The temperatures of the Python example, worked out here: plate and motor.
fn cold_plate(flow: f64, inlet: f64, heat: f64) -> (f64, f64) {
    let water = inlet + heat / (2.0 * 4180.0 * 998.0 / 60e3 * flow);
    let plate = water + heat / (14.0 * (flow / 4.0).powf(0.8));
    // motor - plate = heat / (9 (1 - 0.002 ((motor + plate) / 2 - 20))), a quadratic in the difference d
    let (a, b) = (9.0 * 0.001, 9.0 * (1.0 - 0.002 * (plate - 20.0)));
    (plate, plate + (b - (b * b - 4.0 * a * heat).sqrt()) / (2.0 * a))
}

#[test]
fn a_python_function_is_swept_fitted_and_asked() {
    if std::process::Command::new("python3").arg("--version").output().is_err() {
        println!("skipped: there is no python3");
        return;
    }
    let folder = folder("python");
    let sweep = root().join("examples/solvers/python/sweep.toml");
    let sweep = sweep.to_str().unwrap();
    let ran = json(&folder, &["run", sweep, "--out", "out/all"]);
    assert_eq!((&ran["conditions"], &ran["failed"]), (&50.into(), &0.into()), "{ran}");
    for point in ran["points"].as_array().unwrap() {
        assert!(point["held_out"]["max_K"].as_f64().unwrap() < 0.05, "{point}");
    }
    let table = Table::read(folder.join("out/all/sweep.csv")).unwrap();
    let column = |name: &str| &table.column(name).unwrap().values;
    for row in 0..table.rows() {
        let (plate, motor) = cold_plate(column("coolant_flow")[row], column("coolant_temperature")[row], column("heat")[row]);
        assert!((column("plate")[row] - plate).abs() < 1e-9, "row {row}: {} and {plate}", column("plate")[row]);
        assert!((column("motor")[row] - motor).abs() < 1e-9, "row {row}: {} and {motor}", column("motor")[row]);
    }
    assert_eq!(table.columns[3].unit, "degC");
    let solver = table.provenance.iter().find(|(key, _)| key == "solver").map(|(_, value)| value.as_str());
    assert_eq!(solver, Some("python3, version cold_plate.py 1.0"));
    for file in ["report.html", "surrogate.cps", "sweep.parquet", "validation.csv"] {
        assert!(folder.join("out/all").join(file).is_file(), "{file}");
    }
    // What comes after the table knows nothing of who solved.
    let at = ["--coolant-flow", "4 L/min", "--coolant-temperature", "20 degC", "--at", "heat=100 W"];
    let answer = json(&folder, &[&["query", "out/all/surrogate.cps"][..], &at].concat());
    let (plate, motor) = cold_plate(4.0, 20.0, 100.0);
    assert!((answer["temperatures"]["motor"]["degC"].as_f64().unwrap() - motor).abs() < 0.05, "{answer} {motor}");
    let margins = answer["limits"].as_array().unwrap();
    let margin = |name: &str| margins.iter().find(|l| l["name"] == name).unwrap()["margin"].as_f64().unwrap();
    assert!((margin("motor") - (40.0 - motor)).abs() < 0.05, "{answer}");
    assert!((margin("motor over plate") - (12.0 - motor + plate)).abs() < 0.05, "{answer}");
    // Started again, nothing is left to be done; elsewhere, all of it is known.
    let again = json(&folder, &["sweep", sweep, "--out", "out/all"]);
    assert_eq!((&again["resumed"], &again["solver"]), (&50.into(), &"python3, version cold_plate.py 1.0".into()), "{again}");
    let before = std::fs::read(folder.join("out/all/sweep.csv")).unwrap();
    json(&folder, &["sweep", sweep, "--out", "out/other"]);
    assert_eq!(std::fs::read(folder.join("out/other/sweep.csv")).unwrap(), before);
    json(&folder, &["fit", "out/all/sweep.csv", "--machine", sweep, "--out", "out/fit.cps"]);
    let fitted = json(&folder, &[&["query", "out/fit.cps"][..], &at].concat());
    assert_eq!(fitted["limits"], answer["limits"]);
    json(&folder, &["chart", "out/all/surrogate.cps", "--out", "out/figures"]);
    let info = json(&folder, &["info", sweep]);
    assert_eq!(info["conditions"], 50, "{info}");
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn calculix_is_swept() {
    if std::process::Command::new("ccx").arg("-v").output().is_err() {
        println!("skipped: there is no ccx (scripts/clients installs it)");
        return;
    }
    let folder = folder("calculix");
    let sweep = root().join("examples/solvers/calculix/sweep.toml");
    let ran = json(&folder, &["sweep", sweep.to_str().unwrap(), "--out", "out/bar"]);
    assert_eq!((&ran["conditions"], &ran["failed"]), (&50.into(), &0.into()), "{ran}");
    let table = Table::read(folder.join("out/bar/sweep.csv")).unwrap();
    let column = |name: &str| &table.column(name).unwrap().values;
    for row in 0..table.rows() {
        // Water takes the heat from the foot; along the bar, k = 40 + T / 10 integrates to 40 T + T^2 / 20.
        let flux = column("heat_flux")[row];
        let foot = column("coolant_temperature")[row] + flux / column("film")[row];
        let integral = 40.0 * foot + foot * foot / 20.0 + flux * 0.2;
        let heater = -400.0 + (160_000.0 + 20.0 * integral).sqrt();
        // Linear elements are exact in the nodes here, and ccx prints seven digits.
        assert!((column("foot")[row] - foot).abs() < 1e-4, "row {row}: {} and {foot}", column("foot")[row]);
        assert!((column("heater")[row] - heater).abs() < 1e-4, "row {row}: {} and {heater}", column("heater")[row]);
    }
    let solver = table.provenance.iter().find(|(key, _)| key == "solver").unwrap();
    assert!(solver.1.starts_with("CalculiX, version This is Version "), "{solver:?}");
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn code_saturne_is_swept() {
    if std::process::Command::new("code_saturne").arg("help").output().is_err() {
        println!("skipped: there is no code_saturne (scripts/clients installs it)");
        return;
    }
    let folder = folder("code_saturne");
    let sweep = root().join("examples/solvers/code_saturne/sweep.toml");
    let ran = json(&folder, &["sweep", sweep.to_str().unwrap(), "--out", "out/bar"]);
    assert_eq!((&ran["conditions"], &ran["failed"]), (&50.into(), &0.into()), "{ran}");
    let table = Table::read(folder.join("out/bar/sweep.csv")).unwrap();
    let column = |name: &str| &table.column(name).unwrap().values;
    for row in 0..table.rows() {
        // Along the bar the temperature is linear, k = 45 W/(m K): what volumes find in their middles is exact.
        let (flux, film) = (column("heat_flux")[row], column("film")[row]);
        for (point, at) in [("foot end", 0.005), ("heater end", 0.195)] {
            let exact = column("coolant_temperature")[row] + flux / film + flux * at / 45.0;
            // Its file has eight digits, and its own iterations end before them.
            assert!((column(point)[row] - exact).abs() < 1e-5 * exact, "row {row}, {point}: {} and {exact}", column(point)[row]);
        }
    }
    let solver = table.provenance.iter().find(|(key, _)| key == "solver").unwrap();
    assert!(solver.1.starts_with("code_saturne, version Code_Saturne version: "), "{solver:?}");
    std::fs::remove_dir_all(&folder).unwrap();
}

/// Programs that cannot be tried here: their sweep files and templates are at least read, and it is told that they are missing.
#[test]
fn files_of_programs_that_are_not_here_are_read() {
    let folder = folder("untried");
    for (name, program) in [("apdl", "mapdl"), ("comsol", "comsol")] {
        let own = folder.join(name);
        std::fs::create_dir(&own).unwrap();
        for entry in std::fs::read_dir(root().join("examples/solvers").join(name)).unwrap() {
            let path = entry.unwrap().path();
            std::fs::copy(&path, own.join(path.file_name().unwrap())).unwrap();
        }
        std::fs::write(own.join("plate.mph"), "a model").unwrap();
        let info = json(&own, &["info", "sweep.toml"]);
        assert_eq!(info["conditions"], 40, "{info}");
        if std::process::Command::new(program).arg("-v").output().is_err() {
            let refused = output(&own, &["sweep", "sweep.toml", "--out", "out"]);
            assert_eq!(refused.status.code(), Some(2), "{}", said(&refused));
            assert!(said(&refused).contains("check that the program is installed"), "{}", said(&refused));
        }
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

/// Studies that were finished in other programs become tables that can be fitted, and go back.
#[test]
fn finished_studies_come_and_go() {
    let folder = folder("studies");
    let studies = root().join("examples/solvers/studies");
    let (comsol, dakota) = (studies.join("comsol.csv"), studies.join("dakota.dat"));
    let units = ["--unit", "motor=degC", "--unit", "v_in=m3/s", "--input", "heat", "--input", "v_in"];
    let told = json(&folder, &[&["import", comsol.to_str().unwrap(), "--out", "study.parquet"][..], &units].concat());
    assert_eq!(told["conditions"], serde_json::json!(["heat [W]", "v_in [m3/s]"]), "{told}");
    let table = Table::read(folder.join("study.parquet")).unwrap();
    assert_eq!(table.column("motor").unwrap().values[8], 38.37);
    assert_eq!(table.column("v_in").unwrap().values[8], 1.33333333333e-4);
    json(&folder, &["fit", "study.parquet", "--max-degree", "1"]);
    let of = ["--unit", "x1=W", "--unit", "x2=L/min", "--unit", "response_fn_1=degC", "--input", "x1", "--input", "x2"];
    let there = [&["import", dakota.to_str().unwrap(), "--out", "there.csv"][..], &of].concat();
    json(&folder, &there);
    json(&folder, &["export", "there.csv", "--to", "dakota", "--out", "back"]);
    json(&folder, &[&["import", "back/there.dat", "--out", "again.csv"][..], &of].concat());
    assert_eq!(std::fs::read(folder.join("again.csv")).unwrap(), std::fs::read(folder.join("there.csv")).unwrap());
    let told = json(&folder, &["export", "there.csv", "--to", "openturns", "--out", "back"]);
    let sample = std::fs::read_to_string(folder.join(told["written"][0]["path"].as_str().unwrap())).unwrap();
    assert!(sample.starts_with("\"x1 [W]\";\"x2 [L/min]\";\"response_fn_1 [degC]\"\n2e1;2e0;2.416e1\n"), "{sample}");
    let bare = output(&folder, &["import", dakota.to_str().unwrap(), "--out", "bare.csv"]);
    assert!(bare.status.code() == Some(2) && said(&bare).contains("--unit NAME=UNIT"), "{}", said(&bare));
    std::fs::remove_dir_all(&folder).unwrap();
}

/// A design that grows, of another program: it stops where the fit is accurate, and goes on to a finer accuracy.
#[test]
fn a_design_that_grows_is_solved_by_another_program() {
    let folder = folder("growing");
    for name in ["cold_plate.py", "condition.json.template"] {
        std::fs::copy(root().join("examples/solvers/python").join(name), folder.join(name)).unwrap();
    }
    let text = std::fs::read_to_string(root().join("examples/solvers/python/sweep.toml")).unwrap();
    let growing = |accuracy: &str| {
        let design = format!("kind = \"adaptive\"\naccuracy = \"{accuracy}\"\nruns = 12\nmax_runs = 80\n");
        std::fs::write(folder.join("sweep.toml"), text.replace("kind = \"latin_hypercube\"\nruns = 40\n", &design)).unwrap();
        json(&folder, &["run", "sweep.toml", "--out", "out"])
    };
    let rough = growing("0.2 K");
    assert_eq!(rough["adaptive"]["reached"], true, "{rough}");
    let fine = growing("0.02 K");
    assert_eq!(fine["adaptive"]["reached"], true, "{fine}");
    assert!(fine["resumed"].as_u64() >= rough["conditions"].as_u64() && fine["conditions"].as_u64() > rough["conditions"].as_u64());
    let worst = fine["points"].as_array().unwrap().iter().map(|p| p["held_out"]["max_K"].as_f64().unwrap()).fold(0.0, f64::max);
    assert!(worst < 0.02, "{fine}");
    std::fs::remove_dir_all(&folder).unwrap();
}

/// Another program for a machine of ours: variables and limits are those of the machine file, and no mesh is made.
#[test]
fn a_machine_file_gives_variables_and_limits() {
    let folder = folder("machine");
    let machine = root().join("examples/tutorial/machine.toml");
    let sweep = format!(
        "name = 'two nodes'\nmachine = '{}'\n[solver]\ncommand = ['awk', 'BEGIN {{ print \"{{{{motor_speed:rpm}}}}\" / 100 + \
         \"{{{{ambient_temperature:degC}}}}\" + 1 / \"{{{{coolant_flow:L/min}}}}\" + \"{{{{coolant_temperature:K}}}}\" / 100 }}']\n\
         [point.motor]\nunit = 'degC'\npattern = '(.*)'\nmatch = 'first'\n[range]\ncoolant_flow = ['2 L/min', '8 L/min']\n\
         motor_speed = ['500 rpm', '3000 rpm']\nambient_temperature = ['20 degC', '26 degC']\n[hold]\n\
         coolant_temperature = '20 degC'\n[design]\nkind = 'latin_hypercube'\nruns = 20\n",
        machine.display()
    );
    std::fs::write(folder.join("sweep.toml"), sweep).unwrap();
    let ran = json(&folder, &["run", "sweep.toml", "--out", "out"]);
    assert_eq!((&ran["conditions"], &ran["failed"]), (&20.into(), &0.into()), "{ran}");
    let at = ["--coolant-flow", "4 L/min", "--motor-speed", "1000 rpm", "--ambient-temperature", "22 degC"];
    let answer = json(&folder, &[&["query", "out/surrogate.cps"][..], &at].concat());
    let expected = 10.0 + 22.0 + 0.25 + 2.9315;
    assert!((answer["temperatures"]["motor"]["degC"].as_f64().unwrap() - expected).abs() < 0.05, "{answer}");
    assert!(!answer["limits"].as_array().unwrap().is_empty(), "{answer}");
    std::fs::remove_dir_all(&folder).unwrap();
}
