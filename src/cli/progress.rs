//! A progress bar for work that takes over a second, on a terminal only; a spinner while nobody tells how
//! much of it is done.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// How long work goes on before a bar is shown.
const PATIENCE: Duration = Duration::from_secs(1);
const STEPS: u64 = 1000;

/// The bar; it goes away when dropped.
pub struct Progress {
    bar: ProgressBar,
    over: Arc<AtomicBool>,
    /// Whether the phase at hand has told how much of it is done.
    counted: AtomicBool,
}

const SPINNER: &str = "{spinner} {msg} {elapsed}";
const BAR: &str = "{spinner} {msg} {wide_bar} {percent:>3} % {elapsed}";

impl Progress {
    /// A bar that shows itself after a second, or never.
    pub fn new(quiet: bool) -> Self {
        let bar = ProgressBar::with_draw_target(Some(STEPS), ProgressDrawTarget::hidden());
        let over = Arc::new(AtomicBool::new(quiet));
        if !quiet {
            let (bar, over) = (bar.clone(), over.clone());
            std::thread::spawn(move || {
                std::thread::sleep(PATIENCE);
                if !over.load(Ordering::SeqCst) {
                    // Hidden by itself where standard error is no terminal.
                    bar.set_draw_target(ProgressDrawTarget::stderr());
                    bar.enable_steady_tick(Duration::from_millis(100));
                }
            });
        }
        let progress = Self { bar, over, counted: AtomicBool::new(false) };
        progress.look(SPINNER);
        progress
    }

    fn look(&self, template: &str) {
        if let Ok(style) = ProgressStyle::with_template(template) {
            self.bar.set_style(style);
        }
    }

    /// Says what is being done now.
    pub fn phase(&self, name: &'static str) {
        self.counted.store(false, Ordering::SeqCst);
        self.look(SPINNER);
        self.bar.set_message(name);
        self.bar.set_position(0);
    }

    /// How much of it is done, from 0 to 1.
    pub fn set(&self, part: f64) {
        if !self.counted.swap(true, Ordering::SeqCst) {
            self.look(BAR);
        }
        self.bar.set_position((part * STEPS as f64) as u64);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.over.store(true, Ordering::SeqCst);
        self.bar.finish_and_clear();
    }
}
