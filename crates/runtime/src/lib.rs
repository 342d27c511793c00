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
//! The bounds a file must keep are the `MAX_` constants of [`format`].
#![no_std]
#![forbid(unsafe_code)]
#![warn(missing_docs)]

mod assess;
mod batch;
mod belief;
mod bound;
mod bytes;
mod direction;
mod evaluate;
mod factors;
pub mod format;
mod further;
mod in_time;
mod limit;
mod math;
mod normal;
mod open;
mod single;
mod surrogate;
mod together;
mod uncertain;
mod verdict;

pub use assess::{Chance, LimitChance};
pub use batch::Room;
pub use belief::{Belief, LearnError, Reading, Surprise};
pub use bytes::Numbers;
pub use direction::Band;
pub use evaluate::ShapeError;
pub use in_time::{InTime, State, StepError};
pub use limit::LimitKind;
pub use normal::{NINETY_FIVE, probability_above_chi_square, probability_below};
pub use open::OpenError;
pub use single::{Single, SingleState};
pub use surrogate::{Basis, Held, Indices, Kernel, Limit, Point, Polynomial, Scaling, SelfTest, Surrogate, Transform, Variable};
pub use uncertain::{Origin, Parameter, Scale, Uncertainty};
pub use verdict::{Acceptability, CONFIDENCE, LimitValue, Verdict};
