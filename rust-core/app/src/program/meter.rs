//! Progress of a command: a bar on a terminal, lines in the logs of batch jobs.

use std::io::Write as _;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::readable::seconds;

/// Receives a stage and its progress, 0 to 1; NaN if it is not known.
pub type Listener = Arc<dyn Fn(&str, f64) + Send + Sync>;

/// How progress is shown.
#[derive(Clone)]
pub(super) enum Display {
    /// A bar that moves.
    Bar,
    /// A line from time to time.
    Lines,
    /// Nothing.
    Nothing,
    /// By another program.
    Host(Listener),
}

/// Time without a line, and the progress that a line must report, unless [`LONGEST`] has passed.
const SHORTEST: Duration = Duration::from_secs(10);
const STEP: f64 = 0.1;
/// Longest time without a line.
const LONGEST: Duration = Duration::from_secs(300);

/// Shows the progress of a command.
pub(super) struct Meter {
    display: Display,
    bar: ProgressBar,
    stage: Mutex<Stage>,
}

/// The current stage, and the last line about it.
struct Stage {
    name: String,
    begun: Instant,
    last_line: Instant,
    last_share: f64,
}

impl Meter {
    pub(super) fn new(display: Display) -> Self {
        let is_bar = matches!(display, Display::Bar);
        let target = if is_bar { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        let bar = ProgressBar::with_draw_target(Some(1000), target);
        let now = Instant::now();
        let stage = Mutex::new(Stage { name: String::new(), begun: now, last_line: now, last_share: 0.0 });
        Self { display, bar, stage }
    }

    /// Progress of a stage, 0 to 1.
    pub(super) fn stage(&self, name: &str, share: f64) {
        self.stage_with(name, Some(share), String::new);
    }

    /// Progress of a stage, 0 to 1, if it is known, with a text about it.
    pub(super) fn stage_with(&self, name: &str, share: Option<f64>, text: impl FnOnce() -> String) {
        match &self.display {
            Display::Nothing => return,
            Display::Host(listener) => return listener(name, share.unwrap_or(f64::NAN)),
            Display::Bar | Display::Lines => {}
        }
        let mut stage = self.current();
        if stage.name != name {
            self.bar.set_position(1000);
            let now = Instant::now();
            *stage = Stage { name: name.to_owned(), begun: now, last_line: now, last_share: 0.0 };
            self.bar.reset();
            if let Ok(style) = ProgressStyle::with_template(template(share.is_some())) {
                self.bar.set_style(style);
            }
            self.bar.set_prefix(name.to_owned());
            self.bar.enable_steady_tick(Duration::from_millis(200));
        }
        let now = share.unwrap_or(0.0).clamp(0.0, 1.0);
        self.bar.set_position((now * 1000.0) as u64);
        match self.display {
            Display::Bar => self.bar.set_message(text()),
            Display::Lines if is_due(stage.last_line.elapsed(), now - stage.last_share) => {
                (stage.last_line, stage.last_share) = (Instant::now(), now);
                let text = text();
                let comma = if text.is_empty() { "" } else { ", " };
                let time = seconds(stage.begun.elapsed().as_secs_f64());
                let done = share.map_or_else(String::new, |share| format!("{:.0} % ", share * 100.0));
                let _ = writeln!(std::io::stderr(), "{name}: {done}after {time}{comma}{text}");
            }
            _ => {}
        }
    }

    /// The current stage. The lock is poisoned only if another thread panicked, which ends the program.
    fn current(&self) -> MutexGuard<'_, Stage> {
        self.stage.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A line that stays above the bar.
    pub(super) fn line(&self, text: &str) {
        match self.display {
            Display::Bar => self.bar.println(text),
            Display::Lines => {
                let _ = writeln!(std::io::stderr(), "{text}");
            }
            Display::Nothing | Display::Host(_) => {}
        }
    }

    /// Leaves the bar full, because the stage has ended.
    pub(super) fn complete(&self) {
        if matches!(self.display, Display::Bar) && !self.current().name.is_empty() {
            self.bar.set_position(1000);
            self.bar.finish();
        }
    }

    /// Removes the bar, unless it is complete.
    pub(super) fn finish(&self) {
        if !self.bar.is_finished() {
            self.bar.finish_and_clear();
        }
    }
}

/// What the bar shows; without a bar if the share is not known.
fn template(is_known: bool) -> &'static str {
    if is_known {
        "{prefix:>12} {wide_bar} {percent:>3} %  {elapsed}  {msg}"
    } else {
        "{prefix:>12} {spinner}  {elapsed}  {msg}"
    }
}

/// Whether the next line is due, after this time and progress since the last one.
fn is_due(since: Duration, progress: f64) -> bool {
    since >= LONGEST || (since >= SHORTEST && progress >= STEP)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Short stages write nothing; long ones write ten lines, or one every five minutes.
    #[test]
    fn logs_get_few_lines() {
        assert!(!is_due(Duration::from_secs(1), 0.9));
        assert!(is_due(Duration::from_secs(11), 0.1));
        assert!(!is_due(Duration::from_secs(200), 0.05));
        assert!(is_due(Duration::from_secs(301), 0.0));
    }

    /// The bar ends full.
    #[test]
    fn a_complete_bar_is_full() {
        let meter = Meter::new(Display::Bar);
        meter.stage("running", 0.2);
        assert_eq!(meter.bar.position(), 200);
        meter.complete();
        meter.finish();
        assert!(meter.bar.is_finished() && meter.bar.position() == 1000);
    }
}
