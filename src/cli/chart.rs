//! `coldplate chart`: the figures of a surrogate, or of a folder the main job has filled.

use std::path::{Path, PathBuf};

use serde_json::json;

use super::condition::ConditionArgs;
use super::output::Output;
use crate::error::{Error, Result};
use crate::figures::chart::acceptability::Here;
use crate::foundation::table::Table;
use crate::pipeline::{self, figures};
use crate::surrogate::fit::file;
use crate::surrogate::verdict::{self, Surrogate};

/// Figures of a surrogate file or of a folder of results, as SVG and PNG
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Surrogate file, or folder with one and its tables
    source: PathBuf,
    /// Folder for the figures (default: charts, beside the surrogate)
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Only an acceptability map over these two variables: across,up
    #[arg(long, value_name = "X,Y", value_delimiter = ',', num_args = 1)]
    map: Vec<String>,
    /// Where the other variables are held in the map (default: middle of the range); the condition is marked if complete
    #[command(flatten)]
    condition: ConditionArgs,
}

/// Runs the command.
///
/// # Errors
/// A surrogate or table that cannot be read, or a folder that cannot be written.
pub fn run(args: &Args, out: Output) -> Result<u8> {
    let is_folder = args.source.is_dir();
    let path = if is_folder { args.source.join(pipeline::SURROGATE) } else { args.source.clone() };
    let bytes = std::fs::read(&path).map_err(|e| Error::file("read", &path, e))?;
    let surrogate = file::open(&bytes).map_err(|e| e.in_file(&path))?;
    let folder = args.out.clone().unwrap_or_else(|| path.parent().unwrap_or(Path::new(".")).to_path_buf());
    let files = if args.map.is_empty() {
        let mut tables = Vec::new();
        for (name, held_out) in [("sweep.csv", false), ("validation.csv", true)] {
            let table = args.source.join(name);
            if is_folder && table.exists() {
                tables.push((Table::read(&table)?, held_out));
            }
        }
        pipeline::chart(&surrogate, &tables, &folder)?
    } else {
        map(args, &surrogate, &folder)?
    };
    let names: Vec<String> = files.iter().map(|f| f.display().to_string()).collect();
    let text: String = names.iter().map(|n| format!("wrote {n}\n")).collect();
    out.report(&text, &json!({ "files": names }));
    Ok(0)
}

/// The one map that was asked for.
fn map(args: &Args, surrogate: &Surrogate<'_>, folder: &Path) -> Result<Vec<PathBuf>> {
    let [across, up] = args.map.as_slice() else {
        return Err(Error::input("a map has two variables").at_key("--map").help("for example --map motor_speed,coolant_flow"));
    };
    let (across, up) = (verdict::condition::index_of(surrogate, across)?, verdict::condition::index_of(surrogate, up)?);
    let given = verdict::condition::partial(surrogate, &args.condition.values()?)?;
    let here = match (given[across], given[up]) {
        (Some(x), Some(y)) => Some(Here { x, y, label: "asked for".into() }),
        _ => None,
    };
    let held: Vec<f64> = given.iter().zip(figures::centre(surrogate)).map(|(g, middle)| g.unwrap_or(middle)).collect();
    let figure = figures::map(surrogate, across, up, &held, here)?;
    let charts = folder.join("charts");
    std::fs::create_dir_all(&charts).map_err(|e| Error::file("make", &charts, e))?;
    let written = crate::figures::chart::draw(charts.join("map"), &figure)?;
    Ok(vec![written.svg, written.png])
}
