//! A diagnosis as one JSON object: the shape that outside programs rely on.

use serde_json::{Map, Value, json};

use super::super::condition;
use super::energy::Balance;
use super::{Found, name, next, number};
use crate::evidence::diagnose::{Explanation, Part, Verdict, sentence};
use crate::evidence::measurement::whiten;
use crate::solve::meshed::Flows;
use crate::units::celsius;

/// The whole answer.
pub(super) fn json(found: &Found<'_>) -> Value {
    let diagnosis = found.diagnosis;
    let misfit = &diagnosis.misfit;
    let has_cause = matches!(diagnosis.verdict, Verdict::Explained | Verdict::CannotTell);
    let causes = diagnosis.explanations.first().filter(|_| has_cause).map(|e| cause(found, e)).unwrap_or_default();
    json!({
        "misfit": {"chi2": misfit.chi2, "dof": misfit.freedom, "p": misfit.probability, "p_look_elsewhere": misfit.look_elsewhere},
        "verdict": diagnosis.verdict.code(),
        "headline": found.headline(),
        "level": {"name": diagnosis.level.name, "what": diagnosis.level.what, "probability": number(diagnosis.level.probability)},
        "probabilities": {"nothing": number(diagnosis.others.0), "something_else": number(diagnosis.others.1)},
        "causes": causes,
        "set": found.open().into_iter().map(|e| cause(found, e)).collect::<Vec<_>>(),
        "next_measurement": next::json(found),
        "gain": diagnosis.gain.as_ref().map(|g| json!({
            "rmse_before_K": g.before, "rmse_after_K": g.after, "low": g.interval.0, "high": g.interval.1,
            "noise_floor_K": g.noise_floor, "held_out": g.conditions,
        })),
        "extended_machine": found.extended.map(|e| e.path.display().to_string()),
        "changes": found.extended.map(|e| e.changes.iter().map(|c| json!({
            "key": c.key, "before": c.before, "after": c.after, "interval": c.interval,
        })).collect::<Vec<_>>()),
        "surrogate": found.refitted.and_then(|r| r.fit.as_ref()).map(|fit| json!({
            "file": fit.path.display().to_string(), "conditions": fit.conditions, "failed": fit.failed,
            "held_out_max_K": fit.largest, "error_before_K": fit.readings.map(|r| r.0), "error_after_K": fit.readings.map(|r| r.1),
            "readings": fit.readings.map(|r| r.2), "readings_outside": fit.readings.map(|r| r.3),
        })),
        "tried": diagnosis.tried.0, "visible": diagnosis.tried.1,
        "missing_heat": diagnosis.missing.iter().map(|m| json!({
            "part": m.part, "law": m.law.words(), "W": number(m.watts), "standard_deviation_W": number(m.deviation), "misfit_explained": number(m.explained),
        })).collect::<Vec<_>>(),
        "heat_balance": found.energy.balances.iter().map(|b| balance(found, b)).collect::<Vec<_>>(),
        "readings": readings(found),
        "seconds": diagnosis.seconds,
    })
}

fn cause(found: &Found<'_>, explanation: &Explanation) -> Vec<Value> {
    let others: Vec<String> = found.open().into_iter().filter(|o| *o != explanation).map(name).collect();
    let of = |p: &Part| {
        let shown = p.shown();
        let (low, high) = p.interval();
        json!({
            "kind": p.hypothesis.kind, "place": p.hypothesis.place, "law": p.hypothesis.law.words(),
            "parameters": {shown.name: {"value": number(shown.value), "low": number(shown.low), "high": number(shown.high), "unit": shown.unit}},
            "amplitude": {"value": number(p.amplitude), "low": number(low), "high": number(high), "unit": p.hypothesis.unit},
            "probability": number(explanation.probability), "misfit_left": number(explanation.misfit), "text": sentence(p),
            "ambiguous_with": others,
        })
    };
    explanation.parts.iter().map(of).collect()
}

fn balance(found: &Found<'_>, balance: &Balance) -> Value {
    let flows = |f: &Flows| {
        let map = |pairs: &[(String, f64)]| pairs.iter().map(|(name, q)| (name.clone(), number(*q))).collect::<Map<String, Value>>();
        json!({"in_W": map(&f.sources), "out_W": map(&f.sinks)})
    };
    let water = balance.water.iter().map(|w| {
        json!({"circuit": w.circuit, "measured_W": number(w.measured), "standard_deviation_W": number(w.deviation),
            "before_W": number(w.before), "after_W": w.after.map(number)})
    });
    json!({
        "test": balance.test,
        "condition": condition::to_json(&found.problem.study.model.machine, &balance.condition),
        "before": flows(&balance.before), "after": balance.after.as_ref().map(flows),
        "water": water.collect::<Vec<_>>(),
    })
}

fn readings(found: &Found<'_>) -> Vec<Value> {
    let (data, diagnosis) = (&found.problem.data, found.diagnosis);
    let measured = whiten::readings(data);
    let of = |(i, (r, k)): (usize, &(usize, usize))| {
        let row = &data.rows[*r];
        json!({
            "test": row.test, "time_s": row.time, "sensor": data.names[*k], "measured_degC": celsius(measured[i]),
            "predicted_degC": celsius(diagnosis.sheet.predicted[i]), "residual_K": diagnosis.sheet.residual[i],
            "whitened": diagnosis.sheet.whitened[i], "explained_degC": diagnosis.explained.as_ref().map(|e| celsius(e[i])),
        })
    };
    whiten::places(data).iter().enumerate().map(of).collect()
}
