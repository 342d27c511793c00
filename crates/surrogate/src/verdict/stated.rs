//! The surrogate of a machine of which more is known: parameters that are stated, or learnt from readings.

use std::borrow::Cow;

use coldplate_runtime::{Belief, Parameter, Surrogate, Variable};

use super::condition;
use crate::fit::file;
use crate::fit::model::StateDistribution;
use coldplate_base::error::{Error, Result};
use coldplate_base::numbers::significant;

/// A stated value: a name, and a value with its unit.
pub(crate) type StatedValue = (String, String);

/// Whether a name is that of an uncertain parameter of a surrogate.
pub(crate) fn is_parameter(surrogate: &Surrogate<'_>, name: &str) -> bool {
    surrogate.uncertainty().is_some_and(|own| own.parameters().any(|p| p.name == name))
}

/// Whether stated values make another surrogate: one is for a parameter, or for a variable that was held.
pub fn changes(surrogate: &Surrogate<'_>, given: &[StatedValue]) -> bool {
    let is_held = |name: &str| surrogate.held().any(|held| held.name == name.trim() || held.name == name.trim().replace('-', "_"));
    given.iter().any(|(name, _)| is_parameter(surrogate, name) || is_held(name))
}

/// The surrogate file of the machine with the values `given`: its parameters, and its held variables if they are followed. Other
/// stated values come back unchanged.
///
/// # Errors
/// Errors of [`with_stated`] and [`with_moved`].
pub fn with_known<'b>(bytes: &'b [u8], given: &[StatedValue]) -> Result<(Cow<'b, [u8]>, Vec<StatedValue>)> {
    let opened = file::open(bytes)?;
    if !changes(&opened, given) {
        return Ok((Cow::Borrowed(bytes), given.to_vec()));
    }
    let (stated, given): (Vec<StatedValue>, Vec<StatedValue>) = given.iter().cloned().partition(|(name, _)| is_parameter(&opened, name));
    let bytes = if stated.is_empty() { Cow::Borrowed(bytes) } else { Cow::Owned(with_stated(bytes, &stated)?) };
    let (moved, given) = with_moved(&bytes, &given)?;
    Ok((Cow::Owned(moved), given))
}

/// The surrogate file of the machine at other values of variables that it holds and follows. Values of other variables, or outside
/// the range that is followed, come back unchanged.
///
/// # Errors
/// Errors of [`SurrogateSpec::moved`](crate::fit::model::SurrogateSpec::moved); a value without its unit.
pub fn with_moved(bytes: &[u8], given: &[StatedValue]) -> Result<(Vec<u8>, Vec<StatedValue>)> {
    let surrogate = file::decode(bytes)?;
    let mut to: Vec<(usize, f64)> = Vec::new();
    let mut rest: Vec<StatedValue> = Vec::new();
    for (name, text) in given {
        let plain = name.trim().replace('-', "_");
        let own = surrogate.followed.iter().flat_map(|f| &f.variables);
        let found = own.map(|v| (v, &surrogate.held[v.held])).find(|(_, held)| held.name == name.trim() || held.name == plain);
        let value = match found {
            Some((v, held)) => {
                let variable = Variable { name: &held.name, unit: &held.unit, low: v.low, high: v.high };
                Some(condition::value_of(&variable, text).map_err(|e| e.at_key(name))?)
            }
            None => None,
        };
        match (found, value) {
            (Some((v, held)), Some(value))
                if value != held.value && (v.low..=v.high).contains(&value) && to.iter().all(|(k, _)| *k != v.held) =>
            {
                to.push((v.held, value));
            }
            _ => rest.push((name.clone(), text.clone())),
        }
    }
    if to.is_empty() {
        return Ok((bytes.to_vec(), rest));
    }
    Ok((file::encode(&surrogate.moved(&to)?)?, rest))
}

/// The surrogate file of the machine whose parameters have these values (name and text with its unit).
///
/// # Errors
/// A name that is no parameter of the surrogate; a value without its unit, or outside the range in which it may be stated.
pub fn with_stated(bytes: &[u8], stated: &[(String, String)]) -> Result<Vec<u8>> {
    let opened = file::open(bytes)?;
    let Some(uncertainty) = opened.uncertainty() else {
        return Err(Error::input("this surrogate has no parameters: it states no uncertainty of the machine"));
    };
    learnt(bytes, |belief, work| {
        for (name, text) in stated {
            let found = uncertainty.parameters().enumerate().find(|(_, p)| p.name == name);
            let (index, parameter) = found.ok_or_else(|| {
                let known: Vec<&str> = uncertainty.parameters().map(|p| p.name).collect();
                Error::input(format!("'{name}' is no parameter of this surrogate"))
                    .at_key(name)
                    .help(format!("it has {}", known.join(", ")))
            })?;
            let z = parameter.standardised(value(&parameter, text).map_err(|e| e.at_key(name))?);
            belief.know(index, z, work).map_err(|e| Error::numerics(e.to_string()))?;
        }
        Ok(())
    })
}

/// The surrogate file after `learn` has changed the states. `learn` gets the distribution of the states and memory to
/// work in.
///
/// # Errors
/// Bytes that are no surrogate file, or one without uncertainty; errors of `learn`.
pub fn learnt(bytes: &[u8], learn: impl FnOnce(&mut Belief<'_>, &mut [f64]) -> Result<()>) -> Result<Vec<u8>> {
    let opened = file::open(bytes)?;
    let Some(uncertainty) = opened.uncertainty() else {
        return Err(Error::input("this surrogate states no uncertainty of the machine, so nothing can be learnt of it")
            .help("sweep its machine and fit anew: `coldplate run SWEEP.toml`"));
    };
    let (mut mean, mut covariance) = (vec![0.0; uncertainty.states()], vec![0.0; uncertainty.covariances()]);
    let mut work = vec![0.0; uncertainty.states()];
    let wrong = |e: coldplate_runtime::ShapeError| Error::numerics(e.to_string());
    let mut belief = Belief::begin(&uncertainty, &mut mean, &mut covariance).map_err(wrong)?;
    learn(&mut belief, &mut work)?;
    let mut surrogate = file::decode(bytes)?;
    if let Some(own) = &mut surrogate.uncertainty {
        own.states = Some(StateDistribution { mean, covariance });
    }
    file::encode(&surrogate)
}

fn value(parameter: &Parameter<'_>, text: &str) -> Result<f64> {
    let Parameter { name, unit, low, high, .. } = *parameter;
    let value = condition::value_of(&Variable { name, unit, low, high }, text)?;
    if (low..=high).contains(&value) {
        return Ok(value);
    }
    let unit = if unit == "1" { String::new() } else { format!(" {unit}") };
    let range = format!("it may be stated from {} to {}{unit}, where its slopes hold", significant(low, 4), significant(high, 4));
    Err(Error::input("this value is too far from that of the machine").read(text).help(range))
}
