//! Runs snippets of WGSL, each in many surroundings, and compares with what Rust computes.

#![allow(dead_code, reason = "each test file uses a part of it")]

pub(crate) mod expression;

use std::sync::mpsc;
use std::time::Duration;

use limpid_cpu::{Binding, Buffer, CompileError, Executor};
use naga::valid::{Capabilities, ShaderStages, SubgroupOperationSet, ValidationFlags, Validator};

/// What buffers hold before a kernel runs.
pub(crate) const UNTOUCHED: u32 = 0xdead_beef;

/// Workgroup sizes: one, a part of a row of lanes, a row, rows and a part, rows.
pub(crate) const WORKGROUP_SIZES: [u32; 5] = [1, 5, 64, 100, 256];

pub(crate) fn compile(source: &str, entry_point: &str) -> Result<Executor, CompileError> {
    let module =
        naga::front::wgsl::parse_str(source).unwrap_or_else(|error| panic!("{}", error.emit_to_string(source)));
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::all());
    validator.subgroup_stages(ShaderStages::COMPUTE).subgroup_operations(SubgroupOperationSet::all());
    let info = validator.validate(&module).unwrap_or_else(|error| panic!("{}", error.emit_to_string(source)));
    Executor::new(&module, &info, entry_point)
}

pub(crate) fn executor(source: &str) -> Executor {
    compile(source, "main").unwrap_or_else(|error| panic!("{error}\n{source}"))
}

/// Ends the process, with the program, when running it takes too long: a hang would say nothing.
pub(crate) fn dispatch(executor: &Executor, groups: [u32; 3], bindings: &[Binding<'_>], program: &str) {
    let (done, watch) = mpsc::channel::<()>();
    let program = program.to_owned();
    std::thread::spawn(move || {
        if watch.recv_timeout(Duration::from_secs(20)) == Err(mpsc::RecvTimeoutError::Timeout) {
            eprintln!("does not end:\n{program}");
            std::process::abort();
        }
    });
    executor.dispatch(groups, bindings).unwrap();
    drop(done);
}

/// Runs `main` with buffers at bindings 0, 1, … of group 0, and gives what they hold then.
pub(crate) fn run_buffers(source: &str, groups: [u32; 3], buffers: &[Vec<u32>]) -> Vec<Vec<u32>> {
    let buffers: Vec<Buffer> = buffers.iter().map(|words| Buffer::new(words.iter().copied())).collect();
    let bindings: Vec<_> =
        buffers.iter().enumerate().map(|(index, buffer)| Binding::buffer(0, index as u32, buffer)).collect();
    dispatch(&executor(source), groups, &bindings, source);
    buffers.iter().map(Buffer::read).collect()
}

/// The same for one buffer of zeros, as long as `count`.
pub(crate) fn run_output(source: &str, groups: [u32; 3], count: usize) -> Vec<u32> {
    run_buffers(source, groups, &[vec![0; count]]).remove(0)
}

/// Invocations of `test` that a surrounding makes, and whether invocation `i` is among them.
struct Surrounding {
    name: &'static str,
    code: &'static str,
    runs: fn(u32) -> bool,
}

const SURROUNDINGS: [Surrounding; 5] = [
    Surrounding { name: "plain", code: "out[i] = test(i, u);", runs: |_| true },
    Surrounding { name: "masked", code: "if i % 3u != 0u { out[i] = test(i, u); }", runs: |i| i % 3 != 0 },
    Surrounding {
        name: "repeated by lanes",
        code: "for (var k = 0u; k <= i % 4u; k++) { out[i] = test(i, u); }",
        runs: |_| true,
    },
    Surrounding {
        name: "repeated by all",
        code: "for (var k = 0u; k < 3u; k++) { if k != 1u { out[i] = test(i, u); } }",
        runs: |_| true,
    },
    Surrounding {
        name: "after a return",
        code: "if i % 5u == 0u { return; } let r = test(i, u); out[i] = r;",
        runs: |i| i % 5 != 0,
    },
];

/// Checks `fn test(i: u32, u: u32) -> u32` for all invocations `i`, for `u` that is varying, uniform, and constant,
/// in several surroundings and workgroup sizes. `u` is below 8.
pub(crate) fn check(code: &str, expected: impl Fn(u32, u32) -> u32) {
    for surrounding in &SURROUNDINGS {
        for size in WORKGROUP_SIZES {
            for (kind, selector) in [("varying", "(i * 7u + 3u) % 8u"), ("uniform", "numbers.y"), ("constant", "5u")] {
                let call = surrounding.code;
                let source = format!(
                    "{code}
                    @group(0) @binding(0) var<storage, read_write> out: array<u32>;
                    @group(0) @binding(1) var<uniform> numbers: vec4<u32>;
                    @compute @workgroup_size({size})
                    fn main(@builtin(global_invocation_id) id: vec3<u32>) {{
                        let i = id.x;
                        let u = {selector};
                        {call}
                    }}"
                );
                let executor = executor(&source);
                let last = if kind == "uniform" { 8 } else { 1 };
                for uniform in 0..last {
                    let out = Buffer::new(vec![UNTOUCHED; 2 * size as usize]);
                    let numbers = Buffer::new([0, uniform, 0, 0]);
                    let bindings = [Binding::buffer(0, 0, &out), Binding::buffer(0, 1, &numbers)];
                    dispatch(&executor, [2, 1, 1], &bindings, &source);
                    for (i, actual) in (0..).zip(out.read()) {
                        let u = match kind {
                            "varying" => (i * 7 + 3) % 8,
                            "uniform" => uniform,
                            _ => 5,
                        };
                        let expected = if (surrounding.runs)(i) { expected(i, u) } else { UNTOUCHED };
                        assert_eq!(
                            actual, expected,
                            "invocation {i}, {kind} u = {u}, call {:?}, workgroup size {size}\n{code}",
                            surrounding.name
                        );
                    }
                }
            }
        }
    }
}

pub(crate) fn bits(values: &[f32]) -> Vec<u32> {
    values.iter().map(|value| value.to_bits()).collect()
}

pub(crate) fn floats(words: &[u32]) -> Vec<f32> {
    words.iter().map(|word| f32::from_bits(*word)).collect()
}
