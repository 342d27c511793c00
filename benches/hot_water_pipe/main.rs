//! The measured hot-water pipe (docs/how-to/diagnosis-examples.md): its step tests as tables for `coldplate diagnose`, and machine files held
//! against a test. The measurements are not part of the project: FOLDER is where test_150801.csv and the others lie.
//!
//!     cargo bench --bench hot_water_pipe -- table FOLDER OUT.csv TEST[:SECONDS]...
//!     cargo bench --bench hot_water_pipe -- compare FOLDER TEST[:SECONDS] FIGURE.svg NAME=MACHINE.toml...
//!
//! `TEST:SECONDS` takes the rows of a table up to that time, and what is compared from that time on.

use std::path::Path;

use coldplate_base::atomic_file;
use coldplate_base::error::{Error, Result};
use coldplate_base::units::celsius;
use coldplate_evidence::identify;
use coldplate_evidence::measurement::{Data, whiten};
use coldplate_explore::simulate::Start;
use coldplate_figures::chart::draw_as;
use coldplate_figures::chart::history::{HistoryFigure, HistoryLine};
use coldplate_figures::chart::style::Quantity;
use coldplate_solve::study::Study;
use coldplate_testing::measured::hot_water_pipe;

fn main() {
    // Cargo adds --bench to the arguments.
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let done = match words.as_slice() {
        ["table", folder, out, tests @ ..] if !tests.is_empty() => table(Path::new(folder), Path::new(out), tests),
        ["compare", folder, test, figure, machines @ ..] if !machines.is_empty() => {
            compare(Path::new(folder), test, Path::new(figure), machines)
        }
        _ => Err(Error::input("give 'table FOLDER OUT.csv TEST...' or 'compare FOLDER TEST FIGURE.svg NAME=MACHINE.toml...'")),
    };
    if let Err(error) = done {
        eprintln!("{error}");
        std::process::exit(1);
    }
}

fn table(folder: &Path, out: &Path, tests: &[&str]) -> Result<()> {
    atomic_file::write(out, hot_water_pipe::table(folder, tests)?.as_bytes())?;
    atomic_file::write(&out.with_extension("toml"), hot_water_pipe::UNCERTAINTY.as_bytes())
}

fn compare(folder: &Path, test: &str, figure: &Path, machines: &[&str]) -> Result<()> {
    let (name, from) = match test.split_once(':') {
        Some((name, from)) => (name, from.parse().map_err(|_| Error::input("this is no number of seconds").read(test))?),
        None => (test, 0.0),
    };
    let path = std::env::temp_dir().join(format!("hot_water_pipe_{}_{name}.csv", std::process::id()));
    atomic_file::write(&path, hot_water_pipe::table(folder, &[name])?.as_bytes())?;
    let mut courses = Vec::new();
    let mut times = Vec::new();
    for machine in machines {
        let (label, file) = machine.split_once('=').ok_or_else(|| Error::input("write NAME=MACHINE.toml").read(*machine))?;
        let study = Study::read(file, &[], None)?;
        let data = Data::read(&path, &study.model.machine)?;
        let predicted = identify::values(&study, &data, Start::Readings)?;
        let measured = whiten::readings(&data);
        let places = whiten::places(&data);
        times = places.iter().map(|(r, _)| data.rows[*r].time.unwrap_or(0.0)).collect();
        let squares: Vec<f64> = (0..times.len()).filter(|i| times[*i] >= from).map(|i| (predicted[i] - measured[i]).powi(2)).collect();
        let rmse = (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt();
        println!("{name} from {from} s, {} readings, {label}: root mean square error {rmse:.3} K", squares.len());
        if courses.is_empty() {
            courses.push(HistoryLine { name: "measured".into(), values: measured });
        }
        courses.push(HistoryLine { name: label.into(), values: predicted });
    }
    std::fs::remove_file(&path).map_err(|e| Error::file("remove", &path, e))?;
    for course in &mut courses {
        course.values.iter_mut().for_each(|v| *v = celsius(*v));
    }
    let title = format!("Water out of the pipe, test {name}");
    let figure_of = HistoryFigure { title, times, quantity: Quantity::new("temperature", "degC"), courses, ..HistoryFigure::default() };
    draw_as(figure, &figure_of)
}
