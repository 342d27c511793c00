//! Reads and evaluates coldplate surrogate files where nothing else can run: no standard library,
//! no allocation, no dependencies, no unsafe code.
//!
//! A surrogate gives, for one operating condition, the temperatures at the measurement points, their uncertainty, and
//! whether the condition is acceptable.
//!
//! ```
//! use coldplate_runtime::{Acceptability, Surrogate};
//!
//! let file = include_bytes!("../fixtures/polynomial.cps");
//! let surrogate = Surrogate::open(file)?;
//! // coolant flow in L/min, coolant and ambient temperature in degC, in the order of the file
//! let condition = [8.0, 20.0, 21.0];
//! let mut temperatures = [0.0; 2];
//! let verdict = surrogate.query(&condition, &mut temperatures)?;
//! assert!(verdict.in_domain);
//! assert_eq!(verdict.state, Acceptability::Acceptable);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! [`Surrogate::open`] checks everything that can be checked, so that later calls cannot fail: every length and index,
//! every number finite, every transform legal on its range, the checksum, and the self-test vectors, which this very
//! build must reproduce. The time it takes is proportional to the size of the file. Evaluation is deterministic: a
//! fixed order of IEEE 754 additions and multiplications, equal on every platform.
//!
//! * [`Surrogate`]: an opened file; every question is asked of it.
//! * [`Verdict`], [`LimitValue`]: whether a condition is acceptable, by bands; [`Chance`], [`LimitChance`]: with a
//!   probability. [`Acceptability`] is the answer of both.
//! * [`Uncertainty`], [`Parameter`], [`Band`]: what the answers leave open, and why.
//! * [`Belief`], [`Reading`]: knowledge of the machine's parameters, and readings that improve it.
//! * [`State`], [`SingleState`]: the machine over time, in double and in single precision.
//! * [`Polynomial`], [`Basis`]: the fitted functions, for exporters.
//!
//! The bounds a file must keep are the `MAX_` constants of [`format`].
#![no_std]
#![forbid(unsafe_code)]
#![warn(missing_docs)]

mod acceptability;
mod assess;
mod bands;
mod batch;
mod belief;
mod bytes;
mod check;
mod direction;
mod evaluate;
mod factors;
pub mod format;
mod further_sections;
mod in_time;
mod joint_normal;
mod learn;
mod limit;
mod math;
mod model;
mod normal;
mod open;
mod shape;
mod single;
mod step;
mod surrogate;
mod together;
mod uncertain;
mod verdict;

pub use acceptability::{Acceptability, CONFIDENCE, Chance, LimitChance, LimitValue, Verdict};
pub use batch::Room;
pub use belief::Belief;
pub use bytes::Numbers;
pub use check::OpenError;
pub use direction::Band;
pub use in_time::InTime;
pub use learn::{LearnError, Reading, Surprise};
pub use limit::LimitKind;
pub use model::{Basis, Indices, Kernel, Polynomial, Scaling, Transform};
pub use normal::{NINETY_FIVE, probability_above_chi_square, probability_below};
pub use shape::ShapeError;
pub use single::{Single, SingleState};
pub use step::{State, StepError};
pub use surrogate::{EmptyCorner, Held, Limit, Point, SelfTest, Surrogate, Variable};
pub use uncertain::{Origin, Parameter, Scale, Uncertainty};
