//! How long computations say how far they have come.

/// Hears what a long computation is doing. Every closure over a text is one: `&|what: &str| eprintln!("{what}")`.
/// Counted work may come from several threads at once.
pub trait Progress: Sync {
    /// A new stage of the work begins, or a remark on it.
    fn say(&self, what: &str);

    /// `done` of `total` pieces of the present stage are finished; `what` names the pieces: `conditions`.
    fn count(&self, done: usize, total: usize, what: &str) {
        let _ = (done, total, what);
    }

    /// Where the present stage stands: shown in place where somebody looks on, and kept nowhere.
    fn at(&self, what: &str) {
        let _ = what;
    }
}

impl<F: Fn(&str) + Sync> Progress for F {
    fn say(&self, what: &str) {
        self(what);
    }
}

/// Says nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl Progress for Silent {
    fn say(&self, _: &str) {}
}
