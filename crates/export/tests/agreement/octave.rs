use std::process::Command;

use coldplate_export::{Target, export};
use coldplate_runtime::{Band, Surrogate};

use crate::{conditions, fixtures, folder, is_there, skipped, worst};

/// Octave takes a millisecond and more for each.
const CONDITIONS: usize = 1000;
/// Of the larger files, which have a basis per point or twelve parameters.
const FEWER: usize = 100;

/// For every surrogate: reads conditions, writes what `answers` below lists.
const DRIVER: &str = r#"
names = strsplit(strtrim(fileread("names")), "\n");
states = {"acceptable", "uncertain", "not_acceptable"};
for k = 1:numel(names)
    answer = str2func(names{k});
    assert(answer());
    shape = sscanf(fileread([names{k} ".shape"]), "%d");
    f = fopen([names{k} ".in"]); x = fread(f, [shape, Inf], "double").'; fclose(f);
    f = fopen([names{k} ".out"], "w");
    for row = 1:size(x, 1)
        [values, bands, limits, verdict] = answer(x(row, :));
        state = find(strcmp(states, verdict.state)) - 1;
        fwrite(f, [values; bands.'(:); limits.'(:); state; verdict.in_domain; verdict.binding; verdict.probability], "double");
    end
    fclose(f);
end
"#;

fn answers(surrogate: &Surrogate<'_>, x: &[f64]) -> Vec<f64> {
    let points = surrogate.point_count();
    let (mut values, mut bands) = (vec![0.0; points], vec![Band::default(); points]);
    let chance = surrogate.assess(x, None, 0.95, &mut values, &mut bands).expect("the shapes fit");
    let mut all = values.clone();
    all.extend(bands.iter().flat_map(|band| [band.fit, band.parameters, band.misses, band.total]));
    for limit in 0..surrogate.limit_count() {
        let own = surrogate.limit_chance(limit, x, None, &values).expect("the limit exists");
        all.extend([own.value, own.maximum, own.maximum - own.value, own.probability]);
    }
    let binding = chance.binding.map_or(0.0, |index| index as f64 + 1.0);
    all.extend([f64::from(chance.state as u8), f64::from(u8::from(chance.in_domain)), binding, chance.probability]);
    all
}

fn count(name: &str) -> usize {
    if name.starts_with("bench") { FEWER } else { CONDITIONS }
}

#[test]
fn octave_answers_as_the_runtime_does() {
    if !is_there("octave-cli") {
        skipped("octave-cli is not on this machine");
        return;
    }
    let folder = folder("octave");
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.join(name), bytes).expect("the folder can be written to");
    let mut names = Vec::new();
    for (name, bytes) in fixtures() {
        let surrogate = Surrogate::open(&bytes).expect("the fixtures are intact");
        let file = export(&surrogate, Target::Octave, &name).expect("the name is one").swap_remove(0);
        let name = file.name.trim_end_matches(".m").to_owned();
        write(&file.name, file.text.as_bytes());
        let conditions = conditions(&surrogate, count(&name));
        write(&format!("{name}.shape"), surrogate.variable_count().to_string().as_bytes());
        write(&format!("{name}.in"), &conditions.iter().flatten().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>());
        names.push(name);
    }
    write("names", names.join("\n").as_bytes());
    write("driver.m", DRIVER.as_bytes());
    let output = Command::new("octave-cli").current_dir(&folder).args(["--norc", "driver.m"]).output().expect("octave-cli starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    for ((_, bytes), name) in fixtures().iter().zip(&names) {
        let surrogate = Surrogate::open(bytes).expect("the fixtures are intact");
        let written = std::fs::read(folder.join(format!("{name}.out"))).expect("octave wrote it");
        let found: Vec<f64> = written.as_chunks::<8>().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect();
        let conditions = conditions(&surrogate, count(name));
        let expected: Vec<f64> = conditions.iter().flat_map(|x| answers(&surrogate, x)).collect();
        let (apart, place) = worst(&found, &expected);
        println!("{name}: {apart:.1e} at answer {}", place % (expected.len() / conditions.len()));
        // The 200 weights of that basis are large and cancel: Octave's order of additions leaves a little more there.
        let allowed = if name == "bare" { 4e-12 } else { 1e-12 };
        assert!(apart < allowed, "{name}: {apart:e}");
    }
    let _ = std::fs::remove_dir_all(&folder);
}
