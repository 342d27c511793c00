//! The tables of docs/record/diagnosis.md, from journals: goals, sizes, machines, what goes wrong by mechanism, stated probabilities.

use coldplate_base::random::Random;

use crate::draw::Family;
use crate::machines::SETTINGS;
use crate::run::{Answer, Record};
use crate::unkind::Unkindness;

/// Sizes of effects that are counted apart.
const BOUNDS: [f64; 8] = [0.0, 3.0, 5.5, 8.0, 12.0, 20.0, 50.0, 150.0];
/// Bins of the reliability diagram.
const BINS: usize = 10;
/// Times the floor that the error on unseen data may be.
const NEAR: f64 = 1.15;

/// A case with an answer.
#[derive(Clone, Copy)]
struct Done<'a> {
    seed: u64,
    answer: &'a Answer,
}

/// A share that is to be reached, and of which cases.
struct Goal {
    name: &'static str,
    aim: &'static str,
    of: fn(&Answer) -> bool,
    good: fn(&Answer) -> bool,
}

fn is_single(a: &Answer) -> bool {
    a.family == Family::One
}

fn is_hidden(a: &Answer) -> bool {
    matches!(a.family, Family::One | Family::Two | Family::Three | Family::Four)
}

fn is_outside(a: &Answer) -> bool {
    a.family == Family::Outside
}

/// One effect that a machine file has words for: exchanged sensors are put right at the cabinet.
fn is_single_and_writable(a: &Answer) -> bool {
    is_single(a) && !a.hidden.iter().any(|h| h.starts_with("swapped"))
}

fn is_near_floor(a: &Answer) -> bool {
    a.after <= NEAR * a.floor
}

/// No more than the last digits of a rounded table.
fn is_no_worse(a: &Answer) -> bool {
    a.after <= a.before + 1e-3
}

fn is_wrong_and_confident(a: &Answer) -> bool {
    match a.family {
        Family::Outside => a.misplaced,
        _ => a.misnamed || a.wrong_law,
    }
}

const GOALS: &[Goal] = &[
    Goal { name: "false alarms on clean data", aim: "<= 1 %", of: |a| a.family == Family::Clean, good: |a| a.detected },
    Goal {
        name: "the same, all readings sound",
        aim: "<= 1 %",
        of: |a| a.family == Family::Clean && !a.unkind.iter().any(|one| one.is_faulty()),
        good: |a| a.detected,
    },
    Goal { name: "a cause named for certain on clean data", aim: "<= 1 %", of: |a| a.family == Family::Clean, good: |a| a.confident },
    Goal { name: "one effect detected, d >= 5.5", aim: ">= 98 %", of: |a| is_single(a) && a.d >= 5.5, good: |a| a.detected },
    Goal { name: "any number of effects detected, d >= 5.5", aim: ">= 98 %", of: |a| is_hidden(a) && a.d >= 5.5, good: |a| a.detected },
    Goal { name: "outside the list detected, d >= 5.5", aim: ">= 98 %", of: |a| is_outside(a) && a.d >= 5.5, good: |a| a.detected },
    Goal { name: "right part first, one effect, d >= 12", aim: "", of: |a| is_single(a) && a.d >= 12.0, good: |a| a.group || a.right },
    Goal { name: "kind and place first, one effect, d >= 12", aim: "", of: |a| is_single(a) && a.d >= 12.0, good: |a| a.right },
    Goal {
        name: "kind and place in the set, one effect, d >= 5.5",
        aim: ">= 95 %",
        of: |a| is_single(a) && a.detected && a.d >= 5.5,
        good: |a| a.in_set,
    },
    Goal {
        name: "kind and place in the set, law outside the list, d >= 5.5",
        aim: ">= 95 %",
        of: |a| is_outside(a) && a.is_known && a.detected && a.d >= 5.5,
        good: |a| a.in_set,
    },
    Goal {
        name: "named for certain, one effect, d >= 12",
        aim: "",
        of: |a| is_single(a) && a.d >= 12.0,
        good: |a| a.confident && !a.misnamed,
    },
    Goal { name: "certain and wrong in kind or place, one effect", aim: "<= 1 %", of: is_single, good: |a| a.misnamed },
    Goal { name: "certain and wrong in law, one effect", aim: "<= 1 %", of: is_single, good: |a| a.wrong_law },
    Goal { name: "certain and wrong, two to four", aim: "<= 1 %", of: |a| is_hidden(a) && !is_single(a), good: |a| a.misnamed },
    Goal { name: "certain and elsewhere, outside the list", aim: "<= 1 %", of: is_outside, good: |a| a.misplaced },
    Goal { name: "certain and another kind there, outside the list", aim: "<= 1 %", of: is_outside, good: |a| a.misnamed && !a.misplaced },
    Goal { name: "certain of a law, outside the list", aim: "<= 1 %", of: is_outside, good: |a| a.wrong_law && !a.misnamed },
    Goal { name: "certain and wrong, all cases", aim: "<= 1 %", of: |_| true, good: is_wrong_and_confident },
    Goal { name: "both of two named, each d >= 8", aim: ">= 90 %", of: |a| a.family == Family::Two && a.d >= 8.0, good: |a| a.found == 2 },
    Goal { name: "both of two in the set, each d >= 8", aim: "", of: |a| a.family == Family::Two && a.d >= 8.0, good: |a| a.in_set },
    Goal {
        name: "all of three named, each d >= 8",
        aim: ">= 70 %",
        of: |a| a.family == Family::Three && a.d >= 8.0,
        good: |a| a.found == 3,
    },
    Goal { name: "two of three at least, each d >= 8", aim: "", of: |a| a.family == Family::Three && a.d >= 8.0, good: |a| a.found >= 2 },
    Goal { name: "90 % intervals cover", aim: "87-93 %", of: |a| a.covered.is_some(), good: |a| a.covered == Some(true) },
    Goal { name: "unseen error <= 1.15 floor, one effect", aim: ">= 90 %", of: is_single_and_writable, good: is_near_floor },
    Goal { name: "the same, two to four", aim: ">= 90 %", of: |a| is_hidden(a) && !is_single(a), good: is_near_floor },
    Goal { name: "the same, outside the list", aim: ">= 90 %", of: is_outside, good: is_near_floor },
    Goal { name: "the same, one effect, where a machine was written", aim: "", of: |a| is_single(a) && a.extended, good: is_near_floor },
    Goal { name: "unseen error never worse, all cases", aim: "100 %", of: |_| true, good: is_no_worse },
    Goal { name: "the same where a machine was written", aim: "100 %", of: |a| a.extended, good: is_no_worse },
];

/// Prints all tables.
pub fn print(records: &[Record]) {
    let done: Vec<Done> = records.iter().filter_map(|r| Some(Done { seed: r.seed, answer: r.answer.as_ref()? })).collect();
    let seconds: f64 = records.iter().map(|r| r.seconds).sum();
    let (first, last) = (records.iter().map(|r| r.seed).min(), records.iter().map(|r| r.seed).max());
    println!(
        "{} cases, seeds {} to {}, {:.1} s each by the clock.\n",
        records.len(),
        first.unwrap_or(0),
        last.unwrap_or(0),
        seconds / records.len().max(1) as f64
    );
    for failed in records.iter().filter(|r| r.answer.is_none()) {
        println!("seed {} has no answer: {}\n", failed.seed, failed.error.as_deref().unwrap_or("").lines().next().unwrap_or(""));
    }
    goals(&done);
    by_machine(&done);
    by_size("One effect", &done, is_single);
    by_size("Two effects, by the one that shows less beside the other", &done, |a| a.family == Family::Two);
    by_mechanism(&done);
    by_law(&done);
    reliability(&done);
}

fn share(cases: &[Done], good: impl Fn(&Answer) -> bool) -> String {
    let k = cases.iter().filter(|c| good(c.answer)).count();
    let (low, high) = wilson(k, cases.len());
    match cases.len() {
        0 => "-".into(),
        n => format!("{:.1} % of {n} ({:.1}-{:.1})", 100.0 * k as f64 / n as f64, 100.0 * low, 100.0 * high),
    }
}

fn of<'a>(cases: &[Done<'a>], keep: impl Fn(&Answer) -> bool) -> Vec<Done<'a>> {
    cases.iter().filter(|c| keep(c.answer)).copied().collect()
}

fn goals(cases: &[Done]) {
    println!("| goal | aim | all | steady | logs |\n|---|---|---:|---:|---:|");
    for goal in GOALS {
        let chosen = of(cases, goal.of);
        let is_log = |a: &Answer| a.machine.ends_with("logs");
        let (steady, logs) = (of(&chosen, |a| !is_log(a)), of(&chosen, is_log));
        println!(
            "| {} | {} | {} | {} | {} |",
            goal.name,
            goal.aim,
            share(&chosen, goal.good),
            share(&steady, goal.good),
            share(&logs, goal.good)
        );
    }
}

fn by_machine(cases: &[Done]) {
    println!(
        "\n| machine | cases | false alarms | detected, d >= 5.5 | truth in the set | certain and wrong | unseen <= 1.15 floor | \
         unseen worse |\n|---|---:|---:|---:|---:|---:|---:|---:|"
    );
    for setting in &SETTINGS {
        let own = of(cases, |a| a.machine == setting.name);
        let few = |chosen: Vec<Done>, good: fn(&Answer) -> bool| {
            format!("{} of {}", chosen.iter().filter(|c| good(c.answer)).count(), chosen.len())
        };
        println!(
            "| {} | {} | {} | {} | {} | {} | {} | {} |",
            setting.name,
            own.len(),
            few(of(&own, |a| a.family == Family::Clean), |a| a.detected),
            few(of(&own, |a| is_hidden(a) && a.d >= 5.5), |a| a.detected),
            few(of(&own, |a| is_single(a) && a.detected), |a| a.in_set),
            few(own.clone(), is_wrong_and_confident),
            few(of(&own, is_single_and_writable), is_near_floor),
            few(own.clone(), |a| !is_no_worse(a)),
        );
    }
}

fn by_size(title: &str, cases: &[Done], family: fn(&Answer) -> bool) {
    println!(
        "\n{title}:\n\n| d | cases | detected | right part first | kind and place first | all named | truth in the set | certain | certain and wrong |"
    );
    println!("|---|---:|---:|---:|---:|---:|---:|---:|---:|");
    for (i, low) in BOUNDS.iter().enumerate() {
        let high = BOUNDS.get(i + 1).copied().unwrap_or(f64::INFINITY);
        let chosen = of(cases, |a| family(a) && a.d >= *low && a.d < high);
        let count = |good: &dyn Fn(&Answer) -> bool| chosen.iter().filter(|c| good(c.answer)).count();
        let range = if high.is_finite() { format!("{low} to {high}") } else { format!("{low} and more") };
        println!(
            "| {range} | {} | {} | {} | {} | {} | {} | {} | {} |",
            chosen.len(),
            count(&|a| a.detected),
            count(&|a| a.group || a.right),
            count(&|a| a.right),
            count(&|a| a.found == a.hidden.len()),
            count(&|a| a.in_set),
            count(&|a| a.confident),
            count(&|a| a.misnamed)
        );
    }
}

/// What goes wrong, of which cases.
struct Wrong {
    name: &'static str,
    of: fn(&Answer) -> bool,
    is_wrong: fn(&Answer) -> bool,
}

const WRONGS: &[Wrong] = &[
    Wrong { name: "false alarm", of: |a| a.family == Family::Clean, is_wrong: |a| a.detected },
    Wrong { name: "missed, d >= 5.5", of: |a| a.family != Family::Clean && a.d >= 5.5, is_wrong: |a| !a.detected },
    Wrong { name: "truth not in the set", of: |a| is_single(a) && a.detected, is_wrong: |a| !a.in_set },
    Wrong { name: "certain and wrong", of: |_| true, is_wrong: is_wrong_and_confident },
    Wrong { name: "interval misses", of: |a| a.covered.is_some(), is_wrong: |a| a.covered == Some(false) },
    Wrong { name: "unseen > 1.15 floor", of: is_single_and_writable, is_wrong: |a| !is_near_floor(a) },
    Wrong { name: "unseen worse", of: |_| true, is_wrong: |a| !is_no_worse(a) },
];

fn by_mechanism(cases: &[Done]) {
    let heads: Vec<&str> = WRONGS.iter().map(|w| w.name).collect();
    println!("\nWhat goes wrong by mechanism: cases of how many, and the seed of one.\n\n| in force | cases | {} |", heads.join(" | "));
    println!("|---|---:|{}", "---:|".repeat(WRONGS.len()));
    row("nothing but another mesh", &of(cases, |a| a.unkind.is_empty()));
    for one in Unkindness::ALL {
        row(one.words(), &of(cases, |a| a.unkind.contains(&one)));
    }
    for (family, words) in [
        (Family::Clean, "nothing hidden"),
        (Family::One, "one effect"),
        (Family::Two, "two effects"),
        (Family::Three, "three effects"),
        (Family::Four, "four effects"),
        (Family::Outside, "an effect outside the catalogue"),
    ] {
        row(words, &of(cases, |a| a.family == family));
    }
    row("a machine-wide factor among what is hidden", &of(cases, |a| a.hidden.iter().any(|h| h.starts_with("all "))));
    row("all", cases);
}

fn row(words: &str, cases: &[Done]) {
    let cell = |asked: &Wrong| {
        let chosen = of(cases, asked.of);
        let wrong = of(&chosen, asked.is_wrong);
        let example = wrong.first().map_or(String::new(), |c| format!(" ({})", c.seed));
        if chosen.is_empty() { "-".into() } else { format!("{} of {}{example}", wrong.len(), chosen.len()) }
    };
    println!("| {words} | {} | {} |", cases.len(), WRONGS.iter().map(cell).collect::<Vec<String>>().join(" | "));
}

/// Effects that the catalogue does not have, each by itself.
fn by_law(cases: &[Done]) {
    let mut laws: Vec<&str> = cases.iter().filter_map(|c| c.answer.outside.as_deref()).collect();
    laws.sort_unstable();
    laws.dedup();
    println!(
        "\nOutside the catalogue, d >= 5.5:\n\n| hidden | cases | detected | something else or cannot tell | certain, at its part | certain, elsewhere |"
    );
    println!("|---|---:|---:|---:|---:|---:|");
    for law in laws {
        let own = of(cases, |a| a.outside.as_deref() == Some(law) && a.d >= 5.5);
        let count = |good: &dyn Fn(&Answer) -> bool| own.iter().filter(|c| good(c.answer)).count();
        let elsewhere = of(&own, |a| a.misplaced);
        println!(
            "| {law} | {} | {} | {} | {} | {}{} |",
            own.len(),
            count(&|a| a.detected),
            count(&|a| a.detected && !a.confident),
            count(&|a| a.confident && !a.misplaced),
            elsewhere.len(),
            elsewhere.first().map_or(String::new(), |c| format!(" ({})", c.seed))
        );
    }
}

fn reliability(cases: &[Done]) {
    println!(
        "\nStated probability that the named causes act, by kind and place, and how often they did (all that the catalogue has by kind and place, \
         and clean data):\n\n| stated | so | cases | difference | as many honest ones |\n|---|---|---:|---:|---:|"
    );
    let detected = of(cases, |a| a.is_known && a.stated > 0.0);
    let mut error = 0.0;
    for own in 0..BINS {
        let chosen = of(&detected, |a| bin(a.stated) == own);
        if chosen.is_empty() {
            continue;
        }
        let n = chosen.len() as f64;
        let stated = chosen.iter().map(|c| c.answer.stated).sum::<f64>() / n;
        let right = chosen.iter().filter(|c| c.answer.is_so).count() as f64 / n;
        let scatter = chosen.iter().map(|c| c.answer.stated * (1.0 - c.answer.stated)).sum::<f64>().sqrt() / n;
        println!("| {stated:.3} | {right:.3} | {} | {:+.3} | ± {scatter:.3} |", chosen.len(), stated - right);
        error += n * (stated - right).abs();
    }
    let stated: Vec<f64> = detected.iter().map(|c| c.answer.stated).collect();
    println!(
        "\nCalibration error {:.3}; as many honest probabilities would show {:.3}.",
        error / detected.len().max(1) as f64,
        honest(&stated)
    );
}

/// The calibration error that honest probabilities show where there are only so many of them: the mean of 2000 draws.
fn honest(stated: &[f64]) -> f64 {
    let mut random = Random::new(1);
    let mut one = || {
        let mut bins = [0.0f64; BINS];
        for p in stated {
            bins[bin(*p)] += p - f64::from(u8::from(random.unit() < *p));
        }
        bins.iter().map(|b| b.abs()).sum::<f64>() / stated.len().max(1) as f64
    };
    (0..2000).map(|_| one()).sum::<f64>() / 2000.0
}

/// Which bin of the reliability diagram a probability falls into.
fn bin(probability: f64) -> usize {
    ((probability * BINS as f64) as usize).min(BINS - 1)
}

/// Wilson's 95 % interval of a share.
fn wilson(k: usize, n: usize) -> (f64, f64) {
    if n == 0 {
        return (0.0, 1.0);
    }
    let (n, p, z) = (n as f64, k as f64 / n as f64, 1.96);
    let centre = p + z * z / (2.0 * n);
    let half = z * (p * (1.0 - p) / n + z * z / (4.0 * n * n)).sqrt();
    let whole = 1.0 + z * z / n;
    (((centre - half) / whole).max(0.0), ((centre + half) / whole).min(1.0))
}
