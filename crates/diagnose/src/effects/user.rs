//! Kinds of the user's own: heat by a formula of the machine file.

use super::file::text;
use super::words::Quantity;
use super::{Family, Hypothesis, Law, Linearised, Lines, MachineEdit, Prepared, Site, Told, UserKind};
use coldplate_network::Load;
use coldplate_base::error::Result;
use coldplate_base::document::quoted;
use coldplate_solve::sensitivity::Disturbance;
use coldplate_solve::study::Study;

/// Name of the source that a derivative is prepared with.
const PROBE: &str = "kind of the user's own";

/// Heat of a kind of the user's file, per unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct User(pub usize);

impl Family for User {
    fn candidates(site: &Site<'_>) -> Vec<Hypothesis> {
        let one = |(u, kind): (usize, &UserKind)| {
            let signed = Hypothesis::signed(Self(u), &kind.name, kind.places.clone(), kind.scale, "of its expression");
            Hypothesis { is_signed: kind.is_signed, ..signed }
        };
        site.user.iter().enumerate().map(one).collect()
    }

    fn kind(&self) -> &'static str {
        "user"
    }

    fn lines(&self, edit: &MachineEdit<'_>) -> Result<Lines> {
        let kind = &edit.user[self.0];
        let power = format!("({:?}) * ({})", edit.amplitude, kind.expression);
        Ok(Some(vec![(edit.added("source"), source(kind, &power))]))
    }

    fn prepared(&self, study: &Study, user: &[UserKind]) -> Option<Prepared> {
        let kind = user.get(self.0)?;
        let edited = study.edited(&[(format!("source.{}", quoted(PROBE)), source(kind, &kind.expression))]).ok()?;
        let source = edited.model.machine.sources.iter().position(|s| s.name == PROBE)?;
        let shares = edited.model.network.sources.get(source)?.shares.clone();
        Some(Prepared::Heat { shares, machine: Box::new(edited.model.machine), source })
    }

    fn disturbance(&self, at: &Linearised<'_, '_>) -> Option<Disturbance> {
        let Some(Prepared::Heat { shares, machine, source }) = at.prepared else { return None };
        let watts = Load::at(machine, &at.at.condition).ok()?.powers[*source];
        Some(at.screen.source(shares).times(watts))
    }

    fn quantity(&self, _law: Law) -> Quantity {
        Quantity::plain("amplitude", "1")
    }

    fn sentence(&self, told: &Told<'_>) -> String {
        format!("'{}' acts, with the amplitude {}", told.place(), told.range(""))
    }
}

/// A source as TOML.
fn source(kind: &UserKind, power: &str) -> String {
    let places: Vec<String> = kind.places.iter().map(text).collect();
    format!("{{ in = [{}], power = {} }}", places.join(", "), text(power))
}
