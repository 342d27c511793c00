//! docs/record/paper-tables.md.

use coldplate_base::error::Result;
use coldplate_base::numbers::significant;

use super::forbidden;
use super::numbers::{self, CHANGES, NUMBERS};
use super::search::{Compared, DATA, Found, compared};
use super::{Study, TABLES};
use crate::validation::common::{table, written};
use crate::validation::fits::{AGREE, Published, value};

/// The page.
pub fn page(study: &Study, all: &[Published], cells: Option<usize>) -> Result<String> {
    let together = &study.together;
    let own = together.problem.free.iter().filter(|f| f.test.is_some()).count();
    let machine = super::search::beginning(None)?;
    let fine = compared(&together.problem.data, &|test| {
        let at = |f: &coldplate_evidence::identify::Free| f.test.as_deref().is_none_or(|t| t == test);
        let pairs: Vec<_> = together.problem.free.iter().zip(&together.estimate.values).filter(|(f, _)| at(f)).collect();
        machine.with(&pairs.iter().map(|(f, v)| (&f.parameter, **v)).collect::<Vec<_>>())
    })?;
    let mut text = format!(
        "# The paper's tables\n\n{}\
         Tables 7 to 10 of the study are 30 polynomials: temperatures of the Y drive over flow, water, speed and chamber. Here they are taken as measurements, each at \
         seven conditions of its range, one test per table (`{DATA}`; {} coefficients that cannot be as printed are corrected, `data/paper/corrections.csv`), and the \
         program is asked which machine would give them. A curve agrees when its offset (mean of predicted less printed) and its rise (over the range) are within \
         {AGREE} K. The command above writes everything here.\n\n",
        written("cargo bench --bench validation -- tables"),
        all.iter().filter(|p| p.corrected.is_some()).count(),
    );
    let agreed = |c: &&Compared| c.difference.agrees();
    let corrected = all.iter().filter(|p| p.corrected.is_some());
    let corrected = corrected.filter(|p| together.curve(&numbers::test(p.table), &p.sensor).is_some_and(|c| c.difference.agrees())).count();
    text += &format!(
        "In short: **{} of {} curves agree with one machine**, {corrected} of them by a corrected coefficient, with {} numbers common to all tables and {own} heats that one table has \
         for itself; {} agree as shipped, {} where each table stands alone. Each of the {} others is forbidden by a printed number. On the machine file's own mesh, with the \
         same numbers, {} agree.\n\n",
        together.agreeing(),
        together.curves.len(),
        together.problem.free.len() - own,
        study.shipped.iter().filter(agreed).count(),
        study.alone.iter().map(Found::agreeing).sum::<usize>(),
        together.curves.len() - together.agreeing(),
        fine.iter().filter(agreed).count(),
    );
    text += &asked(cells);
    text += "## Every curve\n\nOffset / rise, K; bold where they agree.\n\n";
    text += &curves(study, all);
    text += "## The curves that are not given\n\nHeld against the printed numbers:\n\n";
    for left in together.curves.iter().filter(|c| !c.difference.agrees()) {
        let alone = &study.alone[TABLES.iter().position(|t| numbers::test(*t) == left.test).unwrap_or(0)];
        text += &format!(
            "* *{}, {}* (offset {:+.2} K, rise {:+.2} K): forbidden by {}.\n",
            left.test.replacen("table", "Table", 1),
            left.sensor,
            left.difference.offset,
            left.difference.rise,
            forbidden::reason(together, alone, all, left)?
        );
    }
    text += "\n## The numbers\n\n";
    text += &found(study)?;
    text += "## What the tables hold against each other\n\n";
    text += &against(study, all)?;
    Ok(text)
}

fn asked(cells: Option<usize>) -> String {
    let mut text = String::from("## How it was asked\n\n");
    text += &format!(
        "The machine is `machines/five_axis.toml`{} with two changes where the study says nothing: the motor is bolted to its base as well (the part is called motor base), and the base \
         is read where its neck meets the deck. Weighed is with 0.3 K for each reading and 0.15 K for each sensor, whose points are not published: a curve of seven points is \
         then good to 0.11 K in its offset and 0.34 K in its rise. The two changes, and which heats are free in which table, were chosen with the tables in view: this is the simplest \
         machine found that gives them, no independent test. A number of one table is written `KEY@TEST` ([identification](../how-to/identify.md)):\n\n",
        cells.map_or(String::new(), |n| format!(" on about {n} cells"))
    );
    text += "    coldplate identify machines/five_axis.toml data/paper/tables.csv --brief --starts 1 \\\n";
    for (key, value) in CHANGES {
        text += &format!("        --set '{key}={value}' \\\n");
    }
    let free = numbers::free(None);
    for (i, one) in free.iter().enumerate() {
        let quote = if one.contains(' ') { "\"" } else { "" };
        text += &format!("        --free {quote}{one}{quote}{}\n", if i + 1 == free.len() { "" } else { " \\" });
    }
    text += "\nThe figures here are those of the stated errors. The command also learns a model error where these do not explain what is left \
             ([identification](../how-to/identify.md)), which moves the numbers within their intervals and widens these.\n";
    text += "\nWhat a number may be, beforehand (a heat as a factor on the machine file's own law at the printed condition):\n\n";
    let rows = NUMBERS.iter().map(|n| vec![n.what.to_string(), format!("`{}`", n.key), n.bounds.to_string(), n.because.to_string()]);
    text += &table(&["number", "key", "bounds", "because"], &rows.collect::<Vec<_>>());
    text
}

fn both(c: Option<&Compared>) -> String {
    c.map_or(String::new(), |c| {
        let (mark, d) = (if c.difference.agrees() { "**" } else { "" }, c.difference);
        format!("{mark}{:+.2} / {:+.2}{mark}", d.offset, d.rise)
    })
}

fn curves(study: &Study, all: &[Published]) -> String {
    let mut rows = Vec::new();
    for p in all {
        let test = numbers::test(p.table);
        let own = TABLES.iter().position(|t| *t == p.table).and_then(|t| study.alone[t].curve(&test, &p.sensor));
        let shipped = study.shipped.iter().find(|c| c.test == test && c.sensor == p.sensor);
        let range = study.together.problem.data.rows.iter().filter(|r| r.test == test);
        let k = study.together.problem.data.names.iter().position(|n| *n == p.sensor);
        let readings: Vec<f64> = range.filter_map(|r| k.and_then(|k| r.readings[k])).map(crate::validation::common::celsius).collect();
        let ends = readings.first().zip(readings.last()).map_or(String::new(), |(a, b)| format!("{a:.2}→{b:.2}"));
        rows.push(vec![
            p.table.to_string(),
            p.part.clone(),
            format!("{ends}{}", if p.corrected.is_some() { " (corrected)" } else { "" }),
            both(shipped),
            both(own),
            both(study.together.curve(&test, &p.sensor)),
        ]);
    }
    let count = |c: &[Compared]| format!("**{}**", c.iter().filter(|c| c.difference.agrees()).count());
    let alone: usize = study.alone.iter().map(Found::agreeing).sum();
    rows.push(vec![
        String::new(),
        "agree".into(),
        format!("of {}", all.len()),
        count(&study.shipped),
        format!("**{alone}**"),
        count(&study.together.curves),
    ]);
    table(&["table", "point", "printed, degC", "as shipped", "table alone", "all together"], &rows)
}

/// A value with its 95 % interval; what the data leave open is said.
fn shown(found: &Found, k: usize) -> String {
    let (p, (low, high)) = (&found.problem.free[k].parameter, found.estimate.intervals[k]);
    let at = |v: f64| significant(p.shown(v), 3);
    if found.estimate.at_bound[k] {
        return format!("{} (at its bound)", at(found.estimate.values[k]));
    }
    format!("{} ({} to {})", at(found.estimate.values[k]), at(low), at(high))
}

/// Heat of some sources in a table, W, at its last condition.
fn heat(found: &Found, table: usize, sources: &[&str]) -> Result<f64> {
    let (study, test) = (found.machine(table)?, numbers::test(table));
    let Some(row) = found.problem.data.rows.iter().rfind(|r| r.test == test) else { return Ok(f64::NAN) };
    let state = study.model.solve(&study.model.solver(&row.condition)?, &row.condition)?;
    let of = |s: &&str| study.model.machine.sources.iter().position(|own| own.name == **s).map_or(f64::NAN, |i| state.load.powers[i]);
    Ok(sources.iter().map(of).sum())
}

fn found(study: &Study) -> Result<String> {
    let together = &study.together;
    let estimate = &together.estimate;
    let mut rows = Vec::new();
    for n in NUMBERS.iter().filter(|n| n.own.is_empty()) {
        let p = together.problem.study.parameter(n.key)?;
        let found = together.number(n.key, None).map_or("as it is".into(), |k| shown(together, k));
        let mut row = vec![n.what.to_string(), format!("{} {}", significant(p.shown(p.value), 3), p.unit), found];
        row.extend(study.alone.iter().map(|a| a.number(n.key, None).map_or(String::new(), |k| shown(a, k))));
        rows.push(row);
    }
    let mut text = format!(
        "Misfit {:.0} before, {:.0} after, {} degrees of freedom. Common to all tables, with 95 % intervals; beside them what a table alone says where it is asked. Intervals hold if \
         the model is right but for these numbers. `data/paper/tables_found.csv` has them too.\n\n",
        estimate.misfit.0, estimate.misfit.1, estimate.freedom
    );
    text += &table(&["number", "machine file", "together", "7 alone", "8 alone", "9 alone", "10 alone"], &rows);
    text += "Heats of one table: the factor on the machine file's own law (which puts 3 kN of preload into bearings and nut; 1 is as printed for motor and reducer), \
             and the heat that it makes at the table's last condition.\n\n";
    let mut rows = Vec::new();
    for n in NUMBERS.iter().filter(|n| !n.own.is_empty()) {
        for (t, one) in TABLES.iter().enumerate().filter(|(_, t)| n.own.contains(t) || n.alone.contains(t)) {
            let watts = heat(together, *one, n.sources)?;
            let k = together.number(n.key, Some(*one));
            let factor = k.map_or(1.0, |k| together.estimate.values[k]);
            let alone = study.alone[t].number(n.key, None).map_or(String::new(), |k| shown(&study.alone[t], k));
            rows.push(vec![
                n.what.to_string(),
                one.to_string(),
                k.map_or("as it is".into(), |k| shown(together, k)),
                format!("{:.2} W for {:.2} W", watts, watts / factor),
                alone,
            ]);
        }
    }
    text += &table(&["heat", "table", "factor, together", "at its last condition", "table alone"], &rows);
    Ok(text)
}

fn against(study: &Study, all: &[Published]) -> Result<String> {
    let together = &study.together;
    let at = |table: usize, sensor: &str, x: f64| {
        all.iter().find(|p| p.table == table && p.sensor == sensor).map_or(f64::NAN, |p| value(p.curve(), x))
    };
    let factor = |key: &str, table: usize| together.number(key, Some(table)).map_or("?".into(), |k| shown(together, k));
    let watts = |table: usize, sources: &[&str]| heat(together, table, sources);
    let seat = "Y bearing motor side";
    let slope = |table: usize| (at(table, seat, 24.0) - at(table, seat, 18.0)) / 6.0;
    let ours = |table: usize| -> Result<f64> {
        let study = together.machine(table)?;
        Ok((forbidden::reading(&study, together, table, 6, seat)? - forbidden::reading(&study, together, table, 0, seat)?) / 6.0)
    };
    Ok(format!(
        "* The motor is warmed by {:.2} K at 2500 r/min in Table 9 and by {:.2} K in Table 7, same speed and flow: its heat in Table 9 is {} of the printed 113.7 W, the \
           reducer's {}. No joint can do this, for it would act in both.\n\
         * Table 10 is printed for 250 r/min and has the friction heats of 2500: nut and screw {:.1} W, far bearing {:.1} W, motor-side bearing {:.1} W; Table 9 has {:.1}, {:.1} and {:.1} W \
           at 2500 r/min. Ten times the speed and these agree within a factor of {:.1}.\n\
         * Table 8 is printed for 2500 r/min; its motor makes {:.1} W and its reducer {:.1} W, less than the 11.4 and 5.1 W printed for 250.\n\
         * The motor-side bearing follows its water by {:.2} K per kelvin in Table 8 and its chamber by {:.2} in Table 10, {:.2} together. Where heats are fixed, a machine warmer by 1 K all around is \
           warmer by nearly 1 K everywhere: ours has {:.2} and {:.2}, {:.2} together. The rise of one of the two is printed too small by about {:.1} K, shared here between both.\n",
        at(9, "Y motor", 2500.0) - 20.0,
        at(7, "Y motor", 15.7) - 20.0,
        factor("source.y_motor.power", 9),
        factor("source.y_reducer.power", 9),
        watts(10, &["y_nut", "y_screw"])?,
        watts(10, &["y_far_bearing"])?,
        watts(10, &["y_bearing"])?,
        watts(9, &["y_nut", "y_screw"])?,
        watts(9, &["y_far_bearing"])?,
        watts(9, &["y_bearing"])?,
        [&["y_nut", "y_screw"][..], &["y_far_bearing"], &["y_bearing"]]
            .into_iter()
            .map(|sources| Ok((watts(10, sources)? / watts(9, sources)?).ln().abs().exp()))
            .collect::<Result<Vec<f64>>>()?
            .into_iter()
            .fold(1.0, f64::max),
        watts(8, &["y_motor"])?,
        watts(8, &["y_reducer"])?,
        slope(8),
        slope(10),
        slope(8) + slope(10),
        ours(8)?,
        ours(10)?,
        ours(8)? + ours(10)?,
        6.0 * (ours(8)? + ours(10)? - slope(8) - slope(10)),
    ))
}
