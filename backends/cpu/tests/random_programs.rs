//! Random programs on the CPU executor against an interpreter of their own.

mod random;
mod support;

use limpid_cpu::{Binding, Buffer};
use proptest::prelude::*;
use random::print::{ARGUMENTS, OUT_WORDS, kernel};
use random::{Floats, Generator, compare};
use support::{dispatch, executor};

fn check(bytes: &[u8], floats: Floats) -> Result<(), TestCaseError> {
    let program = Generator::program(bytes, floats);
    for (argument, value) in ARGUMENTS {
        for workgroup_size in [64, 24] {
            let source = kernel(&program, argument, workgroup_size);
            let out = Buffer::zeroed(64 * OUT_WORDS);
            let numbers = Buffer::new([0, 6, 0, 0]);
            let bindings = [Binding::buffer(0, 0, &out), Binding::buffer(0, 1, &numbers)];
            dispatch(&executor(&source), [64u32.div_ceil(workgroup_size), 1, 1], &bindings, &source);
            compare(&program, &out.read(), value)
                .map_err(|difference| TestCaseError::fail(format!("{difference}\n{source}")))?;
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: ProptestConfig::default().cases.max(400), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn programs_compute_what_an_interpreter_does(bytes in proptest::collection::vec(any::<u8>(), 20..500)) {
        check(&bytes, Floats::Ieee)?;
    }

    #[test]
    fn exact_programs_compute_what_an_interpreter_does(bytes in proptest::collection::vec(any::<u8>(), 20..500)) {
        check(&bytes, Floats::Exact)?;
    }
}
