//! The log of one renderer: what is logged while it works, on whichever thread, and nothing else.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};
use tracing::Dispatch;
use tracing::dispatcher::{get_default, with_default};

/// Lines that nobody takes are kept up to this many; then the oldest go.
const MOST_LINES: usize = 1000;

type SharedLines = Arc<Mutex<VecDeque<String>>>;

/// Collects what is logged in [`Log::collect`]. Clones share their lines. No subscriber that the program has set, for
/// itself or for a thread, gets these lines, and this log gets none of theirs.
#[derive(Debug, Clone)]
pub struct Log {
    lines: SharedLines,
    subscriber: Dispatch,
}

impl Default for Log {
    fn default() -> Self {
        let lines = SharedLines::default();
        let writer = Writer(Arc::clone(&lines));
        let subscriber = tracing_subscriber::fmt()
            .with_max_level(tracing::Level::INFO)
            .with_writer(move || writer.clone())
            .with_ansi(false)
            .with_target(false)
            .without_time()
            .finish();
        Log { lines, subscriber: Dispatch::new(subscriber) }
    }
}

impl Log {
    /// Runs `work` on this thread and collects what it logs here; see [`carried`] for other threads.
    pub fn collect<T>(&self, work: impl FnOnce() -> T) -> T {
        with_default(&self.subscriber, work)
    }

    /// The lines since they were last taken, oldest first; each starts with its level, such as "WARN".
    pub fn take(&self) -> Vec<String> {
        self.lines.lock().unwrap_or_else(PoisonError::into_inner).drain(..).collect()
    }
}

/// `work`, for another thread, with the log of this one.
pub fn carried<T>(work: impl FnOnce() -> T) -> impl FnOnce() -> T {
    let subscriber = get_default(Dispatch::clone);
    move || with_default(&subscriber, work)
}

/// Where a subscriber writes each line at once.
#[derive(Debug, Clone)]
struct Writer(SharedLines);

impl std::io::Write for Writer {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let mut lines = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        lines.push_back(String::from_utf8_lossy(bytes).trim().to_owned());
        if lines.len() > MOST_LINES {
            lines.pop_front();
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_log_has_its_own_lines_from_every_thread() {
        let logs = [Log::default(), Log::default()];
        for (i, log) in logs.iter().enumerate() {
            log.collect(|| {
                tracing::warn!("caller of {i}");
                std::thread::scope(|s| {
                    s.spawn(carried(|| tracing::info!("worker of {i}")));
                });
            });
        }
        tracing::warn!("nobody's");
        for (i, log) in logs.iter().enumerate() {
            assert_eq!(log.take(), [format!("WARN caller of {i}"), format!("INFO worker of {i}")]);
            assert!(log.take().is_empty());
        }
    }

    #[test]
    fn the_oldest_lines_go_first() {
        let log = Log::default();
        log.collect(|| (0..MOST_LINES + 2).for_each(|i| tracing::info!("{i}")));
        let lines = log.take();
        assert_eq!((lines.len(), lines[0].as_str()), (MOST_LINES, "INFO 2"));
    }
}
