//! Progress on standard error: nothing where that is no terminal, lines where they were asked for.

use crate::common::scratch;

use super::{CONDITION, coldplate, message, root, status};

#[test]
fn progress_comes_where_it_is_asked_for() {
    let solve = [&["solve", "machines/rig.toml", "--cells", "500"], &CONDITION[..]].concat();
    let silent = coldplate(&solve);
    assert!(status(&silent) == 0 && !message(&silent).contains("unknowns"), "{}", message(&silent));
    let heard = coldplate(&[&solve[..], &["--progress"]].concat());
    for word in ["meshing", "unknowns: setting up", "Newton step 1 moved", "were open"] {
        assert!(message(&heard).contains(word), "{word}: {}", message(&heard));
    }
    let both = coldplate(&[&solve[..], &["--progress", "--quiet"]].concat());
    assert!(status(&both) == 2 && message(&both).contains("--quiet"), "{}", message(&both));

    let free = ["identify", "machines/rig.toml", "--cells", "300", "--free", "contact.motor.conductance", "--progress", "--starts", "1"];
    let heard = coldplate(&free);
    for word in ["start 1 of 1", "prediction 2: misfit", "profile likelihoods", "further tests"] {
        assert!(message(&heard).contains(word), "{word}: {}", message(&heard));
    }
    let swept = scratch("choosing").to_str().unwrap().to_string();
    let chosen = ["sweep", "examples/tutorial/sweep.toml", "--set", "mesh.accuracy=\"2 K\"", "--out", &swept, "--progress"];
    let heard = coldplate(&chosen);
    assert!(status(&heard) == 0 && message(&heard).contains("choosing cells"), "{}", message(&heard));
    let table = root().join(env!("CARGO_TARGET_TMPDIR")).join("progress.csv");
    let rows: String = (0..12).map(|i| format!("{i},{}\n", 20.0 + f64::from(i * i))).collect();
    std::fs::write(&table, format!("motor_speed [rpm],motor [degC]\n{rows}")).unwrap();
    let heard = coldplate(&["fit", table.to_str().unwrap(), "--progress"]);
    for word in ["12 rows: polynomials", "12 rows: radial functions"] {
        assert!(message(&heard).contains(word), "{word}: {}", message(&heard));
    }
}

/// Ctrl-C ends a command with a word on what is kept.
#[cfg(unix)]
#[test]
fn ctrl_c_says_what_is_kept() {
    use std::io::Read;
    use std::process::{Command, Stdio};
    let folder = std::env::temp_dir().join(format!("coldplate-interrupted-{}", std::process::id()));
    let cases: [(&[&str], &str); 2] = [
        (&["sweep", "sweeps/five_axis.toml", "--cells", "3000", "--out"], "the same command goes on from there"),
        (&["diagnose", "machines/rig.toml", "--cells", "3000", "--out"], "no result was written"),
    ];
    for (words, kept) in cases {
        let mut child = Command::new(env!("CARGO_BIN_EXE_coldplate"))
            .args(words)
            .arg(folder.join(format!("{}.toml", words[0])))
            .arg("--progress")
            .current_dir(root())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut told = child.stderr.take().unwrap();
        // The first line of progress shows that the work has begun.
        let mut line = [0u8; 1];
        while told.read(&mut line).unwrap() == 1 && line[0] != b'\n' {}
        assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
        let mut rest = String::new();
        told.read_to_string(&mut rest).unwrap();
        let status = child.wait().unwrap();
        assert_eq!(std::os::unix::process::ExitStatusExt::signal(&status), Some(2), "{status} {rest}");
        assert!(rest.contains(kept), "{rest}");
    }
    let _ = std::fs::remove_dir_all(&folder);
}
