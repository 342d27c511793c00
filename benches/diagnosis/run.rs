//! One case: drawn, diagnosed, and held beside what was hidden.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Instant;

use coldplate_base::progress::Silent;
use coldplate_base::units::Measurand;
use coldplate_diagnose::{Cause, Diagnosis, PlaceAndKind, Problem, diagnose, sentence};
use coldplate_evidence::identify;
use coldplate_evidence::measurement::{Data, whiten};
use coldplate_explore::simulate::Start;
use serde::{Deserialize, Serialize};

use crate::draw::{Drawn, Family, draw};
use crate::journal::Entry;
use crate::unkind::Unkindness;
use coldplate_testing::twin::Hidden;
use coldplate_testing::twin::score::{Score, WeighedSet, score};

/// Cells that unseen rows of a table are predicted with, over those of the model.
const FINER: f64 = 10.0;

/// A case that is done, as the journal has it.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Record {
    pub seed: u64,
    /// Why there is no answer.
    pub error: Option<String>,
    pub seconds: f64,
    pub answer: Option<Answer>,
}

impl Entry for Record {
    fn is_of(&self, seed: u64) -> bool {
        self.seed == seed
    }
}

/// What was asked and answered.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Answer {
    pub machine: String,
    pub family: Family,
    pub unkind: Vec<Unkindness>,
    /// What was hidden, in words.
    pub hidden: Vec<String>,
    /// Which law it was where the catalogue has it not.
    pub outside: Option<String>,
    pub rows: usize,
    pub verdict: String,
    /// What was named, rung by rung; the first explanation where none was.
    pub named: Vec<String>,
    /// Faulty readings that were found, in words.
    pub faults: Vec<String>,
    pub d: f64,
    pub detected: bool,
    pub group: bool,
    pub exact: bool,
    pub right: bool,
    /// How many of what was hidden were named.
    pub found: usize,
    pub in_set: bool,
    pub confident: bool,
    pub misnamed: bool,
    pub misplaced: bool,
    pub wrong_law: bool,
    pub is_known: bool,
    pub stated: f64,
    pub is_so: bool,
    pub covered: Option<bool>,
    pub off: Option<f64>,
    /// The sets that were weighed, most probable first.
    pub sets: Vec<WeighedSet>,
    /// Error on unseen data, K: of the machine as it is, of the extended one, and what is left where everything hidden is known.
    pub before: f64,
    pub after: f64,
    pub floor: f64,
    /// Whether a machine was written.
    pub extended: bool,
    /// The gain that the program states itself, K.
    pub own_gain: Option<f64>,
    /// Low end of its interval, K.
    pub own_low: Option<f64>,
}

/// The case of a seed; told in full where `is_shown`.
pub fn case(seed: u64, is_shown: bool) -> Record {
    let clock = Instant::now();
    let done = catch_unwind(AssertUnwindSafe(|| {
        let drawn = draw(seed);
        if is_shown {
            println!("drawn in {:.1} s", clock.elapsed().as_secs_f64());
        }
        let found = diagnose(&drawn.case.problem, &Silent).map_err(|e| e.to_string())?;
        if is_shown {
            show(seed, &drawn, &found);
        }
        Ok::<Answer, String>(answer(&drawn, &found))
    }));
    let (answer, error) = match done {
        Ok(Ok(answer)) => (Some(answer), None),
        Ok(Err(error)) => (None, Some(error)),
        Err(panic) => {
            let text = panic.downcast_ref::<String>().cloned().or_else(|| panic.downcast_ref::<&str>().map(|s| s.to_string()));
            (None, Some(format!("panic: {}", text.unwrap_or_default())))
        }
    };
    let record = Record { seed, error, seconds: clock.elapsed().as_secs_f64(), answer };
    if is_shown {
        println!("{record:#?}");
    }
    record
}

/// An answer beside what was hidden.
pub fn answer(drawn: &Drawn, found: &Diagnosis) -> Answer {
    let Drawn { case, family, setting, unkind, unseen, floor } = drawn;
    let Score {
        detected,
        group,
        exact,
        right,
        named,
        in_set,
        confident,
        misnamed,
        misplaced,
        wrong_law,
        is_known,
        stated,
        is_so,
        covered,
        d,
        off,
        sets,
    } = score(case, found);
    let told = |h: &Hidden| match &h.outside {
        Some(words) => format!("{words} at {}", h.place),
        None => format!("{} at {} ({:.4})", h.kind, h.place, h.amplitude),
    };
    let causes = |causes: &[Cause]| -> String {
        let each = |c: &Cause| format!("{} {} ({:.4})", c.hypothesis.kind_and_place(), c.hypothesis.law_words(), c.amplitude);
        causes.iter().map(each).collect::<Vec<_>>().join(" + ")
    };
    let before = error(&case.problem, &[], unseen).unwrap_or(f64::NAN);
    let after = found.sets.as_ref().and_then(|sets| error(&case.problem, sets, unseen));
    Answer {
        machine: setting.name.into(),
        family: *family,
        unkind: unkind.clone(),
        hidden: case.hidden.iter().map(told).collect(),
        outside: case.hidden.first().and_then(|h| h.outside.clone()),
        rows: case.problem.data.rows.len(),
        verdict: found.verdict.code().into(),
        named: match found.rungs.as_slice() {
            [] => found.explanations.iter().take(usize::from(detected)).map(|e| causes(&e.causes)).collect(),
            rungs => rungs.iter().map(|rung| causes(&rung.causes)).collect(),
        },
        faults: case.problem.faults.iter().map(|fault| fault.text()).chain(found.aside().iter().map(|own| format!("{own:?}"))).collect(),
        d,
        detected,
        group,
        exact,
        right,
        found: named,
        in_set,
        confident,
        misnamed,
        misplaced,
        wrong_law,
        is_known,
        stated,
        is_so,
        covered,
        off,
        sets,
        before,
        after: after.unwrap_or(before),
        floor: *floor,
        extended: after.is_some(),
        own_gain: found.gain.as_ref().map(|gain| gain.before - gain.after),
        own_low: found.gain.as_ref().map(|gain| gain.low),
    }
}

/// Error on unseen data with lines of the machine file in force, K: root mean square. What is compared is the machine and not its mesh, so
/// that it has the cells of the truth, or continued to many in logs.
fn error(problem: &Problem, sets: &[(String, String)], unseen: &Data) -> Option<f64> {
    let study = problem.study.edited(sets).ok()?;
    let is_fine = unseen.is_transient() || study.model.mesh.cells == 0;
    let study = if is_fine { study } else { study.finer(FINER).ok()? };
    let values = if unseen.is_transient() { identify::continued } else { identify::values };
    let predicted = values(&study, unseen, Start::Steady).ok()?;
    whiten::rmse(&study.model.machine, unseen, &predicted, Measurand::Temperature)
}

fn show(seed: u64, drawn: &Drawn, found: &Diagnosis) {
    let misfit = &found.misfit;
    println!(
        "seed {seed}, {:?} on {}: chi-square {:.0} of {}, p {:.1e} and {:.1e}, level of the machine as it is: {:?}",
        drawn.family, drawn.setting.name, misfit.chi2, misfit.freedom, misfit.probability, misfit.look_elsewhere, found.unexplained
    );
    for hidden in &drawn.case.hidden {
        println!("  hidden: {hidden:?}");
    }
    for (i, e) in found.explanations.iter().enumerate().take(8) {
        let words: Vec<String> = e.causes.iter().map(sentence).collect();
        let mark = if found.set.contains(&i) { "set" } else { "   " };
        println!("  {mark} {:.3}, misfit {:.1}, {:?}: {}", e.probability, e.misfit, e.level, words.join("; "));
    }
    for set in &found.places.sets {
        let name = |member: &PlaceAndKind| {
            let way = if member.is_free { " free" } else { "" };
            let over = member.over.as_ref().map_or(String::new(), |over| format!(" over {over}"));
            format!("{}{way}{over} {:.3?}", member.hypothesis.kind_and_place(), member.amplitudes)
        };
        let names: Vec<String> = set.members.iter().map(name).collect();
        let [lead, kept_out] = [set.lead, set.kept_out.0];
        println!(
            "  {:.3}, lead {lead:.1}, kept out {kept_out:.1}, {} aside, {:?}: {}",
            set.probability,
            set.aside.len(),
            set.looseness,
            names.join(" + ")
        );
    }
    for rung in &found.rungs {
        let words: Vec<String> = rung.causes.iter().map(sentence).collect();
        println!(
            "  rung: {}, share {:.3}, left {:?}, p {:.2e}, gain {:?}",
            words.join("; "),
            rung.share,
            rung.left,
            rung.probability_left,
            rung.gain.as_ref().map(|g| [g.before, g.after, g.low, g.high])
        );
    }
    println!("  others {:?}, gain {:?}", found.others, found.gain.as_ref().map(|g| [g.before, g.after, g.low, g.high]));
}
