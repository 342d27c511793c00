//! `coldplate serve`: answers over HTTP.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::{Arc, PoisonError, RwLock};
use std::time::Duration;

use coldplate_runtime::CONFIDENCE;
use coldplate_serve::{Answers, Ask, Limits, Refusal, Reply, Settings, Token, Work};
use schemars::generate::SchemaSettings;
use serde::Serialize;
use serde_json::{Map, Value};

use super::output::Output;
use coldplate_base::error::{Error, Kind, Result};
use coldplate_base::input;
use coldplate_jobs::info::Info;
use coldplate_jobs::service::{Book, read};
use coldplate_surrogate::verdict::question::{BatchQuestion, BatchRecord, Question, ReplyRecord};
use coldplate_surrogate::verdict::stream::AnswerForm;

/// Answers over HTTP, for other programs and as pages
#[derive(Debug, clap::Args)]
#[command(after_help = "Ends at Ctrl-C or SIGTERM, after the requests under way have been answered. Reads the files anew at SIGHUP.")]
pub struct Args {
    /// Surrogate files
    #[arg(value_name = "SURROGATE", required = true)]
    surrogates: Vec<PathBuf>,
    /// Address and port to listen at; port 0 takes a free one. Others than 127.0.0.1 and [::1] need --token-file
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1:8080")]
    listen: SocketAddr,
    /// File with the token that clients send as `Authorization: Bearer TOKEN`: 16 characters or more
    #[arg(long, value_name = "FILE")]
    token_file: Option<PathBuf>,
    /// Longest body of a request, in bytes
    #[arg(long, value_name = "N", default_value_t = 1 << 20, value_parser = at_least_one)]
    most_bytes: usize,
    /// Longest time for an answer, in seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0, value_parser = seconds)]
    most_seconds: f64,
    /// Longest time in which a client sends its request, or takes a piece of the answer, in seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0, value_parser = seconds)]
    patience: f64,
    /// Requests that are answered at once; others are told to come again
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = at_once)]
    most_requests: usize,
    /// Connections; others wait
    #[arg(long, value_name = "N", default_value_t = 1024, value_parser = at_once)]
    most_connections: usize,
}

/// Report once requests can be answered.
#[derive(Debug, Serialize)]
struct Record {
    /// Address that the service listens at.
    address: String,
    /// Names of the surrogates.
    surrogates: Vec<String>,
}

/// Serves until the process is told to end.
///
/// # Errors
/// A surrogate that cannot be read, two of one name, an address that cannot be listened at, or one that others reach without a
/// token.
pub fn run(args: &Args, out: Output) -> Result<u8> {
    let token = args.token_file.as_ref().map(token).transpose()?;
    if token.is_none() && !args.listen.ip().is_loopback() {
        return Err(Error::input("other machines reach this address, and anyone there could ask")
            .at_key("--listen")
            .read(args.listen)
            .help("give --token-file FILE, or listen at 127.0.0.1"));
    }
    let shelf = Shelf::read(&args.surrogates, out)?;
    let limits = Limits {
        body: args.most_bytes,
        time: Duration::from_secs_f64(args.most_seconds),
        slow: Duration::from_secs_f64(args.patience),
        in_flight: args.most_requests,
        connections: args.most_connections,
        threads: rayon::current_num_threads(),
    };
    let settings = Settings { address: args.listen, token, limits };
    let names = shelf.names.clone();
    let listening = |at: SocketAddr| {
        let record = Record { address: format!("http://{at}"), surrogates: names };
        out.report(&format!("{} answers at {}", record.surrogates.join(", "), record.address), &record);
    };
    let refused = |e: std::io::Error| Error::input(format!("this address cannot be listened at: {e}")).at_key("--listen").read(args.listen);
    coldplate_serve::run(shelf, &settings, listening).map_err(|e| refused(e).help("choose another port, or 0 for a free one"))?;
    out.note("told to end: what was under way is answered");
    Ok(0)
}

fn at_least_one(text: &str) -> std::result::Result<usize, String> {
    text.parse().ok().filter(|n| *n > 0).ok_or_else(|| "a number from 1 on is wanted".into())
}

/// Most requests or connections at once, a count. Chosen: more than an operating system opens.
const MOST_AT_ONCE: usize = 1_000_000;

fn at_once(text: &str) -> std::result::Result<usize, String> {
    at_least_one(text).ok().filter(|n| *n <= MOST_AT_ONCE).ok_or_else(|| format!("a number from 1 to {MOST_AT_ONCE} is wanted"))
}

fn seconds(text: &str) -> std::result::Result<f64, String> {
    let inside = text.parse().ok().filter(|s: &f64| *s > 0.0 && *s <= 86400.0);
    inside.ok_or_else(|| "seconds above 0, at most 86400, are wanted".into())
}

fn token(path: &PathBuf) -> Result<Token> {
    let text = input::text(path)?;
    Token::new(text.trim()).ok_or_else(|| {
        let help = format!("write {} visible ASCII characters or more, for example those of `openssl rand -hex 32`", Token::SHORTEST);
        Error::input("this file holds no token").in_file(path).help(help)
    })
}

/// The surrogates that are served, and their files.
struct Shelf {
    names: Vec<String>,
    places: Vec<Place>,
    out: Output,
}

/// A file, and the surrogate that was read from it last.
struct Place {
    path: PathBuf,
    book: RwLock<Arc<Book>>,
}

impl Place {
    /// The surrogate for requests from now on. Nothing can go wrong while the lock is held, so it is never poisoned.
    fn book(&self) -> Arc<Book> {
        self.book.read().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Reads the file again, and returns a message if there is one. Requests under way are answered by the surrogate they began
    /// with; a file that cannot be used changes nothing.
    fn reread(&self) -> Option<String> {
        let old = self.book();
        if input::read(&self.path).is_ok_and(|bytes| old.is_of(&bytes)) {
            return None;
        }
        match Book::read(&self.path) {
            Ok(book) => {
                *self.book.write().unwrap_or_else(PoisonError::into_inner) = Arc::new(book);
                Some(format!("read anew: {}", self.path.display()))
            }
            Err(error) => Some(format!("warning: '{}' is answered as before, for its file cannot be used: {error}", old.name())),
        }
    }
}

impl Shelf {
    fn read(paths: &[PathBuf], out: Output) -> Result<Self> {
        let mut shelf = Self { names: Vec::new(), places: Vec::new(), out };
        for path in paths {
            let book = Book::read(path)?;
            if shelf.names.iter().any(|name| name == book.name()) {
                return Err(Error::input(format!("two surrogates would be called '{}'", book.name()))
                    .in_file(path)
                    .help("rename one file"));
            }
            shelf.names.push(book.name().to_owned());
            shelf.places.push(Place { path: path.clone(), book: RwLock::new(Arc::new(book)) });
        }
        Ok(shelf)
    }

    fn find(&self, name: &str) -> Option<Arc<Book>> {
        let place = self.names.iter().position(|own| own == name)?;
        Some(self.places[place].book())
    }
}

impl Answers for Shelf {
    fn names(&self) -> &[String] {
        &self.names
    }

    fn info(&self, name: &str) -> Option<Vec<u8>> {
        self.find(name).map(|book| book.info().to_vec())
    }

    fn page(&self, name: &str) -> Option<Vec<u8>> {
        self.find(name).map(|book| book.page().to_vec())
    }

    fn ask(&self, name: &str, ask: Ask) -> std::result::Result<Work, Refusal> {
        let book = self.find(name).ok_or_else(|| Refusal::new(404, format!("there is no surrogate '{name}'")))?;
        let one = |content| Reply { content, conditions: 1 };
        Ok(match ask {
            Ask::Query(body) => {
                let question: Question = read(&body).map_err(refusal)?;
                if book.is_quick(&question) {
                    return book.answer(&question).map(one).map(Work::Done).map_err(refusal);
                }
                Work::Long(Box::new(move || book.answer(&question).map(one).map_err(refusal)))
            }
            Ask::Batch(body) => Work::Long(Box::new(move || {
                let batch: BatchQuestion = read(&body).map_err(refusal)?;
                let content = book.answers(&batch).map_err(refusal)?;
                Ok(Reply { content, conditions: batch.conditions.len() })
            })),
            Ask::Table { rows, options } => {
                let form = form(options).map_err(refusal)?;
                Work::Long(Box::new(move || {
                    let (content, conditions) = book.table(&rows, &form).map_err(refusal)?;
                    Ok(Reply { content, conditions })
                }))
            }
        })
    }

    fn reread(&self) {
        let said: Vec<String> = self.places.iter().filter_map(Place::reread).collect();
        said.iter().for_each(|line| self.out.note(line));
        if said.is_empty() {
            self.out.note("told to read anew: no file has changed");
        }
    }

    fn schemas(&self) -> Map<String, Value> {
        let asked = SchemaSettings::draft2020_12().with(|s| s.definitions_path = "/components/schemas".into());
        let (mut asked, mut told) = (asked.clone().for_deserialize().into_generator(), asked.for_serialize().into_generator());
        let roots = [
            ("Question", asked.subschema_for::<Question>()),
            ("Batch", asked.subschema_for::<BatchQuestion>()),
            ("Answer", told.subschema_for::<ReplyRecord>()),
            ("Answers", told.subschema_for::<BatchRecord>()),
            ("Info", told.subschema_for::<Info>()),
        ];
        let mut schemas: Map<String, Value> = roots.into_iter().map(|(name, schema)| (name.to_owned(), schema.to_value())).collect();
        for (name, schema) in asked.take_definitions(true).into_iter().chain(told.take_definitions(true)) {
            schemas.insert(name, schema);
        }
        schemas
    }
}

/// The options of a table: those of `coldplate query --csv`.
fn form(options: Vec<(String, String)>) -> Result<AnswerForm> {
    let mut form = AnswerForm { confidence: CONFIDENCE, ..AnswerForm::default() };
    for (name, text) in options {
        let wrong = |what: &str| Err(Error::input(what).at_key(name.clone()).read(&text));
        match name.as_str() {
            "columns" => form.columns.push(text),
            "digits" => match text.parse().ok().filter(|n| (1..=17).contains(n)) {
                Some(digits) => form.digits = Some(digits),
                None => return wrong("a number from 1 to 17 is wanted"),
            },
            "confidence" => match text.parse().ok().filter(|p| *p > 0.5 && *p < 1.0) {
                Some(confidence) => form.confidence = confidence,
                None => return wrong("a probability above 0.5 and below 1 is wanted, for example 0.95"),
            },
            _ => return wrong("there is no such option; there are columns, digits and confidence"),
        }
    }
    Ok(form)
}

/// An error for a client: the message of the terminal, and its parts.
fn refusal(error: Error) -> Refusal {
    let status = if error.kind() == Kind::Input { 400 } else { 500 };
    let (key, help) = (error.location().key.clone(), error.remedy().map(str::to_owned));
    Refusal { status, message: error.to_string(), key, help }
}
