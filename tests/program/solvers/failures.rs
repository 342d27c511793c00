//! Runs that give no result, and what becomes of them.

use coldplate_tables::Table;

use super::{folder, json, output, runs, said, shell};

/// Eleven conditions, x = 0, 100 .. 1000 W: each kind of failure once; 500 fails at first alone.
const SCRIPT: &str = "
case $x in
  100) echo 'segmentation trouble' >&2; exit 3;;
  200) sleep 60;;
  300) echo 'residual 1e3'; echo 'NO SOLUTION FOUND'; exit 1;;
  400) echo 'no line of the kind'; exit 0;;
  500) if [ ! -e ../../../tried ]; then touch ../../../tried; exit 9; fi;;
  600) echo 't = nan'; exit 0;;
  700) kill -SEGV $$;;
esac
echo \"t = $x\"
";

#[test]
fn every_failure_has_its_class_and_is_in_no_table() {
    let folder = folder("classes");
    shell(&folder, 11, "time_limit = '1 s'\nretries = 2\nnot_converged = 'NO SOL[A-Z]+'\nscratch = 'scratch/of'", SCRIPT);
    let ran = json(&folder, &["sweep", "sweep.toml", "--out", "out"]);
    let found: Vec<(u64, &str)> =
        ran["failures"].as_array().unwrap().iter().map(|f| (f["row"].as_u64().unwrap(), f["class"].as_str().unwrap())).collect();
    let expected =
        [(2, "crashed"), (3, "timed_out"), (4, "did_not_converge"), (5, "result_missing"), (7, "result_missing"), (8, "crashed")];
    assert_eq!(found, expected, "{ran}");
    let reason = |row: usize| ran["failures"].as_array().unwrap().iter().find(|f| f["row"] == row).unwrap()["reason"].as_str().unwrap();
    assert!(reason(2).contains("exit status: 3, its last line: segmentation trouble; tried 3 times"), "{}", reason(2));
    assert!(reason(3).contains("not done after 1 s"), "{}", reason(3));
    assert!(reason(4).contains("NO SOLUTION") && !reason(4).contains("tried"), "{}", reason(4));
    assert!(reason(8).contains("signal: 11"), "{}", reason(8));
    // Crashes, time limits and missing results are tried three times, what does not converge once.
    let of = |x: &str| runs(&folder).iter().filter(|run| *run == x).count();
    assert_eq!(["0", "100", "200", "300", "400", "500", "600"].map(of), [1, 3, 3, 1, 3, 2, 3]);

    let table = Table::read(folder.join("out/sweep.csv")).unwrap();
    assert_eq!(table.column("x").unwrap().values, [0.0, 500.0, 800.0, 900.0, 1000.0]);
    assert_eq!(table.column("t").unwrap().values, [0.0, 500.0, 800.0, 900.0, 1000.0]);
    // What stands in the place of results is marked, and never fitted.
    let recovered = Table::read(folder.join("out/recovered.csv")).unwrap();
    assert_eq!(recovered.column("t").unwrap().values, [-1.0; 6]);
    assert_eq!(recovered.text("recovered").unwrap().values[..2], ["crashed", "timed out"]);
    let refused = output(&folder, &["fit", "out/recovered.csv", "--input", "x"]);
    assert!(refused.status.code() == Some(2) && said(&refused).contains("fit sweep.csv"), "{}", said(&refused));
    // The files of a failed run are kept.
    let kept = reason(4).rsplit_once("its files: ").unwrap().1;
    let scratch = folder.join("scratch/of/failed").join(kept.rsplit_once('/').unwrap().1);
    let printed = [folder.join("out").join(kept), scratch].into_iter().find(|place| place.is_dir()).unwrap().join("stdout");
    assert!(std::fs::read_to_string(&printed).unwrap().contains("residual 1e3"), "{}", printed.display());

    // Failed conditions are not run again unless that is asked for.
    let before = runs(&folder).len();
    assert_eq!(json(&folder, &["sweep", "sweep.toml", "--out", "out"])["failed"], 6);
    assert_eq!(runs(&folder).len(), before);
    let again = json(&folder, &["sweep", "sweep.toml", "--out", "out", "--retry-failed"]);
    assert_eq!(again["failed"], 6, "{again}");
    assert_eq!(runs(&folder).len(), before + 3 * 5 + 1);
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn where_all_fail_the_status_says_so() {
    let folder = folder("all");
    shell(&folder, 3, "", "exit 1");
    let ended = output(&folder, &["sweep", "sweep.toml", "--out", "out"]);
    assert_eq!(ended.status.code(), Some(4), "{}", said(&ended));
    assert!(said(&ended).contains("run the command by hand"), "{}", said(&ended));
    std::fs::remove_dir_all(&folder).unwrap();
}

/// A program that fails because the disk is full has not failed at its condition. Needs root, to make a small disk.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_under_a_program_is_no_failure_of_a_condition() {
    use std::process::Command;
    let folder = folder("full");
    let small = folder.join("small");
    std::fs::create_dir(&small).unwrap();
    let mount = |arguments: &[&str]| Command::new("mount").args(arguments).arg(&small).output().is_ok_and(|o| o.status.success());
    if !mount(&["-t", "tmpfs", "-o", "size=300k", "tmpfs"]) {
        println!("skipped: no small disk can be made here");
        return;
    }
    shell(&folder, 4, "scratch = 'small'", "if [ $x != 0 ]; then dd if=/dev/zero of=big bs=1024 count=1000 || exit 1; fi\necho \"t = $x\"");
    let ended = output(&folder, &["sweep", "sweep.toml", "--out", "out", "--threads", "1"]);
    assert!(Command::new("umount").arg(&small).status().unwrap().success());
    assert_eq!(ended.status.code(), Some(2), "{}", said(&ended));
    assert!(said(&ended).contains("make room"), "{}", said(&ended));
    let journal = std::fs::read_to_string(folder.join("out/sweep.journal")).unwrap();
    assert!(journal.lines().count() == 2 && !journal.contains("failed"), "{journal}");
    assert_eq!(json(&folder, &["sweep", "sweep.toml", "--out", "out"])["failed"], 0);
    std::fs::remove_dir_all(&folder).unwrap();
}

/// A full disk says nothing of a condition: the sweep ends, and nothing is recorded of what was under way.
#[test]
fn trouble_with_files_is_no_failure_of_a_condition() {
    let folder = folder("files");
    shell(&folder, 4, "scratch = 'blocked'", "echo \"t = $x\"");
    std::fs::write(folder.join("blocked"), "a file where a folder should be").unwrap();
    let ended = output(&folder, &["sweep", "sweep.toml", "--out", "out"]);
    assert_eq!(ended.status.code(), Some(2), "{}", said(&ended));
    let journal = std::fs::read_to_string(folder.join("out/sweep.journal")).unwrap();
    assert_eq!(journal.lines().count(), 1, "{journal}");
    std::fs::remove_file(folder.join("blocked")).unwrap();
    assert_eq!(json(&folder, &["sweep", "sweep.toml", "--out", "out"])["failed"], 0);
    std::fs::remove_dir_all(&folder).unwrap();
}

/// A file that is shipped to every run and holds a result is no result, until the run writes it.
#[test]
fn a_result_that_was_shipped_is_missing() {
    let folder = folder("shipped");
    shell(&folder, 3, "", "if [ $x != 500 ]; then echo \"t = $x\" > old.txt; fi");
    std::fs::write(folder.join("old.txt"), "t = 500\n").unwrap();
    let sweep = std::fs::read_to_string(folder.join("sweep.toml")).unwrap();
    let sweep =
        sweep.replace("files = ['solve.sh']", "files = ['solve.sh', 'old.txt']").replace("[point.t]\n", "[point.t]\nfile = 'old.txt'\n");
    std::fs::write(folder.join("sweep.toml"), sweep).unwrap();
    let ran = json(&folder, &["sweep", "sweep.toml", "--out", "out"]);
    let [failure] = ran["failures"].as_array().unwrap().as_slice() else { panic!("{ran}") };
    assert!(failure["row"] == 2 && failure["class"] == "result_missing", "{failure}");
    assert!(failure["reason"].as_str().unwrap().contains("did not write it"), "{failure}");
    assert_eq!(Table::read(folder.join("out/sweep.csv")).unwrap().column("t").unwrap().values, [0.0, 1000.0]);
}
