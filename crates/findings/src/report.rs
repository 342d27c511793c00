//! A diagnosis as one HTML file, for readers who were not there.

use super::energy::ConditionBalance;
use super::{Findings, capital, figures, ladder, name, probability, words};
use super::{next, picture, places};
use coldplate_base::document::name_of;
use coldplate_base::error::Result;
use coldplate_base::numbers::short;
use coldplate_describe::machine::NumberKind;
use coldplate_diagnose::{Certainty, Verdict};
use coldplate_evidence::identify::MeshShare;
use coldplate_evidence::measurement::whiten;
use coldplate_figures::chart::gains::GainsFigure;
use coldplate_figures::report::{Align, KeyFigure, Report, ReportSection, ReportTable, TableCell, Tone};
use coldplate_solve::sensitivity::{UncertainNumber, assumed};

/// Most rows of a table of residuals, a count. Chosen: longer tables say little to a reader.
const ROWS: usize = 60;

/// The whole report.
///
/// # Errors
/// A figure has nothing to show.
pub(super) fn report(found: &Findings<'_>) -> Result<Report> {
    let machine = &found.problem.study.model.machine;
    let mut report = Report::new(format!("{}: measured and simulated", machine.name));
    report.subtitle(found.headline());
    in_short(report.section("In short"), found);
    residuals(report.section("Where readings and model part"), found)?;
    significance(report.section("Is it more than noise?"), found)?;
    energy(report.section("Where the heat goes"), found)?;
    if found.diagnosis.verdict != Verdict::Consistent {
        explanations(report.section("What could explain it"), found)?;
        picture::picture(report.section("Where it sits, and what it changes"), found);
        next(report.section("What to measure next"), found);
    }
    if let Some(figure) = figures::gains(found) {
        steps(report.section("Step by step"), found, &figure)?;
    }
    extended(report.section("The extended machine"), found);
    gain(report.section("What is gained"), found)?;
    method(report.section("How this was found, and its limits"), found);
    provenance(report.section("Where the numbers come from"), found);
    report.footer(format!(
        "coldplate {}, data {}, machine file {}",
        env!("CARGO_PKG_VERSION"),
        found.problem.data.source,
        found.problem.study.document().file().display()
    ));
    Ok(report)
}

fn table<const N: usize>(columns: [(&str, Align); N]) -> ReportTable {
    ReportTable::new(columns)
}

fn text(value: impl Into<String>) -> TableCell {
    TableCell::from(value.into())
}

fn in_short(section: &mut ReportSection, found: &Findings<'_>) {
    let diagnosis = &found.diagnosis;
    let tone = match diagnosis.verdict {
        Verdict::Consistent => Tone::Good,
        Verdict::Explained => Tone::Plain,
        Verdict::SomethingElse | Verdict::CannotTell => Tone::Uncertain,
    };
    section.note(tone, found.headline());
    for sentence in found.gain_in_words().into_iter().chain(found.otherwise_in_words()) {
        section.paragraph(sentence);
    }
    for fault in &found.problem.faults {
        section.note(Tone::Uncertain, format!("Faulty reading: {}.", fault.text()));
    }
    for part in places::set_aside(found) {
        section.note(Tone::Uncertain, format!("Set aside as grossly wrong: {part}."));
    }
    let mut key = vec![
        KeyFigure::new(diagnosis.verdict.code().replace('_', " "), "verdict").tone(tone),
        KeyFigure::new(format!("{:.1}", diagnosis.misfit.chi2), format!("misfit, where {} is expected", diagnosis.misfit.freedom)),
    ];
    if let Some(best) = diagnosis.explanations.first().filter(|_| diagnosis.verdict != Verdict::Consistent) {
        key.push(KeyFigure::new(format!("{:.1}", best.misfit), "misfit left by the best explanation"));
    }
    if let Some(gain) = &diagnosis.gain {
        let gained = gain.low > 0.0;
        key.push(
            KeyFigure::new(
                format!("{:.2} → {:.2} K", gain.before, gain.after),
                format!("error on conditions kept out; noise floor {:.2} K", gain.noise_floor),
            )
            .tone(if gained { Tone::Good } else { Tone::Plain }),
        );
    }
    section.key_figures(key);
    let data = &found.problem.data;
    let kind = if data.is_transient() { "logs over time" } else { "steady readings" };
    section.paragraph(format!(
        "{} of {} sensors, {} in number, were held against what the simulation predicts for the very same conditions. {}",
        capital(kind),
        data.names.len(),
        data.count(),
        match diagnosis.verdict {
            Verdict::Consistent => "The differences are no larger than the uncertainty of readings, conditions and model explains.",
            Verdict::Explained => "The differences are more than noise, and one explanation stands out from all others.",
            Verdict::CannotTell =>
                "The differences are more than noise, and several explanations fit it: more has to be measured to tell them apart.",
            Verdict::SomethingElse => "The differences are more than noise, and nothing that this program can think of accounts for it.",
        }
    ));
}

fn residuals(section: &mut ReportSection, found: &Findings<'_>) -> Result<()> {
    section.paragraph(
        "Each row is a sensor, each column a condition. Vermillion: the sensor reads more than the simulation says; blue: less. A row of one \
         colour points to the sensor or to the part it sits on, a column of one colour to the condition.",
    );
    section.figure(&figures::sheet(found), "")?;
    section.figure(&figures::relative_sheet(found), "")?;
    if let Some(panels) = figures::panels(found) {
        section.paragraph("Residuals that grow with the speed point to friction or motor losses, those that fall with the flow to the water, constant ones to a sensor or a constant heat.");
        section.figure(&panels, "")?;
    }
    section.table(kelvin(found));
    Ok(())
}

/// Residuals in kelvin, folded.
fn kelvin(found: &Findings<'_>) -> ReportTable {
    let (data, diagnosis) = (&found.problem.data, &found.diagnosis);
    let mut head = vec![("test".to_string(), Align::Left)];
    head.extend(data.names.iter().map(|n| (n.clone(), Align::Right)));
    let mut table = ReportTable::new(head);
    let places = whiten::places(data);
    let readings = whiten::readings(data);
    let shown: Vec<usize> = (0..data.rows.len()).step_by(data.rows.len().div_ceil(ROWS).max(1)).collect();
    let are_all = shown.len() == data.rows.len();
    for r in shown {
        let row = &data.rows[r];
        let mut cells = vec![text(row.time.map_or(row.test.clone(), |t| format!("{} at {t:.0} s", row.test)))];
        for k in 0..data.names.len() {
            let cell = places.iter().position(|p| *p == (r, k)).map(|i| {
                let before = format!("{:+.2}", diagnosis.residuals.residual[i]);
                match &diagnosis.explained {
                    Some(e) => format!("{before} / {:+.2}", readings[i] - e[i]),
                    None => before,
                }
            });
            cells.push(text(cell.unwrap_or_default()));
        }
        table.row(cells);
    }
    let both = if diagnosis.explained.is_some() { "; the second number is the residual with the best explanation" } else { "" };
    table.caption(format!("Measured less predicted [K]{both}{}", if are_all { "" } else { "; not every row is shown" }));
    table.folded("The numbers in kelvin");
    table
}

fn significance(section: &mut ReportSection, found: &Findings<'_>) -> Result<()> {
    let misfit = &found.diagnosis.misfit;
    let chance = |p: f64| if p < 1e-6 { "less than one in a million".to_string() } else { format!("{p:.2e}") };
    section.paragraph(format!(
        "The misfit adds up the squares of all residuals, each counted in what its uncertainty lets one expect. Here it is {:.1}; pure noise \
         would give about {} ± {:.0}. The probability that noise alone gives as much: {}.",
        misfit.chi2,
        misfit.freedom,
        (2.0 * misfit.freedom as f64).sqrt(),
        chance(misfit.probability)
    ));
    if let Some(words) = found.noise_in_words() {
        section.paragraph(format!("{}.", capital(&words)));
    }
    let settings = &found.problem.settings;
    section.paragraph(format!(
        "Who looks at many causes finds one that fits by chance: {}. Their evidence pays for every freedom they have, and the posterior probability \
         that none of them acts is {}. No cause is named where that is more than one half; what a model then still leaves with a probability below {} \
         is something else.",
        found.diagnosis.tried.sentence(),
        probability(misfit.look_elsewhere),
        settings.alarm
    ));
    section.figure(&figures::whitened_sheet(found), "")?;
    Ok(())
}

fn energy(section: &mut ReportSection, found: &Findings<'_>) -> Result<()> {
    if let Some(figure) = figures::balance(found) {
        section.figure(&figure, "")?;
    }
    let balances = &found.energy.balances;
    section.table(flows(found, balances));
    if balances.iter().any(|b| !b.water.is_empty()) {
        let table = water(balances);
        section.paragraph(summary(balances));
        section.table(table);
    }
    if let Some(figure) = figures::missing(found) {
        section.figure(&figure, "")?;
    }
    Ok(())
}

fn flows(found: &Findings<'_>, balances: &[ConditionBalance]) -> ReportTable {
    let mut names: Vec<(bool, &String)> = Vec::new();
    for balance in balances {
        for flows in [Some(&balance.before), balance.after.as_ref()].into_iter().flatten() {
            let all = flows.sources.iter().map(|p| (true, p)).chain(flows.sinks.iter().map(|p| (false, p)));
            for (is_source, (name, q)) in all {
                if q.abs() > 1e-3 && !names.contains(&(is_source, name)) {
                    names.push((is_source, name));
                }
            }
        }
    }
    names.sort_by_key(|(is_source, _)| !is_source);
    let mut head = vec![("test".to_string(), Align::Left)];
    head.extend(names.iter().map(|(is_source, n)| (format!("{} {n} [W]", if *is_source { "in:" } else { "out:" }), Align::Right)));
    let mut table = ReportTable::new(head);
    for balance in balances {
        let mut cells = vec![text(&balance.test)];
        for (is_source, name) in &names {
            let of = |flows: &coldplate_solve::meshed::Flows| {
                let pairs = if *is_source { &flows.sources } else { &flows.sinks };
                pairs.iter().find(|(n, _)| n == *name).map(|(_, q)| *q)
            };
            let show = |q: Option<f64>| q.map_or("–".to_string(), |q| format!("{q:.1}"));
            cells.push(text(match &balance.after {
                Some(after) => format!("{} → {}", show(of(&balance.before)), show(of(after))),
                None => show(of(&balance.before)),
            }));
        }
        table.row(cells);
    }
    let more = if found.energy.conditions > balances.len() {
        format!("; {} of {} conditions, evenly chosen", balances.len(), found.energy.conditions)
    } else {
        String::new()
    };
    table.caption(format!("Heat in and out at each condition, as it is → with the best explanation{more}"));
    table.folded("The heat balance of every condition");
    table
}

/// The heat balance by the outlet sensors, in words.
fn summary(balances: &[ConditionBalance]) -> String {
    let all: Vec<_> = balances.iter().flat_map(|b| &b.water).filter(|w| w.deviation > 0.0).collect();
    let weight: f64 = all.iter().map(|w| w.deviation.powi(-2)).sum();
    let mean = all.iter().map(|w| (w.measured - w.before) * w.deviation.powi(-2)).sum::<f64>() / weight;
    // A sensor's own error is in all of its readings: the mean is no surer than the best of them.
    let best = all.iter().map(|w| w.deviation).fold(f64::INFINITY, f64::min);
    let apart = all.iter().filter(|w| (w.measured - w.before).abs() > 2.0 * w.deviation).count();
    let says = match mean {
        m if m.abs() <= 2.0 * best => "which is no more than its sensors are uncertain by",
        m if m > 0.0 => "so the machine gives more heat to it than the model has",
        _ => "so the machine gives less heat to it than the model has",
    };
    format!(
        "Sensors in the water that leaves weigh the heat without the model of the machine: on the mean the water took {mean:+.1} W (± {best:.1}) \
         against the model, {says}. In {apart} of {} readings of it the two differ by more than two standard deviations.",
        all.len()
    )
}

fn water(balances: &[ConditionBalance]) -> ReportTable {
    let mut table = table([
        ("test", Align::Left),
        ("circuit", Align::Left),
        ("by its sensor [W]", Align::Right),
        ("± [W]", Align::Right),
        ("model [W]", Align::Right),
        ("sensor − model [W]", Align::Right),
        ("with explanation [W]", Align::Right),
    ]);
    for balance in balances {
        for w in &balance.water {
            let excess = w.measured - w.before;
            let tone = if excess.abs() > 2.0 * w.deviation { Tone::Uncertain } else { Tone::Plain };
            table.row([
                text(&balance.test),
                text(&w.circuit),
                TableCell::number(w.measured, 1),
                TableCell::number(w.deviation, 1),
                TableCell::number(w.before, 1),
                TableCell::number(excess, 1).tone(tone),
                TableCell::optional(w.after, 1),
            ]);
        }
    }
    table.caption("Heat that the water took; ± is one standard deviation, marked where the difference exceeds two");
    table.folded("Heat to the water by its sensors");
    table
}

fn explanations(section: &mut ReportSection, found: &Findings<'_>) -> Result<()> {
    let diagnosis = &found.diagnosis;
    section.figure(&figures::ranking(found), "")?;
    let open = found.open();
    section.heading("What it could be");
    match (diagnosis.verdict, open.as_slice()) {
        (_, []) => section.paragraph("No explanation is left."),
        (Verdict::SomethingElse, _) => {
            section.paragraph("Even the best of these leaves a misfit that noise does not give. They say where to look, not what it is:")
        }
        (_, [_]) => section.paragraph("One explanation alone:"),
        (_, many) => section.paragraph(format!(
            "{} explanations have {:.0} % of the probability together. With these data nobody can say which of them it is:",
            many.len(),
            100.0 * found.problem.settings.set
        )),
    };
    section.list(open.iter().take(12).map(|e| capital(&words(e))));
    if open.len() > 12 {
        section.paragraph(format!(
            "and {} more: {}",
            open.len() - 12,
            open.iter().skip(12).map(|e| name(e)).collect::<Vec<_>>().join(" | ")
        ));
    }
    let level = &diagnosis.level;
    if diagnosis.verdict == Verdict::CannotTell {
        section.paragraph(match level.certainty {
            Certainty::OneOfTwo => format!("Certain with probability {:.2}: {}; something acts beside it.", level.probability, level.what),
            Certainty::Place => format!("Certain with probability {:.2}: the place, {}.", level.probability, level.what),
            Certainty::Region => format!("Certain with probability {:.2}: the part it touches, {}.", level.probability, level.what),
            _ => "Neither kind nor place is certain.".to_string(),
        });
    }
    let mut ranks = table([("probability", Align::Right), ("misfit left", Align::Right), ("cause", Align::Left), ("", Align::Left)]);
    for (i, e) in found.ranked(40) {
        let standing = if diagnosis.set.contains(&i) { "in the set" } else { "far less probable" };
        let misfit = Some(e.misfit).filter(|misfit| misfit.is_finite());
        ranks.row([text(format!("{:.3}", e.probability)), TableCell::optional(misfit, 1), text(words(e)), text(standing)]);
    }
    ranks.folded("All explanations with some probability");
    section.table(ranks);
    Ok(())
}

fn next(section: &mut ReportSection, found: &Findings<'_>) {
    let next = &found.diagnosis.next;
    if next.is_empty() {
        section.paragraph(match found.diagnosis.verdict {
            Verdict::Explained => {
                "Nothing has to be measured to tell explanations apart. A test at a condition of its own would confirm the cause."
            }
            _ => "No test within the machine's ranges would set two open explanations one standard deviation apart.",
        });
        return;
    }
    section.paragraph(
        "Ranked by how much less probable each makes a wrong name, for its cost. How far a test sets the open explanations apart is counted in \
         standard deviations of what would be read; 4 and more decide. What it would settle is a mean over what it may show.",
    );
    section.table(next::table(found.problem, next));
}

fn extended(section: &mut ReportSection, found: &Findings<'_>) {
    let Some(extended) = &found.extended else {
        section.paragraph(format!("{}.", capital(&format!("none was written: {}", found.why_not_extended()))));
        return;
    };
    let is_calibrated = found.diagnosis.is_calibrated();
    section.paragraph(format!(
        "{} is the machine file with {} in it, ready for every command. The file it comes from is untouched.",
        name_of(&extended.path),
        if is_calibrated { ladder::NUMBERS } else { "the best explanation" }
    ));
    if found.diagnosis.verdict == Verdict::CannotTell && !is_calibrated {
        section.note(
            Tone::Uncertain,
            "The best explanation is one of several that fit: predictions away from the measured conditions may be wrong.",
        );
    }
    for line in found.diagnosis.rungs.iter().filter_map(ladder::left_out) {
        section.note(Tone::Uncertain, format!("{}.", capital(&line)));
    }
    let mut table =
        table([("key", Align::Left), ("before", Align::Left), ("now", Align::Left), ("at the ends of the 90 % interval", Align::Left)]);
    for change in &extended.changes {
        table.row([
            text(&change.key),
            text(change.before.as_deref().map_or("not there".to_string(), short)),
            text(short(&change.after)),
            text(change.interval.as_ref().map_or("–".to_string(), |[low, high]| format!("{} to {}", short(low), short(high)))),
        ]);
    }
    section.table(table);
    section.code(format!("coldplate check {}", name_of(&extended.path)));
}

/// The ladder: the causes of every rung, the numbers refitted beside them, and the remaining residual.
fn steps(section: &mut ReportSection, found: &Findings<'_>, figure: &GainsFigure) -> Result<()> {
    section.paragraph(if found.diagnosis.is_calibrated() {
        "No cause is named. What all films, all heats and all emissivities share, and the other numbers of the machine file, are drawn by the \
         readings as far as their own uncertainty lets them; that predicts data kept out better."
    } else {
        "Causes are in force together. Numbers of the machine file move beside them where rows kept out are predicted better so."
    });
    section.figure(figure, "")?;
    let mut table = table([
        ("step", Align::Right),
        ("cause", Align::Left),
        ("fitted beside it", Align::Left),
        ("what is left", Align::Left),
        ("kept out, before → after [K]", Align::Right),
    ]);
    for (i, rung) in found.diagnosis.rungs.iter().enumerate() {
        let kept_out = rung.gain.as_ref().map_or("–".into(), |gain| format!("{:.2} → {:.2}", gain.before, gain.after));
        table.row([
            text(format!("{}", i + 1)),
            text(capital(&ladder::words(rung))),
            text(ladder::refitted(rung).join("; ")),
            text(ladder::left(rung)),
            text(kept_out),
        ]);
    }
    section.table(table);
    Ok(())
}

fn gain(section: &mut ReportSection, found: &Findings<'_>) -> Result<()> {
    match &found.diagnosis.gain {
        Some(gain) => {
            let gained = gain.before - gain.after;
            let (low, high) = (gain.low, gain.high);
            let verdict = if low > 0.0 {
                "That is a gain on conditions that took no part in the fit."
            } else if gained.abs() < 1e-9 {
                "Nothing is gained, and nothing lost."
            } else {
                "Whether that is a gain cannot be said with these conditions."
            };
            section.paragraph(format!(
                "Conditions were kept out in turn, and the amplitudes fitted again without them. Their error was {:.3} K before and is {:.3} K after: \
                 {gained:.3} K less (90 % interval {low:.3} to {high:.3}). What readings and conditions are uncertain by comes to {:.3} K. {verdict}",
                gain.before, gain.after, gain.noise_floor
            ));
            if let Some(figure) = figures::gain(found) {
                section.figure(&figure, "")?;
            }
        }
        None => {
            section.paragraph("Fewer than three conditions: none can be kept out, so the gain on unseen ones is not known.");
        }
    }
    if let Some(refitted) = &found.refitted {
        section.heading("The surrogate");
        section.paragraph(match &refitted.fit {
            Some(fit) => format!("{}: {}.", name_of(&fit.path), fit.words()),
            None => format!("None was fitted: {}.", found.why_not_extended()),
        });
    }
    Ok(())
}

fn method(section: &mut ReportSection, found: &Findings<'_>) {
    let discrepancy = found.problem.discrepancy;
    section.paragraph(format!(
        "A cause is a place and a kind, composed from the machine's own parts, contacts, channels, surfaces and sensors; its amplitude is free in \
         every condition, so that all sensors together decide the place whatever law governs it. Every hypothesis, and “nothing” among them, has \
         reading noise, each sensor's own error, the errors of every condition, the numbers that are called uncertain, what every calibrated model \
         leaves open ({:.0} % on all films together, {:.0} % on all heats, {:.0} % on all emissivities, {} K per reading), and, as far as the \
         readings ask for it, a spread of all numbers of the machine file and a heat in every part. Bands of a surrogate or of a prediction say how \
         well a machine is known before anything is measured: where the machine file states nothing of its heats, they assume {:.0} % on all heats \
         instead. Every place and kind is fitted at several amplitudes, and sets of several grow while they are more probable. Laws are then held \
         against the amplitudes that were found. A cause that the catalogue lacks can only show as “something else”, and one that leaves the same \
         pattern as another at the measured conditions comes out as probable as that one. Probabilities hold for the stated uncertainties: if those \
         are too small, so are the intervals.",
        100.0 * discrepancy.films,
        100.0 * discrepancy.heats,
        100.0 * discrepancy.emissivities,
        discrepancy.model,
        100.0 * assumed(NumberKind::Heats)
    ));
    section.facts(constants(found));
}

/// Constants that decide the answer, and how large causes are usually, by name.
fn constants(found: &Findings<'_>) -> Vec<(String, String)> {
    let settings = serde_json::to_value(&found.problem.settings).unwrap_or_default();
    let priors = serde_json::to_value(found.problem.study.model.machine.priors).unwrap_or_default();
    let named =
        |(name, value): (&String, &serde_json::Value), before: &str| (format!("{before}{}", name.replace('_', " ")), value.to_string());
    let of = |record: &serde_json::Value, before: &str| -> Vec<(String, String)> {
        record.as_object().map(|fields| fields.iter().map(|field| named(field, before)).collect()).unwrap_or_default()
    };
    [of(&settings, ""), of(&priors, "usual ")].concat()
}

fn provenance(section: &mut ReportSection, found: &Findings<'_>) {
    let problem = &found.problem;
    let document = problem.machine_file();
    let uncertainty = match &problem.uncertainty.file {
        Some(path) => path.display().to_string(),
        None => "no file says it: limits of 0.1 K for readings, sensors and water, 0.05 L/min".into(),
    };
    let ([few, many], own) = (MeshShare::FINEST, problem.study.model.mesh.cells);
    let cells = match own {
        0 => "none: lumped nodes alone".to_string(),
        _ => format!(
            "{own}, corrected to an endlessly fine mesh by finer ones of {few} times as many, {many} where those leave too much open"
        ),
    };
    let mut facts = vec![
        ("program".to_string(), format!("coldplate {}", env!("CARGO_PKG_VERSION"))),
        ("machine file".to_string(), format!("{}, SHA-256 {}", document.file().display(), document.hash())),
        ("readings".to_string(), format!("{}: {}", problem.data.source, list(&problem.data.tests(), 12))),
        ("their uncertainty".to_string(), uncertainty),
        ("cells".to_string(), cells),
        ("seconds".to_string(), format!("{:.1}", found.diagnosis.seconds)),
    ];
    for UncertainNumber { parameter, deviation, .. } in &problem.uncertain {
        let share = 100.0 * deviation / parameter.value.abs();
        facts.push(("uncertain".into(), format!("{}, standard deviation {share:.0} %", parameter.name)));
    }
    if !problem.without.is_empty() {
        facts.push(("kinds not tried".into(), problem.without.join(", ")));
    }
    if !problem.user.is_empty() {
        facts.push(("kinds added".into(), problem.user.iter().map(|k| k.name.as_str()).collect::<Vec<_>>().join(", ")));
    }
    section.facts(facts);
    section.list(found.failed.iter().chain(&problem.data.notes).cloned());
}

fn list(names: &[String], most: usize) -> String {
    let shown = names.iter().take(most).cloned().collect::<Vec<_>>().join(", ");
    if names.len() > most { format!("{shown} and {} more", names.len() - most) } else { shown }
}
