//! What is known of a device, whoever works on it: whether it is lost, and what was made on it.

use super::GpuError;
use std::hash::{BuildHasher, BuildHasherDefault, DefaultHasher};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError, Weak};

/// What all [`super::Gpu`]s of a device share: a device has one callback, which the last of them sets.
#[derive(Debug, Default)]
pub(super) struct State {
    /// Tells devices of one instance apart; those of two may have the same.
    device: u64,
    lost: AtomicBool,
    reason: Mutex<String>,
    pub made: AtomicU64,
    /// Whether the callback that tells this was dropped.
    is_deaf: Mutex<Arc<AtomicBool>>,
}

/// Those that are in use.
static STATES: Mutex<Vec<Weak<State>>> = Mutex::new(Vec::new());

/// Lies in a device's callback. Setting another drops it, which shows whose callback it was.
struct Ear {
    state: Arc<OnceLock<Arc<State>>>,
    is_gone: Arc<AtomicBool>,
}

impl Drop for Ear {
    fn drop(&mut self) {
        self.is_gone.store(true, Ordering::SeqCst);
    }
}

impl State {
    /// That of `device`, whose callback is set.
    pub fn of(device: &wgpu::Device) -> Arc<Self> {
        let mut states = STATES.lock().unwrap_or_else(PoisonError::into_inner);
        states.retain(|state| state.strong_count() > 0);
        let number = BuildHasherDefault::<DefaultHasher>::new().hash_one(device);
        let known = states.iter().filter_map(Weak::upgrade);
        let known: Vec<_> = known.filter(|state| state.device == number && !state.is_deaf()).collect();
        let (place, is_gone) = (Arc::new(OnceLock::new()), Arc::default());
        let ear = Ear { state: Arc::clone(&place), is_gone: Arc::clone(&is_gone) };
        device.set_device_lost_callback(move |reason, message| {
            if let Some(state) = ear.state.get() {
                state.lose(format!("{reason:?} {message}").trim_end().into());
            }
        });
        let state = known.into_iter().find(|state| state.is_deaf()).unwrap_or_else(|| {
            let state = Arc::new(Self { device: number, ..Self::default() });
            states.push(Arc::downgrade(&state));
            state
        });
        *state.is_deaf.lock().unwrap_or_else(PoisonError::into_inner) = is_gone;
        let _ = place.set(Arc::clone(&state));
        state
    }

    fn is_deaf(&self) -> bool {
        self.is_deaf.lock().unwrap_or_else(PoisonError::into_inner).load(Ordering::SeqCst)
    }

    pub fn note(&self, reason: String) {
        *self.reason.lock().unwrap_or_else(PoisonError::into_inner) = reason;
    }

    pub fn lose(&self, reason: String) {
        self.note(reason);
        self.lost.store(true, Ordering::SeqCst);
    }

    pub fn check(&self) -> Result<(), GpuError> {
        if !self.lost.load(Ordering::SeqCst) {
            return Ok(());
        }
        Err(GpuError::Lost(self.reason.lock().unwrap_or_else(PoisonError::into_inner).clone()))
    }
}
