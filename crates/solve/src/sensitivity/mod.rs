//! Derivatives of readings with respect to any number of the machine file and every condition.
//!
//! At a steady state R(T, p) = 0 holds for the residual R of the network. With J = dR/dT the field of a parameter
//! is dT/dp = -J⁻¹ dR/dp ([`Derivatives::field`]: one linear solve per parameter), and with the adjoint field
//! Jᵀ l = w of a reading w·T its derivative is -l·dR/dp ([`Derivatives::adjoint`]: one solve per reading, then one
//! scalar product per parameter). J is exact ([`crate::Tangent`]); dR/dp is a four-point difference of the
//! residual of the machine read and built anew on the same cells, at fixed temperatures.
//!
//! The adjoint field of a reading is its rise per watt put into each node. It therefore also gives the effect of candidates that are no
//! parameter of the file: an unknown source, leak or lost contact anywhere, on every reading ([`Screen`]).
//!
//! ```no_run
//! use coldplate_solve::study::Study;
//! let study = Study::read("machines/rig.toml", &[], None)?;
//! let at = study.at(&study.model.machine.condition(&[])?)?;
//! let parameters = [study.parameter("contact.motor.conductance")?, study.parameter("coolant_flow")?];
//! let table = at.jacobian(&study.sensors(), &parameters)?;
//! println!("{} K per W/(m2 K)", table.slopes[0][0]); // first sensor, first parameter, SI
//! # Ok::<(), coldplate_base::error::Error>(())
//! ```

mod difference;
mod open;
mod point;
mod response;
mod screen;
mod uncertain;

pub use difference::{Partial, UNEVEN, Variation};
pub use open::{OpenParameter, Origin, Scale, assumed};
pub use point::{Adjoint, DerivativeTable, DerivativeTarget, Derivatives};
pub use response::{LinearisedHistory, Moment, Moments, ObservableSpace, STEPS};
pub use screen::{Disturbance, Screen};
pub use uncertain::UncertainNumber;
