//! Subgroup operations against a loop over the invocations of a subgroup, for every size of subgroups.

mod support;

use half::f16;
use limpid_cpu::{Binding, Buffer, CompileError, FaultKind, SUBGROUP_SIZE};
use proptest::prelude::*;
use support::{dispatch, executor, run_output};

const SIZES: [u32; 5] = [4, 8, 16, 32, 64];

/// Values of a subgroup; none for invocations that take no part.
type Values<'a> = &'a [Option<u32>];

/// Expression of `v`, the value of an invocation, and what it is for an invocation of a subgroup.
type Operation = (&'static str, fn(Values<'_>, usize) -> u32);

fn active(values: Values<'_>) -> impl Iterator<Item = u32> {
    values.iter().flatten().copied()
}

fn signed(values: Values<'_>) -> impl Iterator<Item = i32> {
    active(values).map(|value| value.cast_signed() - 500)
}

fn at(values: Values<'_>, lane: usize) -> u32 {
    values.get(lane).copied().flatten().unwrap_or(0)
}

fn float(sum: f32) -> u32 {
    sum.to_bits()
}

const OPERATIONS: [Operation; 34] = [
    ("subgroupAdd(v)", |v, _| active(v).sum()),
    ("subgroupMul(v | 1u)", |v, _| active(v).fold(1, |product, v| product.wrapping_mul(v | 1))),
    ("subgroupMin(v)", |v, _| active(v).min().unwrap()),
    ("subgroupMax(v)", |v, _| active(v).max().unwrap()),
    ("subgroupAnd(v | 64u)", |v, _| active(v).fold(u32::MAX, |all, v| all & (v | 64))),
    ("subgroupOr(v)", |v, _| active(v).fold(0, |all, v| all | v)),
    ("subgroupXor(v)", |v, _| active(v).fold(0, |all, v| all ^ v)),
    ("subgroupInclusiveAdd(v)", |v, lane| active(&v[..=lane]).sum()),
    ("subgroupExclusiveAdd(v)", |v, lane| active(&v[..lane]).sum()),
    ("subgroupInclusiveMul(v | 1u)", |v, lane| active(&v[..=lane]).fold(1, |p, v| p.wrapping_mul(v | 1))),
    ("subgroupExclusiveMul(v | 1u)", |v, lane| active(&v[..lane]).fold(1, |p, v| p.wrapping_mul(v | 1))),
    ("u32(subgroupAll(v % 16u != 3u))", |v, _| u32::from(active(v).all(|v| v % 16 != 3))),
    ("u32(subgroupAny(v % 64u == 3u))", |v, _| u32::from(active(v).any(|v| v % 64 == 3))),
    ("bitcast<u32>(subgroupAdd(s))", |v, _| signed(v).sum::<i32>().cast_unsigned()),
    ("bitcast<u32>(subgroupMin(s))", |v, _| signed(v).min().unwrap().cast_unsigned()),
    ("bitcast<u32>(subgroupMax(s))", |v, _| signed(v).max().unwrap().cast_unsigned()),
    ("bitcast<u32>(subgroupAdd(f32(s)))", |v, _| float(signed(v).map(|s| s as f32).sum())),
    ("bitcast<u32>(subgroupMin(f32(s)))", |v, _| float(signed(v).min().unwrap() as f32)),
    ("bitcast<u32>(subgroupExclusiveMul(f32(v % 3u + 1u)))", |v, lane| {
        float(active(&v[..lane]).fold(1.0, |product, v| product * (v % 3 + 1) as f32))
    }),
    ("bitcast<u32>(f32(subgroupInclusiveAdd(f16(v % 100u) * 1.5h)))", |v, lane| {
        let halves = active(&v[..=lane]).map(|v| f16::from_f32((v % 100) as f32 * 1.5));
        float(halves.reduce(|a, b| a + b).unwrap().to_f32())
    }),
    ("subgroupAdd(vec2(v, v * 2u)).y", |v, _| active(v).sum::<u32>() * 2),
    ("subgroupBallot(v % 3u == 0u).x", |v, _| {
        (0..32).fold(0, |bits, lane| {
            bits | u32::from(at(v, lane).is_multiple_of(3) && v.get(lane).is_some_and(Option::is_some)) << lane
        })
    }),
    ("subgroupBallot().y", |v, _| {
        (32..64).fold(0, |bits, lane| bits | u32::from(v.get(lane).is_some_and(Option::is_some)) << (lane - 32))
    }),
    ("subgroupBroadcastFirst(v)", |v, _| active(v).next().unwrap()),
    ("subgroupBroadcast(v, 2u)", |v, _| at(v, 2)),
    ("subgroupShuffle(v, v % 70u)", |v, lane| at(v, at(v, lane) as usize % 70)),
    ("subgroupShuffleXor(v, 5u)", |v, lane| at(v, lane ^ 5)),
    ("subgroupShuffleUp(v, 3u)", |v, lane| lane.checked_sub(3).map_or(0, |lane| at(v, lane))),
    ("subgroupShuffleDown(v, v % 5u)", |v, lane| at(v, lane + at(v, lane) as usize % 5)),
    ("quadBroadcast(v, 1u)", |v, lane| at(v, lane & !3 | 1)),
    ("quadSwapX(v)", |v, lane| at(v, lane ^ 1)),
    ("quadSwapY(v)", |v, lane| at(v, lane ^ 2)),
    ("quadSwapDiagonal(v)", |v, lane| at(v, lane ^ 3)),
    ("subgroupShuffle(vec3(v, 1u, v + 1u), 1u).z", |v, _| if v[1].is_some() { at(v, 1) + 1 } else { 0 }),
];

/// All operations for the invocations that take part, each in `out` at the invocation's place.
fn source(workgroup_size: usize) -> String {
    let count = OPERATIONS.len();
    let lines: String = (0..).zip(OPERATIONS).map(|(i, (e, _))| format!("out[i * {count}u + {i}u] = {e};\n")).collect();
    format!(
        "enable f16;
        @group(0) @binding(0) var<storage, read_write> out: array<u32>;
        @group(0) @binding(1) var<storage, read> numbers: array<u32>;
        @compute @workgroup_size({workgroup_size}) fn main(@builtin(global_invocation_id) id: vec3<u32>) {{
            let i = id.x;
            let v = numbers[i];
            if v == 1000u {{ return; }}
            let s = bitcast<i32>(v) - 500i;
            {lines}
        }}"
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn operations_see_the_invocations_that_take_part(
        workgroup_size in proptest::sample::select(vec![64usize, 100, 40, 128, 3]),
        numbers in proptest::collection::vec(0u32..1000, 256),
        absent in proptest::collection::vec(0u32..100, 256),
        share in 0u32..100,
    ) {
        let masked = |(number, absent): (&u32, &u32)| if *absent < share { 1000 } else { *number };
        let numbers: Vec<u32> = numbers.iter().zip(&absent).map(masked).take(2 * workgroup_size).collect();
        let source = source(workgroup_size);
        for size in SIZES {
            let executor = executor(&source).with_subgroup_size(size).unwrap();
            let (out, input) = (Buffer::zeroed(numbers.len() * OPERATIONS.len()), Buffer::new(numbers.iter().copied()));
            dispatch(&executor, [2, 1, 1], &[Binding::buffer(0, 0, &out), Binding::buffer(0, 1, &input)], &source);
            let out = out.read();
            for (group, numbers) in numbers.chunks(workgroup_size).enumerate() {
                for (subgroup, numbers) in numbers.chunks(size as usize).enumerate() {
                    let values: Vec<_> = numbers.iter().map(|v| (*v != 1000).then_some(*v)).collect();
                    for lane in (0..values.len()).filter(|&lane| values[lane].is_some()) {
                        let invocation = group * workgroup_size + subgroup * size as usize + lane;
                        for (index, (expression, expected)) in OPERATIONS.iter().enumerate() {
                            prop_assert_eq!(
                                out[invocation * OPERATIONS.len() + index],
                                expected(&values, lane),
                                "{} of lane {} of {:?}", expression, lane, values
                            );
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn built_in_values_number_the_invocations() {
    let source = "
        struct Place { @builtin(subgroup_id) subgroup: u32, @builtin(subgroup_invocation_id) lane: u32 }
        @group(0) @binding(0) var<storage, read_write> out: array<vec4<u32>>;
        @compute @workgroup_size(100) fn main(
            place: Place, @builtin(local_invocation_index) i: u32,
            @builtin(subgroup_size) size: u32, @builtin(num_subgroups) count: u32,
        ) {
            out[i] = vec4(place.subgroup, place.lane, size, count);
        }";
    let expected =
        |size: u32| (0..100).flat_map(|i| [i / size, i % size, size, 100u32.div_ceil(size)]).collect::<Vec<_>>();
    assert_eq!(run_output(source, [1, 1, 1], 400), expected(SUBGROUP_SIZE));
    for size in SIZES {
        let out = Buffer::zeroed(400);
        let executor = executor(source).with_subgroup_size(size).unwrap();
        executor.dispatch([1, 1, 1], &[Binding::buffer(0, 0, &out)]).unwrap();
        assert_eq!(out.read(), expected(size));
    }
    for size in [0, 1, 2, 5, 48, 128] {
        let error = executor(source).with_subgroup_size(size).unwrap_err();
        assert_eq!(error, CompileError::SubgroupSize { size });
    }
}

/// Sums over a workgroup, made of sums over subgroups.
const PREFIX_SUMS: &str = "
    @group(0) @binding(0) var<storage, read_write> out: array<u32>;
    var<workgroup> totals: array<u32, 64>;
    @compute @workgroup_size(200) fn main(
        @builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) i: u32,
        @builtin(subgroup_id) subgroup: u32, @builtin(subgroup_invocation_id) lane: u32,
    ) {
        let number = id.x * id.x % 1000u;
        let before = subgroupExclusiveAdd(number);
        let total = subgroupAdd(number);
        if lane == 0u { totals[subgroup] = total; }
        workgroupBarrier();
        var sum = before;
        for (var k = 0u; k < subgroup; k++) { sum += totals[k]; }
        out[id.x] = sum;
    }";

#[test]
fn sums_over_a_workgroup_do_not_depend_on_the_size_of_subgroups() {
    let numbers = |group: u32| (0..200).map(move |i| (group * 200 + i).pow(2) % 1000);
    let expected: Vec<u32> =
        (0..3).flat_map(|group| (0..200).map(move |i| numbers(group).take(i).sum::<u32>())).collect();
    for size in SIZES {
        let out = Buffer::zeroed(600);
        let executor = executor(PREFIX_SUMS).with_subgroup_size(size).unwrap();
        let faults = executor.dispatch_checked([3, 1, 1], &[Binding::buffer(0, 0, &out)]).unwrap();
        assert!(faults.is_empty(), "{faults:?}");
        assert_eq!(out.read(), expected, "subgroups of {size}");
    }
}

#[test]
fn operations_in_loops_that_invocations_leave_one_by_one() {
    let source = "
        @group(0) @binding(0) var<storage, read_write> out: array<u32>;
        @compute @workgroup_size(64) fn main(@builtin(local_invocation_index) i: u32) {
            var seen = 0u;
            for (var k = 0u; k < i; k++) { seen += countOneBits(subgroupBallot(k % 2u == 0u).x); }
            out[i] = seen;
        }";
    let out = Buffer::zeroed(64);
    let executor = executor(source).with_subgroup_size(16).unwrap();
    executor.dispatch([1, 1, 1], &[Binding::buffer(0, 0, &out)]).unwrap();
    // In round k those of the subgroup above k are left.
    let left = |i: u32, k: u32| (i / 16 * 16..i / 16 * 16 + 16).filter(|other| *other > k).count() as u32;
    let expected = (0..64).map(|i| (0..i).filter(|k| k % 2 == 0).map(|k| left(i, k)).sum::<u32>());
    assert_eq!(out.read(), expected.collect::<Vec<_>>());
}

#[test]
fn only_a_workgroup_barrier_orders_workgroup_memory() {
    for (barrier, expected) in [
        ("workgroupBarrier()", None),
        ("subgroupBarrier()", Some(FaultKind::Race)),
        ("storageBarrier()", Some(FaultKind::Race)),
    ] {
        let source = format!(
            "@group(0) @binding(0) var<storage, read_write> out: array<u32>;
            var<workgroup> words: array<u32, 64>;
            @compute @workgroup_size(64) fn main(@builtin(local_invocation_index) i: u32) {{
                words[i] = i;
                {barrier};
                out[i] = words[i ^ 1u];
            }}"
        );
        let out = Buffer::zeroed(64);
        let faults = executor(&source).dispatch_checked([1, 1, 1], &[Binding::buffer(0, 0, &out)]).unwrap();
        assert_eq!(faults.first().map(|fault| fault.kind), expected, "{barrier}");
    }
}
