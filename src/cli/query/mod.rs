//! `coldplate query`: temperatures, verdict and margins from a surrogate file.

mod free;
mod text;

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use coldplate_runtime::CONFIDENCE;

use super::condition::ConditionArgs;
use super::fit::check_ending;
use super::output::Output;
use coldplate_base::atomic_file;
use coldplate_base::error::{Error, Result};
use coldplate_base::roles;
use coldplate_jobs::open;
use coldplate_surrogate::fit::file;
use coldplate_surrogate::verdict::question::{Question, QuestionReply};
use coldplate_surrogate::verdict::stream::{self, AnswerForm};
use coldplate_surrogate::verdict::{Acceptability, Surrogate, outside_of_given, stated};

/// Temperatures, verdict and margins from a surrogate file
#[derive(Debug, clap::Args)]
#[command(after_help = "Exit status: 0 acceptable; 1 not acceptable; 2 bad input; 3 uncertain (too close to call, outside the \
                        fitted range, or no limits to judge by). With --csv: 0 if all are acceptable, 1 if any is not, else 3.")]
pub struct Args {
    /// Surrogate file
    #[arg(value_name = "SURROGATE")]
    pub surrogate: PathBuf,
    /// The condition.
    #[command(flatten)]
    pub condition: ConditionArgs,
    /// Find the smallest value of this variable that makes the condition acceptable; NAME=LOW..HIGH looks there only.
    /// With two, A,B, find the smallest A for values of B
    #[arg(long, value_name = "NAME[,NAME..]", value_delimiter = ',', conflicts_with = "csv")]
    pub free: Vec<String>,
    /// Among the acceptable conditions, the one that makes a formula smallest, as "coolant_flow_L_min^3"; variables that
    /// are not given, or those of --free, are chosen. Formulas know variables and points by name and unit (Y_motor_degC),
    /// and smallest_margin
    #[arg(long, value_name = "FORMULA", conflicts_with_all = ["csv", "maximise"])]
    pub minimise: Option<String>,
    /// Among the acceptable conditions, the one that makes a formula largest
    #[arg(long, value_name = "FORMULA", conflicts_with = "csv")]
    pub maximise: Option<String>,
    /// Find which variable and which uncertain number decides: Sobol' indices of every point and limit over the ranges
    /// of the variables that are not given
    #[arg(long, conflicts_with_all = ["csv", "free", "minimise", "maximise"])]
    pub indices: bool,
    /// Probability with which a verdict is said: above 0.5, below 1
    #[arg(long, value_name = "P", default_value_t = CONFIDENCE, value_parser = confidence)]
    pub confidence: f64,
    /// Write the surrogate of the machine with the parameters and held variables that are stated, to be embedded or exported
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Answer every row of a CSV file; its header names variables with units, as in "coolant_flow [L/min]"
    #[arg(long, value_name = "FILE")]
    pub csv: Option<PathBuf>,
    /// With --csv, only these columns, in this order: names as in the header of the answer, or conditions, temperatures,
    /// bands, margins for all of a kind; JSON rows are then flat objects
    #[arg(long, value_name = "A,B,..", requires = "csv")]
    pub columns: Vec<String>,
    /// With --csv, numbers of so many significant digits (default: all)
    #[arg(long, value_name = "N", requires = "csv", value_parser = clap::value_parser!(u8).range(1..=17))]
    pub digits: Option<u8>,
}

/// Answers the query and returns the exit status.
///
/// # Errors
/// A file that cannot be read or is damaged; a wrong, doubled or missing variable; a value without
/// its unit.
pub fn run(args: &Args, out: Output) -> Result<u8> {
    let read = open(&args.surrogate)?;
    if let Some(path) = &args.out {
        check_ending(path)?;
    }
    let (bytes, given) = stated::with_known(&read.bytes, &args.condition.values()?).map_err(|e| e.in_file(&args.surrogate))?;
    if let Some(path) = &args.out {
        atomic_file::write(path, &bytes)?;
    }
    let surrogate = file::open(&bytes).map_err(|e| e.in_file(&args.surrogate))?;
    if let Some(csv) = &args.csv {
        return many(&surrogate, csv, &given, args, out);
    }
    let question = Question {
        condition: given,
        confidence: args.confidence,
        free: args.free.clone(),
        minimise: args.minimise.clone(),
        maximise: args.maximise.clone(),
        indices: args.indices,
    };
    let reply = question.ask(&surrogate)?;
    let (text, status) = match &reply {
        QuestionReply::At(answer) => (text::text(&surrogate, answer), status(answer.verdict)),
        QuestionReply::Indices(found) => {
            let outside = outside_of_given(&surrogate, &question.condition)?;
            let told: String = outside.iter().map(text::outside_sentence).collect();
            (text::of_indices(&surrogate, &question.condition, found) + &told, if outside.is_empty() { 0 } else { 3 })
        }
        open => free::told(&surrogate, open),
    };
    out.report(&text, &reply.record(&surrogate));
    Ok(status)
}

fn confidence(text: &str) -> std::result::Result<f64, String> {
    let value = text.strip_suffix('%').map_or_else(|| text.parse::<f64>(), |percent| percent.trim().parse::<f64>().map(|p| p / 100.0));
    let inside = value.ok().filter(|p| *p > 0.5 && *p < 1.0);
    inside.ok_or_else(|| "a probability above 0.5 and below 1 is wanted, for example 0.95".into())
}

fn status(verdict: Acceptability) -> u8 {
    match verdict {
        Acceptability::Acceptable => 0,
        Acceptability::NotAcceptable => 1,
        Acceptability::Uncertain => 3,
    }
}

fn many(surrogate: &Surrogate<'_>, csv: &Path, given: &[(String, String)], args: &Args, out: Output) -> Result<u8> {
    let open = || File::open(csv).map(BufReader::new).map_err(|e| Error::file("read", csv, e));
    // A mistake shows before the first answer; only a pipe, which can be read once, is answered up to its mistake.
    roles::reads(csv)?;
    let is_file = std::fs::metadata(csv).is_ok_and(|m| m.is_file());
    let total = if is_file { Some(stream::check(surrogate, open()?, given).map_err(|e| e.in_file(csv))?) } else { None };
    let form =
        AnswerForm { json: out.json, columns: args.columns.clone(), digits: args.digits.map(usize::from), confidence: args.confidence };
    let tally = stream::answer(surrogate, open()?, given, &form, total, &out.progress(), out.pieces()).map_err(|e| e.in_file(csv))?;
    Ok(status(tally.worst))
}
