//! `coldplate schema`: the keys of machine files, for editors and for the documentation.

use std::path::PathBuf;

use super::output::Output;
use coldplate_base::error::{Error, Result, did_you_mean};
use coldplate_base::{atomic_file, input};
use coldplate_describe::machine::SCHEMA;

/// JSON Schema of machine files, for editors
#[derive(Debug, clap::Args)]
#[command(
    after_help = "For editors with the Taplo language server (Even Better TOML): save the output as machine.schema.json and begin a \
machine file with\n  #:schema machine.schema.json"
)]
pub struct Args {
    /// Print the keys of one table as a Markdown table instead, for example 'contact.*'
    #[arg(long, value_name = "TABLE")]
    markdown: Option<String>,
    /// Make the tables of a Markdown page anew that stand between '<!-- keys: TABLE -->' and '<!-- end of keys -->'
    #[arg(long, value_name = "PAGE", conflicts_with = "markdown")]
    update: Option<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// There is no such table; the page cannot be read or written.
pub fn run(args: &Args, out: Output) -> Result<u8> {
    if let Some(page) = &args.update {
        let bytes = input::read_back(page)?;
        let text = input::utf8(&bytes, page)?;
        let filled = SCHEMA.fill(text).map_err(|e| e.in_file(page))?;
        let is_stale = filled != text;
        if is_stale {
            atomic_file::write(page, filled.as_bytes())?;
        }
        let said = if is_stale { "brought up to date" } else { "up to date already" };
        out.report(&format!("{} {said}", page.display()), &serde_json::json!({ "page": page, "changed": is_stale }));
        return Ok(0);
    }
    let Some(name) = &args.markdown else {
        let schema = SCHEMA.to_json_schema();
        out.verbatim(&format!("{schema:#}"), &schema);
        return Ok(0);
    };
    let table = SCHEMA.table(name).ok_or_else(|| {
        let known = SCHEMA.tables();
        let near = did_you_mean(name, known.iter().map(String::as_str)).map_or(String::new(), |near| format!("did you mean '{near}'? "));
        Error::input(format!("there is no table '{name}'")).at_key("--markdown").help(format!("{near}known: {}", known.join(", ")))
    })?;
    let text = table.to_markdown();
    out.verbatim(&text, &serde_json::json!({ "table": name, "markdown": text }));
    Ok(0)
}
