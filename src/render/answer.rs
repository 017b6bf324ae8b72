//! What callers answer to reports of progress.

use std::ops::ControlFlow;

/// What may come back from whoever is told the progress.
pub trait Answer {
    /// Whether no more is wanted.
    fn stops(self) -> bool;
}

impl Answer for () {
    fn stops(self) -> bool {
        false
    }
}

impl Answer for ControlFlow<()> {
    fn stops(self) -> bool {
        self.is_break()
    }
}
