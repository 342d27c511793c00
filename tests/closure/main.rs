//! Closures against numbers from outside.

