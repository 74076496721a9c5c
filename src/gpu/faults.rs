//! What went wrong on a device. wgpu's own answer to an error nobody caught is to panic; ours is to keep it.

use std::sync::{Arc, Mutex, PoisonError};

use crate::error::Error;

#[derive(Debug, Default)]
struct State {
    first_error: Option<Error>,
    lost: bool,
}

/// Shared between a device's callbacks and its owner.
#[derive(Clone, Debug, Default)]
pub(super) struct Faults(Arc<Mutex<State>>);

impl Faults {
    /// Sets both callbacks of a device.
    pub(super) fn listen_to(device: &wgpu::Device) -> Self {
        let faults = Self::default();
        let on_error = faults.clone();
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            log::error!("graphics device: {error}");
            on_error.record(device_error(&error.to_string()), false);
        }));
        let on_lost = faults.clone();
        device.set_device_lost_callback(move |reason, message| {
            // Dropping the last handle of a device is no fault.
            if reason != wgpu::DeviceLostReason::Destroyed {
                log::error!("graphics device lost: {message}");
            }
            on_lost.record(device_error(&format!("the device was lost ({message})")), true);
        });
        faults
    }

    pub(super) fn take(&self) -> Option<Error> {
        self.with(|state| state.first_error.take())
    }

    pub(super) fn is_lost(&self) -> bool {
        self.with(|state| state.lost)
    }

    fn record(&self, error: Error, lost: bool) {
        self.with(|state| {
            state.lost |= lost;
            // Later faults are mostly consequences of the first one.
            state.first_error.get_or_insert(error);
        });
    }

    fn with<T>(&self, act: impl FnOnce(&mut State) -> T) -> T {
        act(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

/// A fault in one sentence: drivers answer with many lines, of which the last names the cause.
pub(super) fn device_error(message: &str) -> Error {
    let lines: Vec<&str> = message
        .lines()
        .map(str::trim)
        .filter(|line| !line.is_empty())
        .collect();
    Error::failure(
        "graphics device",
        lines.join(" "),
        "close other programs that use it or update its driver, or use --backend cpu",
    )
}
