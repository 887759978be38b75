//! Runs limpid on every backend there is and compares everything that it leaves in memory.
//!
//! A [`Case`] is settings and a sequence of frames as plain data. Every [`Executor`] turns it into a [`Snapshot`]
//! of all resources after each frame; [`Agreement`] says how far two snapshots are apart.

mod agreement;
mod case;
pub mod executor;
pub mod eye;
mod snapshot;
pub mod strategy;

pub use agreement::{Agreement, Table, half_steps};
pub use case::{Case, Change, Image, Images, Pixel, Step, TexelFormat, half_bits};
pub use executor::{Executor, executors, fastest};
pub use snapshot::Snapshot;

use std::cell::RefCell;

use proptest::strategy::Strategy;
use proptest::test_runner::{Config, RngAlgorithm, TestCaseError, TestRng, TestRunner};

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

/// A runner for random cases, and how many: the same ones in every run, so that a gate does not depend on chance,
/// unless `PROPTEST_CASES` asks for so many new ones. Failures of those are kept beside `source_file`.
pub fn runner(source_file: &'static str, cases: u32) -> (TestRunner, u32) {
    let asked = std::env::var("PROPTEST_CASES").ok().and_then(|cases| cases.parse().ok());
    let cases_to_run = asked.unwrap_or(cases);
    let config =
        Config { source_file: Some(source_file), cases: cases_to_run, max_shrink_iters: 400, ..Config::default() };
    let runner = match asked {
        Some(_) => TestRunner::new(config),
        None => TestRunner::new_with_rng(config, TestRng::deterministic_rng(RngAlgorithm::ChaCha)),
    };
    (runner, cases_to_run)
}

/// Runs a property of the output on many values with one executor, the fastest there is.
///
/// # Panics
///
/// With the smallest value found for which the property does not hold.
pub fn for_all<S: Strategy>(
    source_file: &'static str,
    cases: u32,
    strategy: S,
    property: impl Fn(&mut dyn Executor, S::Value) -> Result<(), TestCaseError>,
) {
    let executor = RefCell::new(fastest());
    let (mut runner, _) = runner(source_file, cases);
    let result = runner.run(&strategy, |value| property(executor.borrow_mut().as_mut(), value));
    if let Err(error) = result {
        panic!("{error}");
    }
}
