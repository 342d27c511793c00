//! `coldplate chart`: figures from chart definitions, from a surrogate, or from a folder the main job has filled.

use std::path::{Path, PathBuf};

use serde_json::json;

use super::condition::ConditionArgs;
use super::interrupt;
use super::output::Output;
use coldplate_base::error::{Error, Result};
use coldplate_explore::sweep::SweepOptions;
use coldplate_figures::chart::acceptability::MarkedCondition;
use coldplate_jobs::charts::{draw_all, results::Results};
use coldplate_jobs::{FileKind, figures, open};
use coldplate_surrogate::verdict::{self, Surrogate};
use coldplate_tables::Table;

/// Figures of chart definitions, of a surrogate, of a folder
///
/// Figures are written as SVG and PNG, a model as GLB; a folder has a surrogate and its tables.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Chart definitions (charts/NAME.toml), or one surrogate file, or one folder with a surrogate and its tables
    #[arg(required = true)]
    sources: Vec<PathBuf>,
    /// Folder for the figures (default: out/charts for definitions; charts, beside the surrogate, otherwise)
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Folder with the results of the sweeps that definitions name, DIR/NAME each; missing results are solved
    #[arg(long, value_name = "DIR", default_value = "out")]
    results: PathBuf,
    /// Only an acceptability map over these two variables of the surrogate: across,up
    #[arg(long, value_name = "X,Y", value_delimiter = ',', num_args = 1)]
    map: Vec<String>,
    /// Values of the other variables in the map (default: middle of the range); the condition is marked if complete
    #[command(flatten)]
    condition: ConditionArgs,
}

/// Runs the command.
///
/// # Errors
/// A definition, surrogate or table that cannot be read, or a folder that cannot be written.
pub fn run(args: &Args, out: Output) -> Result<u8> {
    // Figures are written one after the other, and sweeps that definitions name are solved into journals.
    interrupt::keeps(
        "the figures drawn so far are whole, and solved conditions are in their journals; the same command goes on from there",
    );
    let is_definition = |path: &PathBuf| FileKind::by_name(path) == FileKind::Document;
    let files = match args.sources.as_slice() {
        definitions if definitions.iter().all(is_definition) => {
            if !args.map.is_empty() {
                return Err(Error::input("a definition says itself what is drawn").at_key("--map").help("leave --map out"));
            }
            let progress = out.progress();
            let options = SweepOptions { threads: None, progress: Some(&progress), retry_failed: false };
            let folder = args.out.clone().unwrap_or_else(|| Path::new("out").join("charts"));
            draw_all(definitions, &mut Results::new(&args.results, options, &progress), &folder)?
        }
        [source] => of_surrogate(args, source)?,
        several => {
            let stray = several.iter().find(|path| !is_definition(path)).unwrap_or(&several[0]);
            return Err(Error::input("this is no chart definition")
                .in_file(stray)
                .help("give several definitions (NAME.toml), or one surrogate, or one folder"));
        }
    };
    let names: Vec<String> = files.iter().map(|f| f.display().to_string()).collect();
    let text: String = names.iter().map(|n| format!("wrote {n}\n")).collect();
    out.report(&text, &json!({ "files": names }));
    Ok(0)
}

/// The usual figures of a surrogate or of a folder, or the one map that was asked for.
fn of_surrogate(args: &Args, source: &Path) -> Result<Vec<PathBuf>> {
    let is_folder = source.is_dir();
    let path = if is_folder { source.join(coldplate_jobs::SURROGATE) } else { source.to_path_buf() };
    let file = open(&path).map_err(|e| e.help("`coldplate run SWEEP.toml` or `coldplate fit TABLE` writes a surrogate"))?;
    let surrogate = file.surrogate()?;
    let folder = args.out.clone().unwrap_or_else(|| path.parent().unwrap_or(Path::new(".")).to_path_buf());
    if !args.map.is_empty() {
        return map(args, &surrogate, &folder);
    }
    let mut tables = Vec::new();
    for (name, held_out) in [("sweep.csv", false), ("validation.csv", true)] {
        let table = source.join(name);
        if is_folder && table.exists() {
            tables.push((Table::read(&table)?, held_out));
        }
    }
    coldplate_jobs::chart(&surrogate, &tables, &folder)
}

/// The one map that was asked for.
fn map(args: &Args, surrogate: &Surrogate<'_>, folder: &Path) -> Result<Vec<PathBuf>> {
    let [across, up] = args.map.as_slice() else {
        return Err(Error::input("a map has two variables").at_key("--map").help("for example --map motor_speed,coolant_flow"));
    };
    let (across, up) = (verdict::condition::index_of(surrogate, across)?, verdict::condition::index_of(surrogate, up)?);
    let given = verdict::condition::partial(surrogate, &args.condition.values()?)?;
    let given = verdict::condition::varied(surrogate, given)?;
    let here = match (given.get(across).copied().flatten(), given.get(up).copied().flatten()) {
        (Some(x), Some(y)) => Some(MarkedCondition { x, y, label: "asked for".into() }),
        _ => None,
    };
    let held: Vec<f64> = given.iter().zip(figures::centre(surrogate)).map(|(g, middle)| g.unwrap_or(middle)).collect();
    let figure = figures::map(surrogate, across, up, &held, here, figures::ContourQuantity::Margin)?;
    let charts = folder.join("charts");
    std::fs::create_dir_all(&charts).map_err(|e| Error::file("make", &charts, e))?;
    let written = coldplate_figures::chart::draw(charts.join("map"), &figure)?;
    Ok(vec![written.svg, written.png])
}
