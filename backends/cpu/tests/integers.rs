//! Integer arithmetic and functions on bits, at the edges too.

mod support;

use support::{bits, run_buffers};

const EDGES: [u32; 17] = [
    0,
    1,
    2,
    3,
    7,
    31,
    32,
    33,
    255,
    0x1234_5678,
    0x7fff_fffe,
    0x7fff_ffff,
    0x8000_0000,
    0x8000_0001,
    0xffff_ff80,
    0xffff_fffe,
    0xffff_ffff,
];

/// Checks an expression of `a` and `b` for pairs of values: varying ones, one or both the same for all invocations,
/// and constant ones. Values and result are compared as bits.
fn check_pairs(ty: &str, result: &str, expression: &str, pairs: &[[u32; 2]], expected: impl Fn(u32, u32) -> u32) {
    let count = pairs.len();
    let expected: Vec<u32> = pairs.iter().map(|&[a, b]| expected(a, b)).collect();
    let compare = |kind: &str, out: &[u32]| {
        for ((&[a, b], actual), expected) in pairs.iter().zip(out).zip(&expected) {
            let signed = actual.cast_signed();
            assert_eq!(actual, expected, "{expression} for {ty}, {kind}, a = {a:#x}, b = {b:#x} ({signed})");
        }
    };
    let words: Vec<u32> = pairs.iter().flatten().copied().collect();
    for (kind, a, b) in [
        ("varying", "pairs[id.x].x", "pairs[id.x].y"),
        ("a uniform", "pairs[group.x].x", "pairs[id.x].y"),
        ("b uniform", "pairs[id.x].x", "pairs[group.x].y"),
        ("uniform", "pairs[group.x].x", "pairs[group.x].y"),
    ] {
        let size = if kind == "varying" { 64 } else { 1 };
        let source = format!(
            "@group(0) @binding(0) var<storage, read_write> out: array<{result}>;
            @group(0) @binding(1) var<storage, read> pairs: array<vec2<{ty}>>;
            @compute @workgroup_size({size}) fn main(
                @builtin(global_invocation_id) id: vec3<u32>, @builtin(workgroup_id) group: vec3<u32>,
            ) {{
                if id.x < {count}u {{ let a = {a}; let b = {b}; out[id.x] = {expression}; }}
            }}"
        );
        let groups = [count.div_ceil(size) as u32, 1, 1];
        compare(kind, &run_buffers(&source, groups, &[vec![0; count], words.clone()])[0]);
    }
    let lines = pairs.iter().enumerate().map(|(index, [a, b])| {
        format!("{{ let a = bitcast<{ty}>({a}u); let b = bitcast<{ty}>({b}u); out[{index}] = {expression}; }}\n")
    });
    let source = format!(
        "@group(0) @binding(0) var<storage, read_write> out: array<{result}>;
        @compute @workgroup_size(1) fn main() {{ {} }}",
        lines.collect::<String>()
    );
    compare("constant", &run_buffers(&source, [1, 1, 1], &[vec![0; count]])[0]);
}

fn edge_pairs() -> Vec<[u32; 2]> {
    EDGES.iter().flat_map(|&a| EDGES.map(|b| [a, b])).collect()
}

fn check_unsigned(expression: &str, expected: impl Fn(u32, u32) -> u32) {
    check_pairs("u32", "u32", expression, &edge_pairs(), expected);
}

fn check_signed(expression: &str, expected: impl Fn(i32, i32) -> i32) {
    let expected = |a: u32, b: u32| expected(a.cast_signed(), b.cast_signed()).cast_unsigned();
    check_pairs("i32", "i32", expression, &edge_pairs(), expected);
}

#[test]
fn unsigned_arithmetic_wraps() {
    check_unsigned("a + b", u32::wrapping_add);
    check_unsigned("a - b", u32::wrapping_sub);
    check_unsigned("a * b", u32::wrapping_mul);
    check_unsigned("dot(vec3(a, b, 3u), vec3(b, a, a))", |a, b| {
        a.wrapping_mul(b).wrapping_mul(2).wrapping_add(a.wrapping_mul(3))
    });
}

#[test]
fn signed_arithmetic_wraps() {
    check_signed("a + b", i32::wrapping_add);
    check_signed("a - b", i32::wrapping_sub);
    check_signed("a * b", i32::wrapping_mul);
    check_signed("-a - b", |a, b| a.wrapping_neg().wrapping_sub(b));
    check_signed("dot(vec2(a, b), vec2(b, 7))", |a, b| a.wrapping_mul(b).wrapping_add(b.wrapping_mul(7)));
}

#[test]
fn division_by_zero_gives_the_dividend_and_no_remainder() {
    check_unsigned("a / b", |a, b| a.checked_div(b).unwrap_or(a));
    check_unsigned("a % b", |a, b| a.checked_rem(b).unwrap_or(0));
    check_signed("a / b", |a, b| if b == 0 { a } else { a.wrapping_div(b) });
    check_signed("a % b", |a, b| if b == 0 { 0 } else { a.wrapping_rem(b) });
    check_signed("(vec3(a, b, 5) / vec3(b, a, b)).y", |a, b| if a == 0 { b } else { b.wrapping_div(a) });
}

#[test]
fn bit_operations() {
    check_unsigned("(a & b) ^ ~(a | 5u)", |a, b| (a & b) ^ !(a | 5));
    check_signed("(a & b) ^ ~(a | 5)", |a, b| (a & b) ^ !(a | 5));
    check_unsigned("(vec2(a, b) & vec2(b, 15u)).y | (a ^ b)", |a, b| (b & 15) | (a ^ b));
}

#[test]
fn shifts_use_the_low_five_bits_of_the_distance() {
    check_unsigned("a << b", u32::wrapping_shl);
    check_unsigned("a >> b", u32::wrapping_shr);
    check_signed("a << bitcast<u32>(b)", |a, b| a.wrapping_shl(b.cast_unsigned()));
    check_signed("a >> bitcast<u32>(b)", |a, b| a.wrapping_shr(b.cast_unsigned()));
}

#[test]
fn comparisons_know_the_sign() {
    let code =
        "u32(a < b) + 2u * u32(a <= b) + 4u * u32(a > b) + 8u * u32(a >= b) + 16u * u32(a == b) + 32u * u32(a != b)";
    fn compared<T: Ord>(a: T, b: T) -> u32 {
        let bits = [a < b, a <= b, a > b, a >= b, a == b, a != b];
        bits.into_iter().enumerate().map(|(bit, set)| u32::from(set) << bit).sum()
    }
    check_unsigned(code, compared);
    let signed = |a: u32, b: u32| compared(a.cast_signed(), b.cast_signed());
    check_pairs("i32", "u32", code, &edge_pairs(), signed);
}

#[test]
fn minimum_maximum_clamp_sign_and_absolute_value() {
    check_unsigned("min(a, b) ^ (max(a, b) << 1u)", |a, b| a.min(b) ^ (a.max(b) << 1));
    check_signed("min(a, b) ^ (max(a, b) << 1u)", |a, b| a.min(b) ^ (a.max(b) << 1));
    check_unsigned("clamp(a, 5u, b)", |a, b| a.max(5).min(b));
    check_signed("clamp(a, -5, b)", |a, b| a.max(-5).min(b));
    check_signed("sign(a) * 3 + sign(b)", |a, b| a.signum() * 3 + b.signum());
    check_signed("abs(a) ^ b", |a, b| a.wrapping_abs() ^ b);
    check_unsigned("abs(a) ^ b", |a, b| a ^ b);
}

#[test]
fn counting_and_finding_bits() {
    check_unsigned("countOneBits(a) + 100u * countOneBits(b)", |a, b| a.count_ones() + 100 * b.count_ones());
    check_unsigned("countLeadingZeros(a) + 100u * countTrailingZeros(a)", |a, _| {
        a.leading_zeros() + 100 * a.trailing_zeros()
    });
    check_signed("countLeadingZeros(a) + 100 * countTrailingZeros(a) + 10000 * countOneBits(a)", |a, _| {
        (a.leading_zeros() + 100 * a.trailing_zeros() + 10_000 * a.count_ones()).cast_signed()
    });
    check_unsigned("reverseBits(a) ^ b", |a, b| a.reverse_bits() ^ b);
    check_signed("reverseBits(a) ^ b", |a, b| a.reverse_bits() ^ b);
    check_unsigned("firstLeadingBit(a)", |a, _| a.checked_ilog2().unwrap_or(u32::MAX));
    check_unsigned("firstTrailingBit(a)", |a, _| if a == 0 { u32::MAX } else { a.trailing_zeros() });
    check_signed("firstTrailingBit(a)", |a, _| if a == 0 { -1 } else { a.trailing_zeros().cast_signed() });
    // The highest bit that differs from the sign.
    check_signed("firstLeadingBit(a)", |a, _| {
        let differs = (a ^ (a >> 31)).cast_unsigned();
        differs.checked_ilog2().map_or(-1, u32::cast_signed)
    });
}

/// Offset and count of a bit field as WGSL bounds them.
fn field(offset: u32, count: u32) -> (u32, u32) {
    let offset = offset.min(32);
    (offset, count.min(32 - offset))
}

#[test]
fn extracting_and_inserting_bits() {
    let distances = [0, 1, 5, 8, 16, 31, 32, 33, 40, 0xffff_ffff];
    let pairs: Vec<_> = distances.iter().flat_map(|&offset| distances.map(|count| [offset, count])).collect();
    let mask = |count: u32| u32::MAX.checked_shr(32 - count).unwrap_or(0);
    for word in [0x8765_4321u32, 0xffff_0f0f, 0x7fff_fff0] {
        check_pairs("u32", "u32", &format!("extractBits({word}u, a, b)"), &pairs, |offset, count| {
            let (offset, count) = field(offset, count);
            word.checked_shr(offset).unwrap_or(0) & mask(count)
        });
        check_pairs("u32", "i32", &format!("extractBits(bitcast<i32>({word}u), a, b)"), &pairs, |offset, count| {
            let (offset, count) = field(offset, count);
            match count {
                0 => 0,
                _ => (word << (32 - offset - count)).cast_signed().wrapping_shr(32 - count).cast_unsigned(),
            }
        });
        check_pairs("u32", "u32", &format!("insertBits({word}u, 0x5a5a5a5au, a, b)"), &pairs, |offset, count| {
            let (offset, count) = field(offset, count);
            let mask = mask(count).checked_shl(offset).unwrap_or(0);
            (word & !mask) | (0x5a5a_5a5au32.checked_shl(offset).unwrap_or(0) & mask)
        });
    }
}

#[test]
fn conversions_between_integers_booleans_and_bits() {
    check_pairs("i32", "u32", "u32(a) ^ bitcast<u32>(b)", &edge_pairs(), |a, b| a ^ b);
    check_pairs("u32", "i32", "i32(a) ^ bitcast<i32>(b)", &edge_pairs(), |a, b| a ^ b);
    check_pairs("u32", "u32", "u32(bool(a)) + 2u * u32(bool(i32(b)))", &edge_pairs(), |a, b| {
        u32::from(a != 0) + 2 * u32::from(b != 0)
    });
    check_pairs(
        "u32",
        "u32",
        "bitcast<u32>(bitcast<f32>(a)) ^ bitcast<vec2<u32>>(vec2<i32>(vec2(b))).y",
        &edge_pairs(),
        |a, b| a ^ b,
    );
}

#[test]
fn conversions_from_integers_to_floats_round_to_nearest_even() {
    let mut pairs = edge_pairs();
    pairs.extend([16_777_217, 16_777_219, 0xffff_ff7f, 0x7fff_ffbf, 0xff00_0001].map(|a| [a, 0]));
    check_pairs("u32", "f32", "f32(a)", &pairs, |a, _| (a as f32).to_bits());
    check_pairs("i32", "f32", "f32(a)", &pairs, |a, _| (a.cast_signed() as f32).to_bits());
    check_pairs("u32", "f32", "f32(bool(a))", &pairs, |a, _| f32::from(u8::from(a != 0)).to_bits());
}

#[test]
fn conversions_from_floats_saturate_and_take_nan_for_zero() {
    let floats = [
        0.0,
        -0.0,
        0.9,
        -0.9,
        1.5,
        -1.5,
        2.5,
        1e9,
        -1e9,
        2_147_483_520.0,
        2_147_483_648.0,
        -2_147_483_648.0,
        -2_147_483_904.0,
        4_294_967_040.0,
        4_294_967_296.0,
        1e30,
        -1e30,
        f32::MAX,
        f32::MIN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        1e-40,
    ];
    let pairs: Vec<_> = bits(&floats).into_iter().map(|a| [a, 0]).collect();
    // WGSL clamps to the range of values that a float can have.
    let highest_signed = 2_147_483_520.0f32;
    let highest_unsigned = 4_294_967_040.0f32;
    let exact = |a: u32, highest: f32| f32::from_bits(a).min(highest);
    let saturated: Vec<_> = pairs.iter().copied().filter(|[a, _]| f32::from_bits(*a) <= highest_signed).collect();
    check_pairs("f32", "i32", "i32(a)", &saturated, |a, _| (exact(a, highest_signed) as i32).cast_unsigned());
    let saturated: Vec<_> = pairs.iter().copied().filter(|[a, _]| f32::from_bits(*a) <= highest_unsigned).collect();
    check_pairs("f32", "u32", "u32(a)", &saturated, |a, _| exact(a, highest_unsigned) as u32);
    // Above, the highest integer and the highest one that is a float are both right.
    for [a, _] in pairs.into_iter().filter(|[a, _]| f32::from_bits(*a) > highest_signed) {
        let source = "@group(0) @binding(0) var<storage, read_write> out: array<u32>;
            @compute @workgroup_size(1) fn main() {
                let a = bitcast<f32>(out[2]);
                out[0] = bitcast<u32>(i32(a));
                out[1] = u32(a);
            }";
        let out = run_buffers(source, [1, 1, 1], &[vec![0, 0, a]]).remove(0);
        assert!([0x7fff_ffff, 0x7fff_ff80].contains(&out[0]), "i32({}) = {}", f32::from_bits(a), out[0]);
        let unsigned = f32::from_bits(a) as u32;
        assert!([unsigned, unsigned.min(0xffff_ff00)].contains(&out[1]), "u32({}) = {}", f32::from_bits(a), out[1]);
    }
    let nan = [[f32::NAN.to_bits(), 0], [0xffc0_0001, 0]];
    check_pairs("f32", "u32", "u32(a) + bitcast<u32>(i32(a))", &nan[..1], |_, _| 0);
}

#[test]
fn packing_of_integers() {
    let words = "vec4(a, b, a >> 8u, b >> 24u)";
    check_unsigned(&format!("pack4xU8({words})"), |a, b| {
        u32::from_le_bytes([a, b, a >> 8, b >> 24].map(|word| word as u8))
    });
    let words = "vec4(a, b, a >> 8u, b >> 24u)";
    check_pairs("i32", "u32", &format!("pack4xI8({words})"), &edge_pairs(), |a, b| {
        u32::from_le_bytes([a, b, a >> 8, b >> 24].map(|word| word as u8))
    });
    check_pairs("u32", "u32", "pack4xU8Clamp(vec4(a, b, 255u, 256u))", &edge_pairs(), |a, b| {
        u32::from_le_bytes([a, b, 255, 256].map(|word| word.min(255) as u8))
    });
    check_pairs("i32", "u32", "pack4xI8Clamp(vec4(a, b, 128, -129))", &edge_pairs(), |a, b| {
        u32::from_le_bytes([a.cast_signed(), b.cast_signed(), 128, -129].map(|word| word.clamp(-128, 127) as u8))
    });
    check_unsigned("dot(unpack4xU8(a), vec4(1u, 256u, 65536u, 16777216u)) ^ unpack4xU8(b).z", |a, b| {
        a ^ (b >> 16 & 255)
    });
    check_pairs("u32", "i32", "unpack4xI8(a).x + 1000 * unpack4xI8(b).w", &edge_pairs(), |a, b| {
        (i32::from(a as i8) + 1000 * i32::from((b >> 24) as i8)).cast_unsigned()
    });
    check_unsigned("dot4U8Packed(a, b)", |a, b| {
        a.to_le_bytes().into_iter().zip(b.to_le_bytes()).map(|(a, b)| u32::from(a) * u32::from(b)).sum()
    });
    check_pairs("u32", "i32", "dot4I8Packed(a, b)", &edge_pairs(), |a, b| {
        let bytes = a.to_le_bytes().into_iter().zip(b.to_le_bytes());
        bytes.map(|(a, b)| i32::from(a as i8) * i32::from(b as i8)).sum::<i32>().cast_unsigned()
    });
}
