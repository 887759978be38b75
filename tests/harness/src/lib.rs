//! Runs limpid on every backend there is and compares everything that it leaves in memory.
//!
//! A [`Case`] is settings and a sequence of frames as plain data. Every [`Executor`] turns it into a [`Snapshot`]
//! of all resources after each frame; [`Agreement`] says how far two snapshots are apart.

mod agreement;
mod case;
pub mod executor;
mod snapshot;
pub mod strategy;

pub use agreement::{Agreement, Table, half_steps};
pub use case::{Case, Change, Image, Images, Pixel, Step, TexelFormat, half_bits};
pub use executor::{Executor, executors, fastest};
pub use snapshot::Snapshot;

/// Says on standard error that a test does not run, past the test harness, which keeps to itself what a passing
/// test prints. With `LIMPID_REQUIRE_DEVICE` set it fails instead.
///
/// # Panics
///
/// When the variable is set.
pub fn skip(reason: &str) {
    use std::io::Write;
    assert!(std::env::var_os("LIMPID_REQUIRE_DEVICE").is_none(), "{reason}");
    let _ = writeln!(std::io::stderr(), "SKIPPED: {reason}");
}
