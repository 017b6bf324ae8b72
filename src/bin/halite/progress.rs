//! A bar for long work. Where stderr is no terminal, nothing is shown.

use indicatif::{ProgressBar, ProgressFinish, ProgressStyle};

const STEPS: f64 = 1000.0;

/// Runs `work`, and shows the share of it that it says is done.
pub(crate) fn during<T>(what: &'static str, work: impl FnOnce(&(dyn Fn(f64) + Sync)) -> T) -> T {
    let bar = ProgressBar::new(STEPS as u64).with_message(what).with_finish(ProgressFinish::AndClear);
    if let Ok(style) = ProgressStyle::with_template("{msg:12} {wide_bar} {percent:>3}% {elapsed}") {
        bar.set_style(style);
    }
    let done = work(&|share| bar.set_position((share.clamp(0.0, 1.0) * STEPS) as u64));
    bar.finish_and_clear();
    done
}
