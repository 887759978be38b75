//! The CPU executor against a device, where there is one.

mod device;
mod random;
mod support;

use device::Gpu;
use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use random::print::{ARGUMENTS, OUT_WORDS, kernel};
use random::{Floats, Generator, compare};
use support::run_buffers;

fn runner(cases: u32) -> TestRunner {
    TestRunner::new(ProptestConfig { cases, failure_persistence: None, max_shrink_iters: 200, ..Default::default() })
}

#[test]
fn random_programs_give_the_same_bits() {
    let Some(gpu) = Gpu::open(wgpu::Features::empty()) else { return };
    let numbers = [0, 6, 0, 0];
    let run = |(bytes, argument): (Vec<u8>, usize)| {
        let program = Generator::program(&bytes, Floats::Exact);
        let (argument, value) = ARGUMENTS[argument];
        let source = kernel(&program, argument, 64);
        let out = gpu.run(&source, 1, 64 * OUT_WORDS, &numbers);
        compare(&program, &out, value)
            .map_err(|difference| TestCaseError::fail(format!("device: {difference}\n{source}")))?;
        let out = run_buffers(&source, [1, 1, 1], &[vec![0; 64 * OUT_WORDS], numbers.to_vec()]).remove(0);
        compare(&program, &out, value).map_err(|difference| TestCaseError::fail(format!("CPU: {difference}\n{source}")))
    };
    let strategy = (proptest::collection::vec(any::<u8>(), 20..400), 0..ARGUMENTS.len());
    runner(60).run(&strategy, run).unwrap();
}

/// Four words for an invocation: of all kinds, extremes among them.
fn words() -> impl Strategy<Value = Vec<u32>> {
    let integer = prop_oneof![
        any::<u32>(),
        (0u32..40),
        proptest::sample::select(vec![0x7fff_ffff, 0x8000_0000, 0x8000_0001, 0xffff_ffff, 0xffff_fffe]),
    ];
    proptest::collection::vec(integer, 4 * 256)
}

fn float_words() -> impl Strategy<Value = Vec<u32>> {
    let special =
        vec![0.0, -0.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN, 1e-40, -1e-42, 1.0, 0.5];
    let float = prop_oneof![
        1 => any::<u32>(),
        2 => (-20.0f32..20.0).prop_map(f32::to_bits),
        2 => (0.01f32..3.0).prop_map(f32::to_bits),
        1 => proptest::sample::select(special).prop_map(f32::to_bits),
    ];
    proptest::collection::vec(float, 4 * 256)
}

/// A kernel with one expression of `a`, `b`, `c` and `d` a result.
fn kernel_of(expressions: &[&str], ty: &str) -> String {
    let count = expressions.len();
    let lines = expressions
        .iter()
        .enumerate()
        .map(|(index, expression)| format!("out[id.x * {count}u + {index}u] = bitcast<u32>({expression});\n"));
    format!(
        "@group(0) @binding(0) var<storage, read_write> out: array<u32>;
        @group(0) @binding(1) var<storage, read> numbers: array<vec4<u32>>;
        @compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3<u32>) {{
            let n = bitcast<vec4<{ty}>>(numbers[id.x]);
            let a = n.x; let b = n.y; let c = n.z; let d = n.w;
            {}
        }}",
        lines.collect::<String>()
    )
}

/// Runs on both; calls `compare` with index of the expression, the four inputs, and the results of CPU and device.
fn run_both(
    gpu: &Gpu,
    expressions: &[&str],
    ty: &str,
    inputs: &[u32],
    compare: impl Fn(usize, [u32; 4], u32, u32) -> bool,
) -> Result<(), TestCaseError> {
    let source = kernel_of(expressions, ty);
    let (invocations, count) = (inputs.len() / 4, expressions.len());
    let device = gpu.run(&source, (invocations / 64) as u32, invocations * count, inputs);
    let buffers = [vec![0; invocations * count], inputs.to_vec()];
    let cpu = run_buffers(&source, [(invocations / 64) as u32, 1, 1], &buffers).remove(0);
    for (at, (&cpu, &device)) in cpu.iter().zip(&device).enumerate() {
        let input = [0, 1, 2, 3].map(|index| inputs[at / count * 4 + index]);
        let floats = [input[0], input[1], input[2], cpu, device].map(f32::from_bits);
        prop_assert!(
            compare(at % count, input, cpu, device),
            "{} for {input:x?} ({:?}): CPU {cpu:#x} ({:?}), device {device:#x} ({:?})",
            expressions[at % count],
            &floats[..3],
            floats[3],
            floats[4]
        );
    }
    Ok(())
}

#[test]
fn integer_functions_give_the_same_bits() {
    let Some(gpu) = Gpu::open(wgpu::Features::empty()) else { return };
    let common = [
        "a + b * c - d",
        "a / b",
        "a % b",
        "a & (b | ~c) ^ d",
        "a << (bitcast<u32>(b) & 31u)",
        "abs(a) + b",
        "a >> (bitcast<u32>(b) & 31u)",
        "min(a, b) + max(c, d)",
        "clamp(a, min(b, c), max(b, c))",
        "select(a, b, c < d)",
        "countOneBits(a)",
        "countLeadingZeros(a)",
        "countTrailingZeros(a)",
        "reverseBits(a)",
        "firstLeadingBit(a)",
        "firstTrailingBit(a)",
        "dot(vec3(a, b, c), vec3(d, c, a))",
        "u32(a < b) + u32(a >= c) * 2u + u32(a == d) * 4u",
        "extractBits(a, bitcast<u32>(b) % 40u, bitcast<u32>(c) % 40u)",
        "insertBits(a, d, bitcast<u32>(b) % 40u, bitcast<u32>(c) % 40u)",
        "f32(a)",
    ];
    let of_words = [
        "pack4xU8(vec4(a, b, c, d))",
        "pack4xU8Clamp(vec4(a, b, c, d))",
        "unpack4xU8(a).z",
        "unpack4xI8(a).w",
        "dot4U8Packed(a, b)",
        "dot4I8Packed(a, b)",
        "u32(bool(a) != bool(b))",
    ];
    let unsigned: Vec<&str> = common.iter().copied().chain(of_words).collect();
    let signed: Vec<&str> = common.iter().copied().chain(["-a", "sign(a)"]).collect();
    runner(6)
        .run(&words(), |inputs| {
            run_both(&gpu, &unsigned, "u32", &inputs, |_, _, cpu, device| cpu == device)?;
            run_both(&gpu, &signed, "i32", &inputs, |_, _, cpu, device| cpu == device)
        })
        .unwrap();
}

/// Equal but for what WGSL leaves open: denormals may be taken for zero, infinities and NaN may not be kept.
fn equal_floats(input: [u32; 4], cpu: u32, device: u32) -> bool {
    let plain = |bits: u32| f32::from_bits(bits).is_normal() || f32::from_bits(bits) == 0.0;
    let (a, b) = (f32::from_bits(cpu), f32::from_bits(device));
    cpu == device || a == b || !input.into_iter().chain([cpu]).all(plain)
}

#[test]
fn exact_float_functions_give_the_same_bits() {
    let Some(gpu) = Gpu::open(wgpu::Features::empty()) else { return };
    let expressions = [
        "a + b",
        "a - b",
        "a * b",
        "-a",
        "abs(a)",
        "floor(a)",
        "ceil(a)",
        "trunc(a)",
        "round(a)",
        "min(a, b)",
        "max(a, b)",
        "clamp(a, -1.5, 2.0)",
        "saturate(a)",
        "sign(a)",
        "step(a, b)",
        "select(a, b, c < d)",
        "u32(a < b) + 2u * u32(a <= c) + 4u * u32(a == d)",
        "i32(clamp(a, -1e9, 1e9))",
        "u32(clamp(a, 0.0, 1e9))",
        "ldexp(a, i32(clamp(b, -9.0, 9.0)))",
    ];
    let compare = |index: usize, input: [u32; 4], cpu: u32, device: u32| {
        let is_integer = expressions[index].starts_with("u32") || expressions[index].starts_with("i32");
        let finite = input.iter().all(|bits| f32::from_bits(*bits).is_normal());
        if is_integer { cpu == device || !finite } else { equal_floats(input, cpu, device) }
    };
    runner(6).run(&float_words(), |inputs| run_both(&gpu, &expressions, "f32", &inputs, compare)).unwrap();
}

#[test]
fn float_functions_agree_within_what_wgsl_allows() {
    let Some(gpu) = Gpu::open(wgpu::Features::empty()) else { return };
    // Expression, inputs it is defined for, and the error of each side: units in the last place or absolute.
    type Function = (&'static str, fn(f32, f32) -> bool, fn(f32) -> f32, f32);
    let functions: [Function; 21] = [
        ("a / b", |_, b| b.abs() > 1e-30 && b.abs() < 1e30, |_| 2.5, 0.0),
        ("sqrt(abs(a))", |_, _| true, |_| 4.5, 0.0),
        ("inverseSqrt(abs(a))", |_, _| true, |_| 2.0, 0.0),
        ("exp(a)", |a, _| a.abs() < 80.0, |a| 3.0 + 2.0 * a.abs(), 0.0),
        ("exp2(a)", |a, _| a.abs() < 120.0, |a| 3.0 + 2.0 * a.abs(), 0.0),
        ("log(abs(a))", |_, _| true, |_| 3.0, 1.0 / 2_097_152.0),
        ("log2(abs(a))", |_, _| true, |_| 3.0, 1.0 / 2_097_152.0),
        ("sin(a)", |a, _| a.abs() < std::f32::consts::PI, |_| 0.0, 1.0 / 2048.0),
        ("cos(a)", |a, _| a.abs() < std::f32::consts::PI, |_| 0.0, 1.0 / 2048.0),
        ("tan(a)", |a, _| a.abs() < 1.2, |_| 0.0, 1.0 / 128.0),
        ("asin(clamp(a, -1.0, 1.0))", |_, _| true, |_| 4096.0, 6.81e-5),
        ("acos(clamp(a, -1.0, 1.0))", |_, _| true, |_| 4096.0, 6.81e-5),
        ("atan(a)", |_, _| true, |_| 4096.0, 0.0),
        ("atan2(a, b)", |_, b| b.abs() > 1e-30 && b.abs() < 1e30, |_| 4096.0, 0.0),
        ("tanh(a)", |a, _| a.abs() < 10.0, |_| 64.0, 1e-4),
        ("sinh(clamp(a, -5.0, 5.0))", |_, _| true, |_| 64.0, 1e-4),
        ("pow(abs(a), clamp(b, -2.0, 2.0))", |a, _| a.abs() > 1e-10 && a.abs() < 1e10, |_| 512.0, 0.0),
        ("a % b", |a, b| b.abs() > 0.1 && a.abs() < 20.0 && b.abs() < 20.0, |_| 4096.0, 21.0),
        ("fract(a)", |a, _| a.abs() < 1e6, |_| 1.0, 1e-7),
        ("mix(a, b, 0.25)", |a, b| a.abs() < 1e9 && b.abs() < 1e9, |_| 1e6, 1e-3),
        ("smoothstep(-1.0, 2.0, a)", |_, _| true, |_| 64.0, 1e-5),
    ];
    let expressions: Vec<&str> = functions.iter().map(|function| function.0).collect();
    let compare = |index: usize, input: [u32; 4], cpu: u32, device: u32| {
        let (_, accepts, ulp, absolute) = functions[index];
        let [a, b, cpu, device] = [input[0], input[1], cpu, device].map(f32::from_bits);
        if !a.is_normal() || !b.is_normal() || !accepts(a, b) || !cpu.is_normal() {
            return true;
        }
        let unit = cpu.abs().next_up() - cpu.abs();
        (cpu - device).abs() <= (2.0 * ulp(a) * unit).max(2.0 * absolute)
    };
    runner(6).run(&float_words(), |inputs| run_both(&gpu, &expressions, "f32", &inputs, compare)).unwrap();
}

#[test]
fn packing_gives_the_same_bits() {
    let Some(gpu) = Gpu::open(wgpu::Features::empty()) else { return };
    let floats = [
        "pack4x8unorm(vec4(a, b, c, d))",
        "pack4x8snorm(vec4(a, b, c, d))",
        "pack2x16unorm(vec2(a, b))",
        "pack2x16snorm(vec2(a, b))",
    ];
    // Halfway cases may go either way, which changes each part by one at most.
    let close = |width: u32| {
        move |cpu: u32, device: u32| {
            let mask = u32::MAX >> (32 - width);
            (0..32 / width).all(|part| {
                let difference = (cpu >> (part * width)).wrapping_sub(device >> (part * width)) & mask;
                difference <= 1 || difference == mask
            })
        }
    };
    let words = [
        "unpack4x8unorm(a).y",
        "unpack4x8snorm(a).z",
        "unpack2x16unorm(a).y",
        "unpack2x16snorm(a).x",
        "unpack2x16float(a).x",
    ];
    let compare = |index: usize, input: [u32; 4], cpu: u32, device: u32| {
        let finite = input.iter().all(|bits| f32::from_bits(*bits).is_finite());
        !finite || if index < 2 { close(8)(cpu, device) } else { close(16)(cpu, device) }
    };
    runner(6).run(&float_words(), |inputs| run_both(&gpu, &floats, "f32", &inputs, compare)).unwrap();
    let compare = |index: usize, _: [u32; 4], cpu: u32, device: u32| {
        let (a, b) = (f32::from_bits(cpu), f32::from_bits(device));
        let denormal = |x: f32| x.is_subnormal() || x == 0.0 || (index == 4 && x.abs() < 6.2e-5);
        a == b
            || (a - b).abs() <= 3.0 * f32::EPSILON
            || (a.is_nan() && b.is_nan())
            || !a.is_finite()
            || (denormal(a) && denormal(b))
    };
    runner(6).run(&self::words(), |inputs| run_both(&gpu, &words, "u32", &inputs, compare)).unwrap();
}
