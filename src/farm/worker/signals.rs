//! What signals ask of a worker.
//!
//! ```text
//! SIGTERM, SIGINT   write a checkpoint and stop
//! SIGUSR1           write a checkpoint and go on
//! SIGUSR2           time is nearly up: write a checkpoint and stop; who asked for the warning sees to the rest
//! ```

use crate::error::{Error, Result};
use signal_hook::consts::{SIGINT, SIGTERM, SIGUSR1, SIGUSR2};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A flag for each wish.
#[derive(Debug, Default)]
pub(super) struct Signals {
    stop: Arc<AtomicBool>,
    save: Arc<AtomicBool>,
    time_up: Arc<AtomicBool>,
}

impl Signals {
    /// Catches the signals from now on.
    pub fn catch() -> Result<Self> {
        let signals = Signals::default();
        let wishes =
            [(SIGTERM, &signals.stop), (SIGINT, &signals.stop), (SIGUSR1, &signals.save), (SIGUSR2, &signals.time_up)];
        for (signal, flag) in wishes {
            signal_hook::flag::register(signal, Arc::clone(flag))
                .map_err(|e| Error::Failed(format!("cannot catch signal {signal}: {e}")))?;
        }
        Ok(signals)
    }

    /// As if SIGTERM had come.
    pub fn stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }

    /// True once the worker is to stop.
    pub fn asks_to_end(&self) -> bool {
        self.stop.load(Ordering::Relaxed) || self.time_up()
    }

    /// True once the time is nearly up.
    pub fn time_up(&self) -> bool {
        self.time_up.load(Ordering::Relaxed)
    }

    /// True when a checkpoint was asked for since the last call.
    pub fn asks_to_save(&self) -> bool {
        self.save.swap(false, Ordering::Relaxed)
    }
}
