//! The section of a surrogate file on the uncertainty of its answers; `docs/reference/surrogate-sections.md` states the layout.

use coldplate_runtime::{self as runtime, format};

use super::model::{Miss, Origin, ParameterSpec, Scale, StateDistribution, SurrogateSpec, UncertaintySpec};
use coldplate_base::error::{Error, Result};

impl UncertaintySpec {
    /// The uncertainty in an opened file.
    pub fn of(file: &runtime::Uncertainty<'_>) -> Self {
        let parameters = file.parameters().map(|p| ParameterSpec {
            name: p.name.to_owned(),
            unit: p.unit.to_owned(),
            nominal: p.nominal,
            deviation: p.deviation,
            low: p.low,
            high: p.high,
            scale: p.scale,
            origin: p.origin,
        });
        let terms: Vec<Vec<u8>> = (0..file.terms()).map(|t| (0..file.variable_count()).map(|v| file.exponent(t, v)).collect()).collect();
        let count = file.parameter_count();
        let row = |p: usize, t: usize| (0..count).map(|k| file.slope_coefficient(p, t, k)).collect();
        let states = file
            .known()
            .map(|(mean, covariance)| StateDistribution { mean: mean.iter().collect(), covariance: covariance.iter().collect() });
        Self {
            parameters: parameters.collect(),
            transforms: (0..file.variable_count()).map(|v| file.transform(v)).collect(),
            slopes: (0..file.point_count()).map(|p| (0..terms.len()).map(|t| row(p, t)).collect()).collect(),
            misses: (0..file.point_count()).map(|p| file.missed(p)).map(|(own, common)| Miss { own, common }).collect(),
            growth: file.growth(),
            measured: file.measured().map(|row| row.iter().collect()).collect(),
            states,
            terms,
        }
    }

    /// Content of the section in a surrogate file; `tests` are the conditions of the self-tests.
    ///
    /// # Errors
    /// Content beyond the format.
    pub fn section(&self, surrogate: &SurrogateSpec, tests: &[Vec<f64>]) -> Result<Vec<u8>> {
        let (count, points, variables) = (self.parameters.len(), surrogate.points.len(), surrogate.variables.len());
        let sizes_agree = self.slopes.len() == points
            && self.misses.len() == points
            && self.slopes.iter().all(|t| t.len() == self.terms.len() && t.iter().all(|row| row.len() == count))
            && self.terms.iter().all(|t| t.len() == variables)
            && self.transforms.len() == variables
            && self.measured.iter().all(|row| row.len() == variables)
            && self.states.as_ref().is_none_or(|s| {
                let n = count + points + 1;
                s.mean.len() == n && s.covariance.len() == n * (n + 1) / 2
            });
        if !sizes_agree {
            return Err(Error::input("the uncertainty of this surrogate is that of other points, variables or parameters"));
        }
        let transforms = surrogate.variables.iter().zip(&self.transforms).map(|(v, t)| if v.low == v.high { 0 } else { *t as u8 });
        let transforms: Vec<u8> = transforms.chain(std::iter::repeat(0)).take(format::MAX_VARIABLES).collect();
        let degree = self.terms.iter().map(|t| t.iter().map(|e| usize::from(*e)).sum::<usize>()).max().unwrap_or(0);
        let mut text = String::new();
        let mut records = Vec::new();
        for p in &self.parameters {
            records.extend(small(text.len(), 4)?);
            records.extend(small(p.name.len(), 2)?);
            records.extend(small(p.unit.len(), 2)?);
            records.extend([p.scale as u8, p.origin as u8, 0, 0, 0, 0, 0, 0]);
            text.push_str(&p.name);
            text.push_str(&p.unit);
        }
        let mut content = Vec::new();
        for n in [count, self.terms.len(), degree, self.measured.len()] {
            content.extend(small(n, 2)?);
        }
        content.extend(transforms);
        content.extend(small(text.len(), 4)?);
        content.extend(small(usize::from(self.states.is_some()), 2)?);
        content.extend(small(tests.len(), 2)?);
        content.extend(records);
        let mut numbers: Vec<f64> = self.parameters.iter().flat_map(|p| [p.nominal, p.deviation, p.low, p.high]).collect();
        numbers.extend(self.misses.iter().flat_map(|m| [m.own, m.common]));
        numbers.push(self.growth);
        numbers.extend(self.measured.iter().flatten());
        if let Some(states) = &self.states {
            numbers.extend(states.mean.iter().chain(&states.covariance));
        }
        numbers.extend(self.slopes.iter().flatten().flatten());
        for x in tests {
            numbers.extend((0..points).map(|p| self.deviation(surrogate, p, x)));
        }
        content.extend(numbers.iter().flat_map(|n| n.to_le_bytes()));
        content.extend(self.terms.iter().flat_map(|t| t.chunks(2)).map(|pair| pair[0] | pair.get(1).map_or(0, |odd| odd << 4)));
        content.extend(text.as_bytes());
        Ok(content)
    }
}

impl UncertaintySpec {
    /// Adds a parameter that is known exactly: its value is one, and it changes the points by `changes` (point by point, term by
    /// term of `terms`).
    pub(super) fn add_known(&mut self, name: &str, terms: &[Vec<u8>], changes: &[Vec<f64>]) {
        let count = self.parameters.len();
        for term in terms {
            if !self.terms.contains(term) {
                self.terms.push(term.clone());
                self.slopes.iter_mut().for_each(|rows| rows.push(vec![0.0; count]));
            }
        }
        let place: Vec<Option<usize>> = self.terms.iter().map(|term| terms.iter().position(|own| own == term)).collect();
        for (rows, changes) in self.slopes.iter_mut().zip(changes) {
            rows.iter_mut().zip(&place).for_each(|(row, place)| row.push(place.map_or(0.0, |t| changes[t])));
        }
        let before = count + self.misses.len() + 1;
        let known = self.states.take().unwrap_or_else(|| StateDistribution {
            mean: vec![0.0; before],
            covariance: (0..before).flat_map(|i| (0..=i).map(move |j| f64::from(u8::from(i == j)))).collect(),
        });
        let mut mean = known.mean;
        mean.insert(count, 1.0);
        // The new state has no variance: a row and a column of zeros.
        let old = |i: usize| if i < count { Some(i) } else { i.checked_sub(1).filter(|_| i > count) };
        let entry = |i: usize, j: usize| old(i).zip(old(j)).map_or(0.0, |(i, j)| known.covariance[i * (i + 1) / 2 + j]);
        let covariance = (0..=before).flat_map(|i| (0..=i).map(move |j| (i, j))).map(|(i, j)| entry(i, j)).collect();
        self.states = Some(StateDistribution { mean, covariance });
        self.parameters.push(ParameterSpec {
            name: name.into(),
            unit: "1".into(),
            nominal: 0.0,
            deviation: 1.0,
            low: 0.0,
            high: 1.0,
            scale: Scale::Linear,
            origin: Origin::Stated,
        });
    }
}

fn small(value: usize, bytes: usize) -> Result<Vec<u8>> {
    let all = (value as u64).to_le_bytes();
    if all[bytes..].iter().any(|b| *b != 0) {
        return Err(Error::input("a text or table is too long for a surrogate file").read(value));
    }
    Ok(all[..bytes].to_vec())
}
