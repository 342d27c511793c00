//! Reduced models: a machine at any condition in milliseconds, with a bound on every reading.

mod assemble;
mod basis;
mod cells;
mod chosen;
mod conductors;
mod course;
mod cubature;
mod family;
mod field;
mod ground;
mod histories;
mod level;
mod model;
mod motion;
mod offline;
mod slow;
mod split;
mod spread;
mod stations;
mod stored;
mod walls;
mod water;

pub use cells::Guess;
pub use chosen::{Asked, Guesses, InFull, answers};
pub use course::{Beginning, Course, Stretch};
pub use field::Field;
pub use level::{Level, Reduced};
pub use model::{Answer, InTime, Made, ReducedModel};
pub use motion::Path;
pub use offline::{Settings, reduce};
pub use slow::{Slow, SlowSample};
pub use spread::{Slopes, Spread, Spreads};
