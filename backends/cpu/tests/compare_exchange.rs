//! `atomicCompareExchangeWeak`, which never fails without a reason here.

mod support;

use limpid_cpu::{Binding, Buffer, FaultKind};
use proptest::prelude::*;
use support::{bits, dispatch, executor, floats};

/// Each invocation but every third exchanges in a cell of its own.
fn exchanges(ty: &str, in_workgroup: bool, count: usize) -> String {
    let cell = if in_workgroup { "shared_[i]" } else { "cells[i]" };
    format!(
        "@group(0) @binding(0) var<storage, read_write> cells: array<atomic<{ty}>>;
        @group(0) @binding(1) var<storage, read> input: array<vec2<{ty}>>;
        @group(0) @binding(2) var<storage, read_write> results: array<vec2<{ty}>>;
        var<workgroup> shared_: array<atomic<{ty}>, {count}>;
        @compute @workgroup_size({count}) fn main(@builtin(local_invocation_index) i: u32) {{
            atomicStore(&shared_[i], atomicLoad(&cells[i]));
            if i % 3u != 0u {{
                let result = atomicCompareExchangeWeak(&{cell}, input[i].x, input[i].y);
                results[i] = vec2(result.old_value, {ty}(result.exchanged));
            }}
            if {in_workgroup} {{ atomicStore(&cells[i], atomicLoad(&shared_[i])); }}
        }}"
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn memory_changes_only_where_it_holds_what_was_expected(
        triples in proptest::collection::vec((any::<u32>(), any::<u32>(), any::<u32>(), any::<bool>()), 100),
    ) {
        let triple = |(old, other, new, same)| (old, if same { old } else { other }, new);
        let triples: Vec<_> = triples.into_iter().map(triple).collect();
        for ty in ["u32", "i32"] {
            for in_workgroup in [false, true] {
                for checked in [false, true] {
                    let source = exchanges(ty, in_workgroup, triples.len());
                    let cells = Buffer::new(triples.iter().map(|(old, ..)| *old));
                    let input = Buffer::new(triples.iter().flat_map(|(_, compare, new)| [*compare, *new]));
                    let results = Buffer::zeroed(2 * triples.len());
                    let bindings =
                        [Binding::buffer(0, 0, &cells), Binding::buffer(0, 1, &input), Binding::buffer(0, 2, &results)];
                    if checked {
                        let faults = executor(&source).dispatch_checked([1, 1, 1], &bindings).unwrap();
                        prop_assert!(faults.is_empty(), "{faults:?}");
                    } else {
                        dispatch(&executor(&source), [1, 1, 1], &bindings, &source);
                    }
                    let (cells, results) = (cells.read(), results.read());
                    for (i, &(old, compare, new)) in triples.iter().enumerate() {
                        let expected = match i % 3 {
                            0 => (old, 0, 0),
                            _ if old == compare => (new, old, 1),
                            _ => (old, old, 0),
                        };
                        prop_assert_eq!((cells[i], results[2 * i], results[2 * i + 1]), expected, "{} {}", i, &source);
                    }
                }
            }
        }
    }
}

#[test]
fn a_loop_of_exchanges_adds_floats_of_all_invocations() {
    let source = "
        @group(0) @binding(0) var<storage, read_write> sums: array<atomic<u32>, 4>;
        var<workgroup> here: atomic<u32>;
        @compute @workgroup_size(100) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
            let part = f32(id.x % 7u);
            var old = atomicLoad(&sums[id.x % 4u]);
            loop {
                let result = atomicCompareExchangeWeak(&sums[id.x % 4u], old, bitcast<u32>(bitcast<f32>(old) + part));
                if result.exchanged { break; }
                old = result.old_value;
            }
            var seen = 0u;
            loop {
                let result = atomicCompareExchangeWeak(&here, seen, seen + 1u);
                if result.exchanged { break; }
                seen = result.old_value;
            }
            workgroupBarrier();
            if atomicLoad(&here) != 100u { atomicStore(&sums[0], 0x7fc00000u); }
        }";
    let sums = Buffer::new(bits(&[0.0; 4]));
    dispatch(&executor(source), [50, 1, 1], &[Binding::buffer(0, 0, &sums)], source);
    let sum = |rest: u32| (0..5000u32).filter(|i| i % 4 == rest).map(|i| (i % 7) as f32).sum::<f32>();
    assert_eq!(floats(&sums.read()), [0, 1, 2, 3].map(sum));
}

#[test]
fn what_is_compared_must_have_been_written() {
    let source = "
        @group(0) @binding(0) var<storage, read_write> out: array<u32>;
        var<workgroup> lock: atomic<u32>;
        @compute @workgroup_size(64) fn main(@builtin(local_invocation_index) i: u32) {
            out[i] = atomicCompareExchangeWeak(&lock, i, i + 1u).old_value;
        }";
    let out = Buffer::zeroed(64);
    let faults = executor(source).dispatch_checked([1, 1, 1], &[Binding::buffer(0, 0, &out)]).unwrap();
    assert_eq!(faults.len(), 1);
    assert_eq!((faults[0].kind, faults[0].invocation, faults[0].count), (FaultKind::UninitializedRead, 0, 1));
    assert_eq!(out.read(), (0..64).collect::<Vec<_>>());
}
