//! Half floats as values (`enable f16`): arithmetic rounded once from single precision, and their layout in memory.

mod support;

use half::f16;
use proptest::prelude::*;
use support::{UNTOUCHED, check, run_buffers};

/// Two halves in a word.
fn pack(low: u16, high: u16) -> u32 {
    u32::from(low) | u32::from(high) << 16
}

fn same(actual: f16, expected: f16) -> bool {
    actual.to_bits() == expected.to_bits() || (actual.is_nan() && expected.is_nan())
}

/// What expressions of the halves `a`, `b` and `c` give for each triple, from storage and from a constant buffer.
fn evaluate(expressions: &[&str], triples: &[[u16; 3]]) -> Vec<Vec<f16>> {
    let count = triples.len();
    let words: Vec<u32> = triples.iter().flat_map(|[a, b, c]| [pack(*a, *b), pack(*c, 0)]).collect();
    let lines: String = (0..)
        .zip(expressions)
        .map(|(i, expression)| format!("out[id.x * {}u + {i}u] = {expression};\n", expressions.len()))
        .collect();
    let source = format!(
        "enable f16;
        @group(0) @binding(0) var<storage, read_write> out: array<f16>;
        @group(0) @binding(1) var<storage, read> numbers: array<vec4<f16>>;
        @compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3<u32>) {{
            if id.x >= {count}u {{ return; }}
            let n = numbers[id.x];
            let a = n.x; let b = n.y; let c = n.z;
            {lines}
        }}"
    );
    let out = vec![0; (count * expressions.len()).div_ceil(2)];
    let groups = [count.div_ceil(64) as u32, 1, 1];
    let out = run_buffers(&source, groups, &[out, words]).remove(0);
    let halves: Vec<_> = out.into_iter().flat_map(|word| [word as u16, (word >> 16) as u16]).collect();
    halves
        .chunks(expressions.len())
        .take(count)
        .map(|row| row.iter().map(|bits| f16::from_bits(*bits)).collect())
        .collect()
}

type Exact = (&'static str, fn(f64, f64, f64) -> f64);

/// Compares with double precision, rounded once.
fn check_exact(functions: &[Exact], triples: &[[u16; 3]]) {
    let expressions: Vec<_> = functions.iter().map(|(expression, _)| *expression).collect();
    for (triple, results) in triples.iter().zip(evaluate(&expressions, triples)) {
        let [a, b, c] = triple.map(|bits| f16::from_bits(bits).to_f64());
        for ((expression, function), actual) in functions.iter().zip(results) {
            let expected = f16::from_f64(function(a, b, c));
            assert!(same(actual, expected), "{expression} for {a:e}, {b:e}, {c:e}: {actual:e}, expected {expected:e}");
        }
    }
}

#[test]
fn functions_of_every_half_float() {
    let functions: [Exact; 12] = [
        ("-a", |a, _, _| -a),
        ("abs(a)", |a, _, _| a.abs()),
        ("floor(a)", |a, _, _| a.floor()),
        ("ceil(a)", |a, _, _| a.ceil()),
        ("trunc(a)", |a, _, _| a.trunc()),
        ("round(a)", |a, _, _| a.round_ties_even()),
        ("fract(a)", |a, _, _| a - a.floor()),
        ("sqrt(a)", |a, _, _| a.sqrt()),
        ("f16(f32(a))", |a, _, _| a),
        ("1.0h / a", |a, _, _| 1.0 / a),
        ("a * 0.333251953125h", |a, _, _| a * 0.333_251_953_125),
        ("select(a, 7.0h, a < 1.5h)", |a, _, _| if a < 1.5 { 7.0 } else { a }),
    ];
    check_exact(&functions, &(0..=u16::MAX).map(|bits| [bits, 0, 0]).collect::<Vec<_>>());
}

#[test]
fn functions_agree_with_double_precision_to_the_last_place() {
    let functions: [Exact; 13] = [
        ("exp(a)", |a, _, _| a.exp()),
        ("exp2(a)", |a, _, _| a.exp2()),
        ("log(a)", |a, _, _| a.ln()),
        ("log2(a)", |a, _, _| a.log2()),
        ("sin(a)", |a, _, _| a.sin()),
        ("cos(a)", |a, _, _| a.cos()),
        ("atan(a)", |a, _, _| a.atan()),
        ("tanh(a)", |a, _, _| a.tanh()),
        ("inverseSqrt(a)", |a, _, _| 1.0 / a.sqrt()),
        ("dot(vec3(a, 2.0h, a), vec3(a, a, 0.5h))", |a, _, _| a * a + 2.0 * a + 0.5 * a),
        ("length(vec2(a, 3.0h))", |a, _, _| a.hypot(3.0)),
        ("mix(a, 2.0h, 0.25h)", |a, _, _| a * 0.75 + 0.5),
        ("(mat2x2(a, 1.0h, 2.0h, a) * vec2(3.0h, 0.5h)).y", |a, _, _| 3.0 + 0.5 * a),
    ];
    let expressions: Vec<_> = functions.iter().map(|(expression, _)| *expression).collect();
    let triples: Vec<_> = (0..=u16::MAX).map(|bits| [bits, 0, 0]).collect();
    for (triple, results) in triples.iter().zip(evaluate(&expressions, &triples)) {
        let a = f16::from_bits(triple[0]).to_f64();
        for ((expression, function), actual) in functions.iter().zip(results) {
            let expected = f16::from_f64(function(a, 0.0, 0.0));
            let step = i32::from(actual.to_bits()) - i32::from(expected.to_bits());
            assert!(
                same(actual, expected) || actual == expected || step.abs() == 1,
                "{expression} for {a:e}: {actual:e}, expected {expected:e}"
            );
        }
    }
}

/// Bits of a half, special ones among them.
fn half_bits() -> impl Strategy<Value = u16> {
    let special = vec![0, 0x8000, 1, 0x8001, 0x03ff, 0x0400, 0x3c00, 0x7bff, 0xfbff, 0x7c00, 0xfc00, 0x7e00];
    // Of similar size, so that sums are inexact.
    prop_oneof![3 => any::<u16>(), 3 => 0x3800u16..0x4800, 1 => proptest::sample::select(special)]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn arithmetic_is_that_of_ieee_754(
        triples in proptest::collection::vec([half_bits(), half_bits(), half_bits()], 2000),
    ) {
        check_exact(
            &[
                ("a + b", |a, b, _| a + b),
                ("a - b", |a, b, _| a - b),
                ("a * b", |a, b, _| a * b),
                ("a / b", |a, b, _| a / b),
                ("(vec3(a, b, c) * vec3(c, a, b)).z", |_, b, c| c * b),
                ("(c / vec2(a, b)).x", |a, _, c| c / a),
                ("f16(a < b) + f16(a <= c) * 2.0h + f16(a == b) * 4.0h", |a, b, c| {
                    f64::from(u8::from(a < b)) + f64::from(u8::from(a <= c)) * 2.0 + f64::from(u8::from(a == b)) * 4.0
                }),
                // The sum makes zeros equal.
                ("min(a, b) + 0.0h", |a, b, _| a.min(b) + 0.0),
                ("max(a, b) + 0.0h", |a, b, _| a.max(b) + 0.0),
                ("step(a, b)", |a, b, _| f64::from(u8::from(a <= b))),
                // Compared with what the crate `half` computes.
                ("a * b + c", |a, b, c| (f16::from_f64(a) * f16::from_f64(b) + f16::from_f64(c)).to_f64()),
                ("-(a - c) / b", |a, b, c| (-(f16::from_f64(a) - f16::from_f64(c)) / f16::from_f64(b)).to_f64()),
            ],
            &triples,
        );
    }

    #[test]
    fn conversions(numbers in proptest::collection::vec(any::<(u32, i32, f32, u16)>(), 200)) {
        let source = "enable f16;
            struct Input { u: u32, i: i32, f: f32, h: f16 }
            @group(0) @binding(0) var<storage, read_write> halves: array<vec4<f16>>;
            @group(0) @binding(1) var<storage, read> input: array<Input>;
            @group(0) @binding(2) var<storage, read_write> back: array<vec4<u32>>;
            @compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
                if id.x >= arrayLength(&input) { return; }
                let n = input[id.x];
                halves[id.x] = vec4(f16(n.u), f16(n.i), f16(n.f), f16(n.u % 2u == 0u));
                back[id.x] = vec4(u32(n.h), u32(i32(n.h)), bitcast<u32>(f32(n.h)), u32(bool(n.h)));
            }";
        let words: Vec<u32> =
            numbers.iter().flat_map(|(u, i, f, h)| [*u, i.cast_unsigned(), f.to_bits(), u32::from(*h)]).collect();
        let count = numbers.len();
        let out = run_buffers(source, [4, 1, 1], &[vec![0; 2 * count], words, vec![0; 4 * count]]);
        for (i, &(u, int, f, h)) in numbers.iter().enumerate() {
            let half = |at: usize| f16::from_bits((out[0][2 * i + at / 2] >> (16 * (at % 2))) as u16);
            let even = f64::from(u8::from(u.is_multiple_of(2)));
            let expected = [f64::from(u), f64::from(int), f64::from(f), even].map(f16::from_f64);
            (0..4).for_each(|at| assert!(same(half(at), expected[at]), "{} of {u}, {int}, {f}: {}", at, half(at)));
            let h = f16::from_bits(h).to_f32();
            // The nearest floats to the limits of integers.
            let largest = |limit: f32| if h > limit { limit } else { h };
            let (unsigned, signed) = (largest(4_294_967_040.0) as u32, largest(2_147_483_520.0) as i32);
            let is_same = |actual: u32| actual == h.to_bits() || (f32::from_bits(actual).is_nan() && h.is_nan());
            prop_assert_eq!(&out[2][4 * i..4 * i + 2], &[unsigned, signed.cast_unsigned()], "{}", h);
            prop_assert!(is_same(out[2][4 * i + 2]), "{}", h);
            prop_assert_eq!(out[2][4 * i + 3], u32::from(h != 0.0), "{}", h);
        }
    }
}

#[test]
fn structs_with_halves_have_the_layout_of_wgsl() {
    let source = "enable f16;
        struct Item { a: f16, v: vec3<f16>, b: f16, w: vec2<f16>, f: f32, m: mat2x3<f16>, list: array<f16, 3>, n: u32 }
        @group(0) @binding(0) var<storage, read_write> items: array<Item>;
        @compute @workgroup_size(4) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
            let i = id.x;
            if i >= arrayLength(&items) { return; }
            let old = items[i];
            items[i].a = f16(i) + 1.0h;
            items[i].v = vec3(10.0h, 11.0h, 12.0h) + old.a;
            items[i].b = old.list[2];
            items[i].w.y = 20.0h;
            items[i].f = f32(old.w.x);
            items[i].m[1] = vec3(1.0h, 2.0h, f16(i));
            items[i].list[i % 3u] = 30.0h;
            items[i].n += 1u;
        }";
    // In halves: a 0, v 4..7, b 7, w 8..10, f 10, m 12..20 with columns of 4, list 20..23, n 24, size 28.
    let half = |number: f32| f16::from_f32(number).to_bits();
    let mut before = vec![0xabcd_u16; 3 * 28 + 6];
    for i in 0..3 {
        before[28 * i] = half(100.0 * i as f32);
        before[28 * i + 22] = half(77.0);
        before[28 * i + 8] = half(0.25);
        (before[28 * i + 24], before[28 * i + 25]) = (0xffff, 0);
    }
    let mut expected = before.clone();
    for i in 0..3 {
        let item = &mut expected[28 * i..][..28];
        let n = i as f32;
        (item[4], item[5], item[6]) = (half(10.0 + 100.0 * n), half(11.0 + 100.0 * n), half(12.0 + 100.0 * n));
        item[0] = half(n + 1.0);
        (item[7], item[9]) = (half(77.0), half(20.0));
        (item[10], item[11]) = (0, (0.25f32.to_bits() >> 16) as u16);
        (item[16], item[17], item[18]) = (half(1.0), half(2.0), half(n));
        item[20 + i] = half(30.0);
        (item[24], item[25]) = (0, 1);
    }
    let words = |halves: &[u16]| halves.chunks(2).map(|pair| pack(pair[0], pair[1])).collect::<Vec<_>>();
    assert_eq!(run_buffers(source, [1, 1, 1], &[words(&before)])[0], words(&expected));
}

#[test]
fn neighbouring_halves_are_written_by_different_invocations() {
    let source = "enable f16;
        @group(0) @binding(0) var<storage, read_write> list: array<f16>;
        @group(0) @binding(1) var<storage, read_write> rows: array<vec3<f16>, 50>;
        @group(0) @binding(2) var<storage, read_write> lengths: vec2<u32>;
        @compute @workgroup_size(10) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
            if id.x % 3u != 1u { list[id.x] = f16(id.x); }
            rows[id.x / 10u][id.x % 3u] = list[id.x] + 0.5h;
            if id.x == 0u { lengths = vec2(arrayLength(&list), 7u); }
        }";
    let out = run_buffers(source, [50, 1, 1], &[vec![UNTOUCHED; 250], vec![0; 100], vec![0; 2]]);
    let half = |number: usize| u32::from(f16::from_f32(number as f32).to_bits());
    for (i, word) in out[0].iter().enumerate() {
        let expected = |at: usize, old: u32| if at % 3 == 1 { old } else { half(at) };
        assert_eq!(*word, expected(2 * i, UNTOUCHED & 0xffff) | expected(2 * i + 1, UNTOUCHED >> 16) << 16, "{i}");
    }
    assert_eq!(out[2], [500, 7]);
}

#[test]
fn constant_buffers_workgroup_memory_and_variables_of_halves() {
    let source = "enable f16;
        struct Numbers { list: array<vec4<u32>, 1>, scale: f16, offset: vec2<f16>, m: mat4x2<f16> }
        @group(0) @binding(0) var<storage, read_write> out: array<f16>;
        @group(0) @binding(1) var<uniform> numbers: Numbers;
        struct Cell { h: f16, u: u32, pair: array<f16, 3> }
        var<workgroup> cells: array<Cell, 100>;
        var<private> factor: f16 = 2.0h;
        const TABLE = array<f16, 3>(0.5h, 1.5h, 2.5h);
        @compute @workgroup_size(100) fn main(@builtin(local_invocation_index) i: u32) {
            cells[i].pair[i % 3u] = f16(i) * numbers.scale;
            cells[i].u = i;
            workgroupBarrier();
            var sums = array<f16, 2>(numbers.offset.y, TABLE[i % 3u]);
            if numbers.scale > 1.0h { sums[i % 2u] += cells[99u - i].pair[(99u - i) % 3u] * factor; }
            out[i] = sums[0] + sums[1] + (numbers.m * vec4(1.0h, 0.0h, f16(cells[i].u), 0.0h)).y;
        }";
    let half = |number: f32| f16::from_f32(number).to_bits();
    // In halves: list 0..8, scale 8, offset 10..12, m 12..20.
    let mut numbers = [0u16; 24];
    (numbers[8], numbers[10], numbers[11]) = (half(3.0), half(-1.0), half(4.0));
    (12..20).for_each(|i| numbers[i] = half(i as f32 / 8.0));
    let words = numbers.chunks(2).map(|pair| pack(pair[0], pair[1])).collect::<Vec<_>>();
    let out = run_buffers(source, [1, 1, 1], &[vec![0; 50], words]).remove(0);
    for i in 0..100usize {
        let mut sums = [4.0, [0.5, 1.5, 2.5][i % 3]].map(f16::from_f32);
        sums[i % 2] += f16::from_f32((99 - i) as f32) * f16::from_f32(3.0) * f16::from_f32(2.0);
        let product = f16::from_f32(13.0 / 8.0 + i as f32 * 17.0 / 8.0);
        let expected = sums[0] + sums[1] + product;
        assert_eq!((out[i / 2] >> (16 * (i % 2))) as u16, expected.to_bits(), "{i}");
    }
}

#[test]
fn booleans_of_a_workgroup_are_apart() {
    let source = "
        @group(0) @binding(0) var<storage, read_write> out: array<u32>;
        var<workgroup> flags: array<bool, 64>;
        @compute @workgroup_size(64) fn main(@builtin(local_invocation_index) i: u32) {
            flags[i] = i % 3u == 0u;
            workgroupBarrier();
            out[i] = u32(flags[63u - i]);
        }";
    let expected = (0..64u32).map(|i| u32::from((63 - i) % 3 == 0));
    assert_eq!(support::run_output(source, [1, 1, 1], 64), expected.collect::<Vec<_>>());
}

#[test]
fn halves_in_functions_and_divergent_flow() {
    let code = "enable f16;
        struct Pair { value: f16, more: vec2<f16> }
        fn step_up(p: ptr<function, f16>, by: f16) { *p += by; }
        fn make(i: u32) -> Pair { if i % 2u == 0u { return Pair(1.5h, vec2(f16(i % 16u))); } return Pair(); }
        fn test(i: u32, u: u32) -> u32 {
            var sum = 0.0h;
            for (var k = 0u; k <= u; k++) { step_up(&sum, f16(k) + make(i + k).value); }
            let parts = modf(make(i).more.y * 0.25h);
            let power = frexp(f16(u + 1u));
            return pack2x16float(vec2(f32(sum), f32(parts.fract))) + u32(power.fract * 16.0h) + u32(parts.whole);
        }";
    let expected = |i: u32, u: u32| {
        let value = |i: u32| if i.is_multiple_of(2) { 1.5 } else { 0.0 };
        let sum: f32 = (0..=u).map(|k| k as f32 + value(i + k)).sum();
        let quarter = if i.is_multiple_of(2) { (i % 16) as f32 * 0.25 } else { 0.0 };
        let exponent = 32 - (u + 1).leading_zeros();
        let fraction = (16 * (u + 1)) >> exponent;
        let bits = |x: f32| f16::from_f32(x).to_bits();
        pack(bits(sum), bits(quarter.fract())) + fraction + quarter.trunc() as u32
    };
    check(code, expected);
}
