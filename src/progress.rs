//! How far long work is: its share is reported from whichever thread did some of it.

use std::sync::{Mutex, PoisonError};

/// Where the share of some work that is done is reported, from 0 to 1.
pub(crate) type Report<'a> = &'a (dyn Fn(f64) + Sync);

/// Adds up what is done, and reports its share.
pub(crate) struct Progress<'a> {
    report: Report<'a>,
    expected: f64,
    /// Reported under the lock, so that the share never falls.
    done: Mutex<usize>,
}

impl<'a> Progress<'a> {
    /// Of `expected` pieces of work.
    pub(crate) fn new(report: Report<'a>, expected: f64) -> Self {
        Progress { report, expected, done: Mutex::new(0) }
    }

    /// So many more pieces are done.
    pub(crate) fn add(&self, pieces: usize) {
        let mut done = self.done.lock().unwrap_or_else(PoisonError::into_inner);
        *done += pieces;
        (self.report)((*done as f64 / self.expected).min(1.0));
    }
}
