//! The time limit where a driver does not come back: some compile, or run a submission, inside a call.
//!
//! `Gpu::wait` has a time limit of its own, but a call into the driver cannot be interrupted. The program
//! holds no half-written file while the GPU works, so it may end at any moment.

use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::time::Duration;

/// What may be wrong with an extraction that does not end.
pub const EXTRACTING: &str = "the field may loop without end, or the grid is too fine for this adapter; raise \
                              --time-limit or coarsen the grid";
/// And with drawing.
pub const DRAWING: &str =
    "the mesh or the picture is too large for this adapter; raise --time-limit or give a smaller --size";

/// Ends the process when the GPU was not heard of for the time limit; stands down when dropped. It is for
/// GPU work alone: encoding and writing take the time that they take.
pub struct Watchdog(Sender<()>);

impl Watchdog {
    /// Watches from now on; `remedy` is what to say in the end.
    pub fn new(seconds: u64, remedy: &'static str) -> Self {
        let (alive, heard) = channel();
        std::thread::spawn(move || {
            loop {
                match heard.recv_timeout(Duration::from_secs(seconds)) {
                    Ok(()) => {}
                    Err(RecvTimeoutError::Disconnected) => return,
                    Err(RecvTimeoutError::Timeout) => {
                        super::tell(format_args!(
                            "the GPU did not finish a piece of work within {seconds} s: {remedy}"
                        ));
                        std::process::exit(1);
                    }
                }
            }
        });
        Self(alive)
    }

    /// The GPU was heard of: the time starts anew.
    pub fn alive(&self) {
        // The thread outlives every sender, so there is nobody to tell of a failure.
        let _ = self.0.send(());
    }
}
