//! The examples of docs/how-to/embed.md, run as they stand there.

use std::path::{Path, PathBuf};
use std::process::Command;

use coldplate_export::{Target, export};
use coldplate_runtime::Surrogate;

use crate::{folder, is_there, modelica, python_with, skipped, st};

/// An example: what is exported, the text of the program, and what the page says it prints.
struct Example {
    target: Target,
    fixture: String,
    name: String,
    program: String,
    printed: String,
}

fn examples(page: &str) -> Vec<Example> {
    let after = |text: &str| {
        let (_, rest) = text.split_once("\n```").expect("a block follows");
        let (block, rest) = rest.split_once("\n```").expect("the block ends");
        let (_, block) = block.split_once('\n').unwrap_or(("", ""));
        (block.to_owned(), rest.to_owned())
    };
    let parts = page.split("<!-- example: ").skip(1).map(|part| {
        let (head, rest) = part.split_once("-->").expect("the comment ends");
        let words: Vec<&str> = head.split_whitespace().collect();
        let target = Target::ALL.into_iter().find(|target| target.key() == words[0]).expect("the target exists");
        let (program, rest) = after(rest);
        let (_, rest) = rest.split_once("<!-- output -->").expect("the page says what it prints");
        let (printed, _) = after(rest);
        Example { target, fixture: words[1].into(), name: words[2].into(), program, printed }
    });
    parts.collect()
}

#[test]
fn the_examples_of_the_page_print_what_it_says() {
    let own = Path::new(env!("CARGO_MANIFEST_DIR"));
    let page = std::fs::read_to_string(own.join("../../docs/how-to/embed.md")).expect("the page is there");
    let examples = examples(&page);
    assert_eq!(examples.len(), Target::ALL.len(), "one example per target");
    for (number, example) in examples.iter().enumerate() {
        let folder = folder(&format!("example-{number}"));
        let bytes = std::fs::read(own.join("../runtime/fixtures").join(&example.fixture)).expect("the fixture is there");
        let surrogate = Surrogate::open(&bytes).expect("the fixtures are intact");
        for file in export(&surrogate, example.target, &example.name).expect("the name is one") {
            std::fs::write(folder.join(file.name), file.content).expect("the folder can be written to");
        }
        let (program, first) = match example.target {
            Target::C99 | Target::C99Single => ("main.c", Some("cc".into())),
            Target::Html => ("main.js", Some("node".into())),
            Target::Json => ("main.py", Some("python3".into())),
            Target::Modelica => ("main.mo", python_with("rumoca")),
            Target::Octave => ("main.m", Some("octave-cli".into())),
            Target::Onnx => ("main.py", python_with("onnxruntime")),
            Target::St => ("main.st", Some("node".into())),
            Target::Fmu2 | Target::Fmu3 => ("main.py", python_with("fmpy").filter(|_| is_there("cc"))),
        };
        std::fs::write(folder.join(program), &example.program).expect("the folder can be written to");
        let Some(first) = first.filter(|first: &PathBuf| is_there(first)) else {
            skipped(&format!("the example of {}: what runs it is not on this machine", example.target.key()));
            continue;
        };
        let mut command = match example.target {
            Target::C99 | Target::C99Single => {
                let source = format!("{}.c", example.name);
                let made = Command::new(first)
                    .current_dir(&folder)
                    .args(["-std=c99", "-O2", "-Wall", "-Werror", program, &source, "-lm", "-o", "main"])
                    .output();
                let made = made.expect("the compiler starts");
                assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
                Command::new(folder.join("main"))
            }
            Target::Octave => {
                let mut command = Command::new(first);
                command.args(["--norc", program]);
                command
            }
            Target::St => {
                std::fs::write(folder.join("structured_text.js"), st::INTERPRETER).expect("the folder can be written to");
                let mut command = Command::new(first);
                command.args(["-e", st::SHOW, &format!("{}.st", example.name), program]);
                command
            }
            Target::Modelica => {
                let mut command = Command::new(first);
                command.args(["-c", modelica::SHOW, &format!("{}.mo", example.name), program]);
                command
            }
            Target::Fmu2 | Target::Fmu3 | Target::Html | Target::Json | Target::Onnx => {
                let mut command = Command::new(first);
                command.arg(program);
                command
            }
        };
        let output = command.current_dir(&folder).output().expect("the program starts");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        assert_eq!(String::from_utf8_lossy(&output.stdout).trim_end(), example.printed.trim(), "{}", example.target.key());
        let _ = std::fs::remove_dir_all(&folder);
    }
}
