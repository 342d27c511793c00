//! Contacts between parts: better or worse than stated, or changing with their temperature.

use super::file::{temperature_table, text};
use super::words::Quantity;
use super::{Family, Hypothesis, Law, Linearised, Lines, MachineEdit, Site, Told};
use coldplate_base::error::Result;
use coldplate_base::document::{Leaf, quoted};
use coldplate_base::units;
use coldplate_solve::sensitivity::Disturbance;
use coldplate_solve::study::Study;

/// Temperature at which a drifting contact conducts as stated, K.
const REFERENCE: f64 = 293.15;
/// Kelvin over which it changes by its amplitude.
const DRIFT: f64 = 10.0;
/// Area of a contact whose total conductance becomes a table, as a share of that of its joint. Chosen: radiation changes by less than any reading.
const HIDDEN: f64 = 1e-4;

/// Conductance of a contact, logarithm.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Contact(pub usize);

/// Key of a contact's number.
fn key(study: &Study, name: &str) -> Option<String> {
    ["conductance", "total_conductance"]
        .iter()
        .map(|law| format!("contact.{}.{law}", quoted(name)))
        .find(|key| matches!(study.document().leaf(key), Ok(Some(Leaf::Text(_)))))
}

impl Contact {
    /// Contacts with a conductance that a factor can be put on.
    pub(super) fn scalable(study: &Study) -> Vec<Self> {
        let network = &study.model.network;
        let can = |name: &str| network.contacts.iter().any(|g| g.name == name) && key(study, name).is_some();
        let contacts = study.model.machine.contacts.iter().enumerate();
        contacts.filter(|(_, contact)| can(&contact.name)).map(|(c, _)| Self(c)).collect()
    }
}

impl Family for Contact {
    fn candidates(site: &Site<'_>) -> Vec<Hypothesis> {
        let (prior, mut found) = (&site.machine.priors, Vec::new());
        for own in Self::scalable(site.study) {
            let contact = &site.machine.contacts[own.0];
            let constant = Hypothesis::signed(own, &contact.name, site.part_names(&contact.between), prior.contact, "ln");
            let drift = Hypothesis { scale: prior.contact_drift, unit: "ln per 10 K", law: Law::Temperature, ..constant.clone() };
            found.extend([constant, drift]);
        }
        found
    }

    fn kind(&self) -> &'static str {
        "contact conductance"
    }

    fn lines(&self, edit: &MachineEdit<'_>) -> Result<Lines> {
        let name = &edit.machine().contacts[self.0].name;
        let Some(key) = key(edit.study, name) else { return Ok(None) };
        if let Some(law) = edit.when() {
            let key = format!("contact.{}.factor", quoted(name));
            let own = match edit.study.document().leaf(&key)? {
                Some(Leaf::Text(own)) => format!("({own}) * "),
                Some(own) => format!("({}) * ", own.to_toml()),
                None => String::new(),
            };
            return Ok(Some(vec![(key, text(format!("{own}exp(({:?}) * ({law}))", edit.amplitude)))]));
        }
        if !edit.hypothesis.is_drift() {
            return edit.scaled(&key, edit.amplitude.exp());
        }
        // A table takes the place of the number. It is per area: a total conductance is that of an area which hides next to nothing of the faces
        // from the chamber, as a contact without an area does.
        let parameter = edit.study.parameter(&key)?;
        let own = &edit.machine().contacts[self.0];
        let (stated, area) = if key.ends_with("total_conductance") {
            let joined = edit.study.model.network.contacts.iter().find(|group| group.name == *name).map_or(1.0, |group| group.area);
            let area = own.area.unwrap_or(HIDDEN * joined);
            let total = units::express(parameter.value, "W/K", parameter.dimension)?;
            (total / area, own.area.is_none().then(|| format!("area = \"{area:?} m2\"")))
        } else {
            (units::express(parameter.value, "W/(m2 K)", parameter.dimension)?, None)
        };
        let table = format!("contact.{}", quoted(name));
        let Some(Leaf::Table(entries)) = edit.study.document().leaf(&table)? else { return Ok(None) };
        let kept = entries.iter().filter(|(k, _)| !k.ends_with("conductance")).map(|(k, v)| format!("{k} = {}", v.to_toml()));
        let drifting = temperature_table(|t| stated * (edit.amplitude * (t - REFERENCE) / DRIFT).exp());
        let all: Vec<String> = kept.chain(area).chain([drifting]).collect();
        Ok(Some(vec![(table, format!("{{ {} }}", all.join(", ")))]))
    }

    fn disturbance(&self, at: &Linearised<'_, '_>) -> Option<Disturbance> {
        let name = &at.machine().contacts[self.0].name;
        Some(at.screen.contact_by(name, |mean| if at.is_drift { (mean - REFERENCE) / DRIFT } else { 1.0 }))
    }

    fn says_when(&self) -> bool {
        true
    }

    fn quantity(&self, law: Law) -> Quantity {
        Quantity::factor(if law == Law::Temperature { "factor_per_10_K" } else { "factor" })
    }

    fn sentence(&self, told: &Told<'_>) -> String {
        if !told.hypothesis.is_drift() {
            return format!("the contact {} conducts {} times what the model has{}", told.place(), told.range(""), told.law());
        }
        format!("the contact {} changes with its temperature: {} times per 10 K", told.place(), told.range(""))
    }
}
