//! A bar for long work. Where stderr is no terminal, nothing is shown.

use indicatif::{ProgressBar, ProgressFinish, ProgressStyle};
use std::time::Duration;

const STEPS: f64 = 1000.0;

/// How often the elapsed time is told anew.
const TICK: Duration = Duration::from_millis(200);

/// Runs `work`, and shows the share of it that it says is done.
pub fn during<T>(what: &'static str, work: impl FnOnce(&(dyn Fn(f64) + Sync)) -> T) -> T {
    let bar = shown(ProgressBar::new(STEPS as u64), what, "{msg:14} {wide_bar} {percent:>3}% {elapsed}");
    let done = work(&|share| bar.set_position((share.clamp(0.0, 1.0) * STEPS) as u64));
    bar.finish_and_clear();
    done
}

fn shown(bar: ProgressBar, what: &'static str, template: &str) -> ProgressBar {
    let bar = bar.with_message(what).with_finish(ProgressFinish::AndClear);
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
    // A thread that tells the time is worth it where somebody sees it.
    if !bar.is_hidden() {
        bar.enable_steady_tick(TICK);
    }
    bar
}
