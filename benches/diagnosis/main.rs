//! Hidden effects, found or not: the goals of a diagnosis over many seeded cases.
//!
//!     cargo bench --bench diagnosis -- [CASES] [FIRST SEED] [MACHINE 0..2] [FAMILY] [stated=FACTOR]
//!
//! with the noise of readings and sensors stated FACTOR times as large as it is,
//! prints a line per case that went wrong, then the table of goals with 95 % confidence limits and the reliability of the
//! stated probabilities.

#[path = "../../tests/diagnose/twin/mod.rs"]
mod twin;

use std::time::Instant;

use coldplate::evidence::diagnose::{Diagnosis, Verdict, diagnose};
use coldplate::foundation::progress::Silent;
use coldplate::foundation::random::Random;
use twin::score::{Score, score};
use twin::{Case, Family};

/// Families in turn.
const FAMILIES: [Family; 12] = [
    Family::Clean,
    Family::One,
    Family::Two,
    Family::One,
    Family::Clean,
    Family::One,
    Family::Outside,
    Family::Clean,
    Family::One,
    Family::Two,
    Family::Inseparable,
    Family::Outside,
];

/// Sizes of effects that are counted apart.
const BOUNDS: [f64; 6] = [0.0, 3.0, 5.5, 8.0, 12.0, 20.0];

/// Bins of the reliability diagram.
const BINS: usize = 5;

/// One case with what came of it.
struct Outcome {
    family: Family,
    score: Score,
    verdict: Verdict,
    after: Option<(f64, f64, f64)>,
}

fn main() {
    let args: Vec<u64> = std::env::args().skip(1).filter_map(|a| a.parse().ok()).collect();
    let (count, first) = (args.first().copied().unwrap_or(500), args.get(1).copied().unwrap_or(100_000));
    let machine = args.get(2).map(|m| *m as usize);
    let only = std::env::args().skip(1).find_map(|a| FAMILIES.into_iter().find(|f| format!("{f:?}") == a));
    let stated: f64 = std::env::args().find_map(|a| a.strip_prefix("stated=")?.parse().ok()).unwrap_or(1.0);
    let clock = Instant::now();
    let mut outcomes: Vec<Outcome> = Vec::new();
    for i in 0..count {
        let seed = first + i;
        let family = only.unwrap_or(FAMILIES[(i % FAMILIES.len() as u64) as usize]);
        let mut case = twin::case(seed, family, machine);
        let uncertainty = &mut case.problem.uncertainty;
        uncertainty.noise.iter_mut().chain(&mut uncertainty.bias).for_each(|deviation| *deviation *= stated);
        let found = match diagnose(&case.problem, &Silent) {
            Ok(found) => found,
            Err(e) => {
                println!("seed {seed} {family:?} {}: {e}", case.machine);
                continue;
            }
        };
        let score = score(&case, &found);
        let wrong = match family {
            Family::Clean => score.detected,
            Family::One => !score.exact && (score.d > 12.0 || score.misnamed),
            Family::Two => !score.exact,
            Family::Outside | Family::Inseparable => score.confident,
        };
        if wrong {
            let hidden: Vec<String> = case.hidden.iter().map(|h| format!("{} at {} ({:.3})", h.kind, h.place, h.amplitude)).collect();
            let named: Vec<String> = found
                .explanations
                .iter()
                .take(2)
                .map(|e| {
                    let parts: Vec<String> = e
                        .causes
                        .iter()
                        .map(|p| {
                            format!("{} at {} {} ({:.3})", p.hypothesis.kind(), p.hypothesis.place, p.hypothesis.law.words(), p.amplitude)
                        })
                        .collect();
                    format!("{:.2} {}", e.probability, parts.join(" + "))
                })
                .collect();
            println!(
                "seed {seed} {family:?} {} n {} d {:.1} chi2 {:.0}/{} p {:.1e} {:.1e}: {} | {} | {}",
                case.machine,
                case.problem.data.rows.len(),
                score.d,
                found.misfit.chi2,
                found.misfit.freedom,
                found.misfit.probability,
                found.misfit.look_elsewhere,
                hidden.join(" + "),
                found.verdict.code(),
                named.join(" / ")
            );
        }
        if score.covered == Some(false) {
            let part = &found.explanations[0].causes[0];
            println!(
                "seed {seed} {} d {:.1}: {} at {}: true {:.4}, found {:.4} +- {:.4}, off by {:.1} deviations",
                case.machine,
                score.d,
                part.hypothesis.kind(),
                part.hypothesis.place,
                case.hidden[0].amplitude,
                part.amplitude,
                part.deviation,
                score.off.unwrap_or(f64::NAN)
            );
        }
        let floor = floor(&case, &found);
        if let Some(g) = found.gain.as_ref().filter(|g| family == Family::One && g.after > 1.15 * floor) {
            println!(
                "seed {seed} {} n {} d {:.1} {} at {}: held-out {:.3} K of {:.3} K before, floor {:.3} K, {}",
                case.machine,
                case.problem.data.rows.len(),
                score.d,
                case.hidden[0].kind,
                case.hidden[0].place,
                g.after,
                g.before,
                floor,
                found.verdict.code()
            );
        }
        let after = found.gain.as_ref().map(|g| (g.before, g.after, floor));
        outcomes.push(Outcome { family, score, verdict: found.verdict, after });
        if clock.elapsed().as_secs() > 0 && i % 50 == 49 {
            eprintln!("{} cases, {:.2} s each", i + 1, clock.elapsed().as_secs_f64() / (i + 1) as f64);
        }
    }
    let of = |family: Family, keep: &dyn Fn(&Outcome) -> bool| -> Vec<&Outcome> {
        outcomes.iter().filter(|o| o.family == family && keep(o)).collect()
    };
    println!(
        "\n{} cases, {:.2} s each\n\n| goal | aim | found | 95 % limits | cases |\n|---|---|---|---|---|",
        outcomes.len(),
        clock.elapsed().as_secs_f64() / outcomes.len().max(1) as f64
    );
    let all = |_: &Outcome| true;
    let line = |name: &str, aim: &str, chosen: Vec<&Outcome>, good: &dyn Fn(&Outcome) -> bool| {
        let k = chosen.iter().filter(|o| good(o)).count();
        let (low, high) = wilson(k, chosen.len());
        println!(
            "| {name} | {aim} | {:.1} % | {:.1} to {:.1} % | {} |",
            100.0 * k as f64 / chosen.len().max(1) as f64,
            100.0 * low,
            100.0 * high,
            chosen.len()
        );
    };
    line("false alarms on clean data", "<= 1 %", of(Family::Clean, &all), &|o| o.score.detected);
    line("one effect detected, d >= 5.5", ">= 95 %", of(Family::One, &|o| o.score.d >= 5.5), &|o| o.score.detected);
    line("right group first, d >= 12", ">= 95 %", of(Family::One, &|o| o.score.d >= 12.0), &|o| o.score.group);
    line("kind and place first, d >= 12", "", of(Family::One, &|o| o.score.d >= 12.0), &|o| o.score.exact);
    line("set holds the truth (detected)", ">= 95 %", of(Family::One, &|o| o.score.detected), &|o| o.score.in_set);
    line("named with confidence, d >= 12", "", of(Family::One, &|o| o.score.d >= 12.0), &|o| o.score.confident);
    line("confident and wrong, one effect", "<= 1 %", of(Family::One, &all), &|o| o.score.misnamed);
    line("both of two found, each d >= 12", ">= 90 %", of(Family::Two, &|o| o.score.d >= 12.0), &|o| o.score.exact);
    line("the same, a source's heat and heat at its place being one", "", of(Family::Two, &|o| o.score.d >= 12.0), &|o| o.score.same_heat);
    line("both places of two touched, each d >= 12", "", of(Family::Two, &|o| o.score.d >= 12.0), &|o| o.score.group);
    line("two: set holds both, each d >= 12", "", of(Family::Two, &|o| o.score.d >= 12.0), &|o| o.score.in_set);
    line("two: confident and wrong", "<= 1 %", of(Family::Two, &all), &|o| o.score.misnamed);
    line("inseparable: not named with confidence", ">= 95 %", of(Family::Inseparable, &all), &|o| !o.score.confident);
    line("inseparable: set holds the truth (detected)", ">= 95 %", of(Family::Inseparable, &|o| o.score.detected), &|o| o.score.in_set);
    line("outside: something else (or cannot tell), d >= 8", ">= 80 %", of(Family::Outside, &|o| o.score.d >= 8.0), &|o| {
        matches!(o.verdict, Verdict::SomethingElse | Verdict::CannotTell)
    });
    line("outside: something else, d >= 8", "", of(Family::Outside, &|o| o.score.d >= 8.0), &|o| o.verdict == Verdict::SomethingElse);
    line("outside: confident misnaming", "<= 5 %", of(Family::Outside, &all), &|o| o.score.confident);
    line("90 % intervals cover", "87-93 %", of(Family::One, &|o| o.score.covered.is_some()), &|o| o.score.covered == Some(true));
    line("held-out error <= 1.15 floor, one effect", ">= 90 %", of(Family::One, &|o| o.after.is_some()), &|o| {
        o.after.is_some_and(|(_, a, f)| a <= 1.15 * f)
    });
    line("held-out error never worse, clean", "100 %", of(Family::Clean, &|o| o.after.is_some()), &|o| {
        o.after.is_some_and(|(b, a, _)| a <= b * 1.000_001)
    });
    by_size("one effect", &of(Family::One, &all));
    by_size("two effects, by the one that shows less", &of(Family::Two, &all));
    println!("\nreliability of stated probabilities (one effect, detected): stated, right, cases");
    let mut error = (0.0, 0.0);
    for own in 0..BINS {
        let chosen: Vec<&Outcome> = of(Family::One, &|o| o.score.detected && bin(o.score.stated) == own);
        if chosen.is_empty() {
            continue;
        }
        let n = chosen.len() as f64;
        let stated = chosen.iter().map(|o| o.score.stated).sum::<f64>() / n;
        let right = chosen.iter().filter(|o| o.score.exact).count() as f64 / n;
        println!("  {stated:.3} {right:.3} {}", chosen.len());
        error.0 += n * (stated - right).abs();
        error.1 += n;
    }
    let stated: Vec<f64> = of(Family::One, &|o| o.score.detected).iter().map(|o| o.score.stated).collect();
    println!("calibration error {:.3}; as many honest probabilities would show {:.3}", error.0 / f64::max(error.1, 1.0), honest(&stated));
}

/// What the machine as it is would leave if nothing were hidden, K: no extension can be expected to do better.
fn floor(case: &Case, found: &Diagnosis) -> f64 {
    let left = |(i, r): (usize, &f64)| r - case.shifts.iter().map(|shift| shift[i]).sum::<f64>();
    let squares = found.residuals.residual.iter().enumerate().map(left).map(|v| v * v).sum::<f64>();
    (squares / found.residuals.residual.len().max(1) as f64).sqrt()
}

/// What is found of effects by how far they stand out of their covariance.
fn by_size(title: &str, outcomes: &[&Outcome]) {
    println!(
        "\n{title}\n\n| d | cases | detected | right group first | kind and place first | set holds the truth | named with confidence | named wrongly |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for (i, low) in BOUNDS.iter().enumerate() {
        let high = BOUNDS.get(i + 1).copied().unwrap_or(f64::INFINITY);
        let chosen: Vec<&&Outcome> = outcomes.iter().filter(|o| o.score.d >= *low && o.score.d < high).collect();
        let count = |good: &dyn Fn(&Score) -> bool| chosen.iter().filter(|o| good(&o.score)).count();
        println!(
            "| {low} to {high} | {} | {} | {} | {} | {} | {} | {} |",
            chosen.len(),
            count(&|s| s.detected),
            count(&|s| s.group),
            count(&|s| s.exact),
            count(&|s| s.in_set),
            count(&|s| s.confident && !s.misnamed),
            count(&|s| s.misnamed)
        );
    }
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

/// Wilson's interval of a share.
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
