//! `[solver]` and `[point.NAME]` of a sweep file.

use std::path::{Path, PathBuf};
use std::time::Duration;

use super::cache::{self, Key};
use super::licence::Licence;
use super::reading::{ResultReading, expression};
use super::template::Template;
use super::{Carried, Program, Version};
use coldplate_base::document::{Section, Value};
use coldplate_base::error::Result;
use coldplate_base::input;
use coldplate_base::units::Dimension;
use coldplate_describe::machine::DescribedVariable;

/// Ending that a template loses in the folder of a run.
const ENDING: &str = ".template";
/// Longest time limit of a run, s: a year. Chosen: a guard against typing errors, far below what a clock holds.
const LONGEST_RUN: f64 = 365.0 * 86400.0;
/// Most retries that a sweep file may ask for, count. Chosen: a guard against typing errors.
const MOST_RETRIES: usize = 100;

impl Program {
    /// Reads `[solver]` and every `[point.NAME]` of a sweep file in `folder`, for conditions of these variables. A variable
    /// that is needed (by index) must stand in a template or in the command.
    ///
    /// # Errors
    /// No command or no point; a template, a file or an expression that cannot be read; a place in a template that cannot be
    /// filled; a variable that is needed and stands in none.
    pub fn read(root: &Section<'_>, folder: &Path, variables: &[DescribedVariable], is_needed: impl Fn(usize) -> bool) -> Result<Self> {
        let section = root.section("solver")?;
        let argument = |value: &Value<'_>| Template::parse(&value.text()?, None, variables).map_err(|e| value.place(e));
        let command: Vec<Template> = words(&section, "command")?
            .ok_or_else(|| section.error("what is run?").help("write command = [\"PROGRAM\", \"ARGUMENT\", ..]"))?
            .iter()
            .map(argument)
            .collect::<Result<_>>()?;
        let first = first_word(&section)?;
        let name = section.opt_text("name")?.unwrap_or(first);
        let version = version(&section)?;
        let templates = templates(&section, folder, variables)?;
        let files = files(&section, folder)?;
        check_names(&section, &templates, &files)?;
        let limit = section.opt_positive("time_limit", Dimension::TIME)?;
        if limit.is_some_and(|seconds| seconds > LONGEST_RUN) {
            return Err(section.error_at("time_limit", "no run takes more than a year").help("leave the key out for no limit"));
        }
        let limit = limit.map(Duration::from_secs_f64);
        let retries = section.opt_integer("retries", 0)?.unwrap_or(0);
        if retries > MOST_RETRIES {
            return Err(section.error_at("retries", format!("more than {MOST_RETRIES} retries")).help("2 is usual"));
        }
        let not_converged = section.opt("not_converged").map(|value| expression(&value)).transpose()?;
        let at_once = section.opt_integer("at_once", 1)?;
        let licence = section.opt_section("licence")?.map(|section| licence(section, folder)).transpose()?;
        let below = |key: &str| Ok(section.opt_text(key)?.map(|path| folder.join(path)));
        let (cache, scratch) = (below("cache")?, below("scratch")?);
        let keep = section.opt_flag("keep")?.unwrap_or(false);
        let mut readings = Vec::new();
        for (name, section) in root.sections("point")? {
            readings.push(ResultReading::read(&name, section)?);
        }
        if readings.is_empty() {
            return Err(root
                .error_at("point", "no result is read")
                .help("write [point.NAME] with unit, file and column, pointer or pattern"));
        }
        let named: Vec<usize> = templates.iter().map(|(_, t)| t).chain(&command).flat_map(Template::variables).collect();
        if let Some(variable) = (0..variables.len()).find(|v| is_needed(*v) && !named.contains(v)) {
            let DescribedVariable { name, unit, .. } = &variables[variable];
            return Err(section
                .error_at("templates", format!("the variable '{name}' stands in no template and in no argument of the command"))
                .help(format!("write {{{{{name}:{unit}}}}} where the program expects it")));
        }
        section.finish()?;
        let mut program = Self {
            name,
            version: Version { command: version, said: None },
            command,
            folder: folder.to_path_buf(),
            templates,
            files,
            variables: variables.to_vec(),
            readings,
            limit,
            retries,
            not_converged,
            at_once,
            licence,
            cache,
            scratch,
            keep,
            hash: String::new(),
        };
        program.hash = Key::of(program.texts().iter().map(String::as_str)).0;
        Ok(program)
    }

    /// Everything that results depend on beside the condition and the version of the program.
    fn texts(&self) -> Vec<String> {
        let mut texts = vec![format!("{:?}", self.command)];
        texts.extend(self.templates.iter().map(|(name, template)| format!("{name} {template:?}")));
        texts.extend(self.files.iter().map(|file| format!("{} {}", file.name, file.hash)));
        texts.extend(self.readings.iter().map(ResultReading::key));
        texts.push(self.not_converged.as_ref().map_or(String::new(), |expression| expression.as_str().into()));
        texts
    }
}

/// Words of a command, which is a list of texts.
fn words<'a>(section: &Section<'a>, key: &str) -> Result<Option<Vec<Value<'a>>>> {
    let Some(value) = section.opt(key) else { return Ok(None) };
    if value.is_text() {
        return Err(value
            .error("a command is a list: the program and its arguments, none of them read by a shell")
            .help("write [\"PROGRAM\", \"ARGUMENT\", ..], or [\"sh\", \"-c\", \"LINE\"] for a line of the shell"));
    }
    let words = value.list()?;
    if words.is_empty() {
        return Err(value.error("the command is empty").help("write [\"PROGRAM\", \"ARGUMENT\", ..]"));
    }
    Ok(Some(words))
}

fn first_word(section: &Section<'_>) -> Result<String> {
    let first = section.texts("command")?.into_iter().next().unwrap_or_default();
    Ok(Path::new(&first).file_name().map_or(first.clone(), |name| name.to_string_lossy().into_owned()))
}

fn version(section: &Section<'_>) -> Result<Option<Vec<String>>> {
    words(section, "version")?.map(|words| words.iter().map(Value::text).collect()).transpose()
}

/// Templates by their names in the folder of a run.
fn templates(section: &Section<'_>, folder: &Path, variables: &[DescribedVariable]) -> Result<Vec<(String, Template)>> {
    let listed = section.opt_list("templates")?.unwrap_or_default();
    let read = listed.iter().map(|value| {
        let path = folder.join(value.text()?);
        let text = input::text(&path).map_err(|e| value.place(e).help("templates are found from the folder of the sweep file"))?;
        let name = file_name(&path, value)?;
        let name = name.strip_suffix(ENDING).filter(|name| !name.is_empty()).map_or(name.clone(), String::from);
        Ok((name, Template::parse(&text, Some(&path), variables)?))
    });
    read.collect()
}

fn files(section: &Section<'_>, folder: &Path) -> Result<Vec<Carried>> {
    let listed = section.opt_list("files")?.unwrap_or_default();
    let read = listed.iter().map(|value| {
        let path = folder.join(value.text()?);
        let bytes = input::read(&path).map_err(|e| value.place(e).help("files are found from the folder of the sweep file"))?;
        Ok(Carried { name: file_name(&path, value)?, hash: cache::hash(&bytes), path })
    });
    read.collect()
}

fn file_name(path: &Path, value: &Value<'_>) -> Result<String> {
    let name = path.file_name().and_then(|name| name.to_str());
    Ok(name.ok_or_else(|| value.error("this is no file name").help("name a file"))?.to_string())
}

fn check_names(section: &Section<'_>, templates: &[(String, Template)], files: &[Carried]) -> Result<()> {
    let names: Vec<&str> = templates.iter().map(|(name, _)| name.as_str()).chain(files.iter().map(|f| f.name.as_str())).collect();
    let repeated = names.iter().enumerate().find(|(i, name)| names[..*i].contains(name)).map(|(_, name)| *name);
    match repeated.or_else(|| names.iter().copied().find(|name| [super::process::STDOUT, super::process::STDERR].contains(name))) {
        None => Ok(()),
        Some(name) => Err(section
            .error_at("templates", format!("two files of a run would be called '{name}'"))
            .help("rename one; stdout and stderr are what the command prints")),
    }
}

fn licence(section: Section<'_>, folder: &Path) -> Result<Licence> {
    let found = Licence { folder: folder.join(PathBuf::from(section.text("folder")?)), tokens: section.integer("tokens", 1)? };
    section.finish()?;
    Ok(found)
}
