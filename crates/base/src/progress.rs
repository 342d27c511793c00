//! Progress reports of long computations.

/// Receiver of progress reports of a long computation. Every closure over a text is one: `&|what: &str|
/// eprintln!("{what}")`. Reports of counted work may come from several threads at once.
pub trait Progress: Sync {
    /// Reports that a new stage of the work begins, or a remark on the present stage.
    fn say(&self, what: &str);

    /// `done` of `total` pieces of the present stage are finished; `what` names the pieces: `conditions`.
    fn count(&self, done: usize, total: usize, what: &str) {
        let _ = (done, total, what);
    }

    /// Reports the state of the present stage. A terminal shows the text in place; it is stored nowhere.
    fn at(&self, what: &str) {
        let _ = what;
    }
}

impl<F: Fn(&str) + Sync> Progress for F {
    fn say(&self, what: &str) {
        self(what);
    }
}

/// Receiver that ignores all reports.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl Progress for Silent {
    fn say(&self, _: &str) {}
}
