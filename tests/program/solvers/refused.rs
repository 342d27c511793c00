//! Sweep files of other solvers that cannot be meant so.

use super::{folder, output, said, shell};

/// What is changed in a sound file, and what the message must have, its line among it.
const WRONG: &[(&str, &str, &[&str])] = &[
    ("command = ['sh', 'solve.sh']", "command = 'sh solve.sh'", &["sweep.toml:3", "a command is a list"]),
    ("command = ['sh', 'solve.sh']", "command = []", &["sweep.toml:3", "the command is empty"]),
    ("command = ['sh', 'solve.sh']\n", "", &["sweep.toml:2", "what is run?"]),
    ("command = ['sh', 'solve.sh']", "command = ['sh', '{{y:W}}']", &["sweep.toml:3", "'y' is not a variable", "known here: x"]),
    ("command = ['sh', 'solve.sh']", "command = ['no-such-program-here']", &["cannot run", "installed"]),
    ("templates = ['x.txt.template']", "templates = ['y.txt.template']", &["y.txt.template", "from the folder of the sweep file"]),
    ("templates = ['x.txt.template']", "templates = []", &["the variable 'x' stands in no template", "{{x:W}}"]),
    ("files = ['solve.sh']", "files = ['x.txt', 'solve.sh']", &["x.txt"]),
    ("files = ['solve.sh']", "file = ['solve.sh']", &["unknown key 'file'", "did you mean 'files'"]),
    ("files = ['solve.sh']", "time_limit = '5 m'", &["sweep.toml:5", "not the unit"]),
    ("files = ['solve.sh']", "retries = 101", &["more than 100"]),
    ("files = ['solve.sh']", "version = ['true']", &["prints no version"]),
    ("files = ['solve.sh']", "not_converged = '('", &["cannot be read"]),
    ("files = ['solve.sh']", "licence = { folder = 'x' }", &["'tokens' is missing"]),
    ("unit = 'degC'", "unit = 'degQ'", &["sweep.toml:8", "degQ"]),
    ("unit = 'degC'", "unit = 'degC'\ndifference = true", &["in K"]),
    ("pattern = '^t = (\\S+)'", "pattern = '^t = \\S+'", &["0 groups, and one is wanted"]),
    ("pattern = '^t = (\\S+)'", "pointer = 't'", &["begins with a slash"]),
    ("pattern = '^t = (\\S+)'", "pattern = '(t)'\ncolumn = 't'", &["exclude each other"]),
    ("pattern = '^t = (\\S+)'", "file = 'x'", &["where does this result stand?"]),
    ("recover = '-1 degC'", "recover = '-1'", &["unit"]),
    ("[point.t]", "[sensor.t]", &["no result is read"]),
    ("x = { unit = 'W' }", "y = { unit = 'W' }", &["'x'"]),
    ("x = { unit = 'W' }", "", &["no variable is declared"]),
    ("[range]", "[limit.l]\nsensor = 't'\nrise = '2 K'\n[range]", &["ambient temperature"]),
    ("[range]", "[limit.l]\nsensor = 'u'\nmaximum = '2 degC'\n[range]", &["'u'"]),
    ("name = 'shell'", "name = 'shell'\ncells = 100", &["makes its own mesh"]),
    ("name = 'shell'", "name = 'shell'\nmachine = 'none.toml'", &["none.toml"]),
];

#[test]
fn what_cannot_be_meant_is_told_before_anything_runs() {
    let folder = folder("refused");
    shell(&folder, 3, "", "echo \"t = $x\"");
    let sound = std::fs::read_to_string(folder.join("sweep.toml")).unwrap();
    for (from, to, needles) in WRONG {
        assert!(sound.contains(from), "{from}");
        std::fs::write(folder.join("sweep.toml"), sound.replacen(from, to, 1)).unwrap();
        let ended = output(&folder, &["sweep", "sweep.toml", "--out", "out"]);
        let told = said(&ended);
        assert_eq!(ended.status.code(), Some(2), "{to}: {told}");
        assert!(needles.iter().all(|needle| told.contains(needle)), "{to}: {told}");
        assert!(!folder.join("runs.log").exists(), "{to}");
    }
    std::fs::remove_dir_all(&folder).unwrap();
}
