//! Weights of the structures solved last. Diagnosis, sensitivities and uncertain numbers build a network anew for every number they
//! change; hardly any of these numbers is one of the structure. Results do not depend on this memory.

use std::sync::{Arc, Mutex, PoisonError};

use super::SensorWeights;
use crate::mesh::Mesh;
use coldplate_describe::machine::{Contact, Face, Machine};

/// Structures that are kept, a count. Chosen: memory against structures solved again.
const MOST: usize = 8;

/// Keys of the structures that were solved last, with their weights.
static KNOWN: Mutex<Vec<(String, Arc<Vec<SensorWeights>>)>> = Mutex::new(Vec::new());

/// Everything that the weights depend on, as text.
pub(super) fn key(machine: &Machine, mesh: &Mesh) -> String {
    let parts: Vec<_> = machine.parts.iter().map(|p| (&p.name, &p.blocks, &machine.materials[p.material].elastic)).collect();
    let faces = |contact: &Contact| contact.between.map(|place| (place.part(), format!("{place:?}")));
    let joints: Vec<_> = machine.contacts.iter().map(|c| (faces(c), c.joint)).collect();
    let held: Vec<(Vec<Face>, [bool; 3])> = machine.elasticity.supports.iter().map(|s| (s.faces.clone(), s.holds)).collect();
    let read: Vec<_> = machine.sensors.iter().filter(|s| s.reads.is_displacement()).map(|s| &s.reads).collect();
    format!("{parts:?} {joints:?} {held:?} {read:?} {:?} {}", mesh.divisions(), mesh.cells)
}

/// The weights known for a key, or else those that `solve` finds.
pub(super) fn or_solve<E>(key: String, solve: impl FnOnce() -> Result<Vec<SensorWeights>, E>) -> Result<Arc<Vec<SensorWeights>>, E> {
    let known = || KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, weights)) = known().iter().find(|(own, _)| *own == key) {
        return Ok(Arc::clone(weights));
    }
    let weights = Arc::new(solve()?);
    let mut all = known();
    if all.len() == MOST {
        all.remove(0);
    }
    all.push((key, Arc::clone(&weights)));
    Ok(weights)
}
