//! Half floats against a device that has them.

mod device;
mod support;

use device::Gpu;
use half::f16;
use support::run_buffers;

/// Expressions of `a`, `b`, `c`, and whether IEEE 754 defines them exactly.
const EXPRESSIONS: [(&str, bool); 16] = [
    ("a + b", true),
    ("a - b", true),
    ("a * b", true),
    ("f16(f32(a) * f32(b))", true),
    ("f16(i32(clamp(a, -9.0h, 9.0h)))", true),
    ("abs(a) + floor(b)", true),
    ("min(max(a, b), c)", true),
    ("select(a, b, a < c)", true),
    ("a / b", false),
    ("sqrt(abs(a))", false),
    ("inverseSqrt(abs(a))", false),
    ("exp2(clamp(a, -8.0h, 8.0h))", false),
    ("log2(abs(a))", false),
    ("dot(vec2(a, b), vec2(0.5h, 0.25h))", false),
    ("mix(a, 2.0h, 0.25h)", false),
    ("(mat2x2(a, 1.0h, 2.0h, 4.0h) * vec2(1.0h, 0.5h)).x", false),
];

#[test]
fn arithmetic_agrees() {
    let Some(gpu) = Gpu::open(wgpu::Features::SHADER_F16) else { return };
    let count = EXPRESSIONS.len();
    let lines: String =
        (0..).zip(EXPRESSIONS).map(|(i, (e, _))| format!("out[id.x * {count}u + {i}u] = {e};\n")).collect();
    let source = format!(
        "enable f16;
        @group(0) @binding(0) var<storage, read_write> out: array<f16>;
        @group(0) @binding(1) var<storage, read> numbers: array<vec4<f16>>;
        @compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3<u32>) {{
            let n = numbers[id.x];
            let a = n.x; let b = n.y; let c = n.z;
            {lines}
        }}"
    );
    let invocations = 64 * 64;
    // Sizes from 2^-5 to 2^5 with any sign, so that no result is denormal or infinite.
    let number = |i: u32| {
        let hash = i.wrapping_mul(0x9e37_79b1) ^ i.wrapping_mul(0x85eb_ca6b) >> 7;
        ((hash >> 3 & 0x8000) | (0x2800 + hash % 0x2800)) as u16
    };
    let input: Vec<u32> =
        (0..2 * invocations).map(|i| u32::from(number(2 * i)) | u32::from(number(2 * i + 1)) << 16).collect();
    let words = invocations as usize * count / 2;
    let device = gpu.run(&source, invocations / 64, words, &input);
    let cpu = run_buffers(&source, [invocations / 64, 1, 1], &[vec![0; words], input.clone()]).remove(0);
    let halves =
        |words: Vec<u32>| words.into_iter().flat_map(|word| [word as u16, (word >> 16) as u16]).map(f16::from_bits);
    for (at, (cpu, device)) in halves(cpu).zip(halves(device)).enumerate() {
        let (expression, is_exact) = EXPRESSIONS[at % count];
        let ulp =
            f64::from(f16::from_bits((cpu.to_bits() & 0x7fff) + 1)) - f64::from(f16::from_bits(cpu.to_bits() & 0x7fff));
        // A device may round every step of what is not exact, and flush what is denormal.
        let allowed = if is_exact { 0.0 } else { (4.0 * ulp).max(0.01) };
        let error = (f64::from(cpu) - f64::from(device)).abs();
        let denormal = cpu.to_f32().abs() < 6.2e-5 && device.to_f32() == 0.0;
        let input = &input[2 * (at / count)..][..2];
        assert!(error <= allowed || denormal, "{expression} of {input:x?}: CPU {cpu}, device {device}");
    }
}
