use std::process::Command;

use coldplate_export::Target;

use crate::{Terms, assessment, compare, folder, is_there, lay_out, skipped};

/// Octave takes a millisecond and more for each.
const CONDITIONS: usize = 1000;
/// Of the larger files, which have a basis per point or twelve parameters.
const FEWER: usize = 100;

/// For every surrogate: reads conditions, writes what `assessment` lists.
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
    let names = lay_out(&folder, Target::Octave, count);
    std::fs::write(folder.join("driver.m"), DRIVER).expect("the folder can be written to");
    let output = Command::new("octave-cli").current_dir(&folder).args(["--norc", "driver.m"]).output().expect("octave-cli starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    compare(&folder, &names, &Terms { answers: assessment, order_is_own: true });
    let _ = std::fs::remove_dir_all(&folder);
}
