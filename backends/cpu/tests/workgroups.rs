//! Workgroups: sizes and built-in values, memory that they share, barriers, atomic operations.

mod support;

use support::{run_buffers, run_output};

const SIZES: [[u32; 3]; 9] =
    [[1, 1, 1], [5, 1, 1], [64, 1, 1], [100, 1, 1], [256, 1, 1], [8, 8, 1], [4, 4, 4], [3, 5, 7], [1, 1, 33]];

#[test]
fn built_in_values() {
    for size in SIZES {
        let [x, y, z] = size;
        let groups = [3, 2, 2];
        let source = format!(
            "@group(0) @binding(0) var<storage, read_write> out: array<array<u32, 13>>;
            @compute @workgroup_size({x}, {y}, {z}) fn main(
                @builtin(local_invocation_id) local: vec3<u32>, @builtin(global_invocation_id) id: vec3<u32>,
                @builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
                @builtin(local_invocation_index) index: u32,
            ) {{
                let size = groups * vec3({x}u, {y}u, {z}u);
                out[(id.z * size.y + id.y) * size.x + id.x] = array(
                    local.x, local.y, local.z, id.x, id.y, id.z, group.x, group.y, group.z,
                    groups.x, groups.y, groups.z, index,
                );
            }}"
        );
        let total = [x * groups[0], y * groups[1], z * groups[2]];
        let mut expected = Vec::new();
        for index in 0..total.iter().product() {
            let id = [index % total[0], index / total[0] % total[1], index / total[0] / total[1]];
            let local = [id[0] % x, id[1] % y, id[2] % z];
            expected.extend([local, id, [id[0] / x, id[1] / y, id[2] / z], groups].concat());
            expected.push((local[2] * y + local[1]) * x + local[0]);
        }
        assert_eq!(run_output(&source, groups, expected.len()), expected, "{size:?}");
    }
}

#[test]
fn sums_by_a_tree_of_barriers() {
    for size in SIZES {
        let [x, y, z] = size;
        let count = x * y * z;
        let source = format!(
            "@group(0) @binding(0) var<storage, read_write> out: array<u32>;
            var<workgroup> sums: array<u32, {count}>;
            @compute @workgroup_size({x}, {y}, {z}) fn main(
                @builtin(local_invocation_index) i: u32, @builtin(workgroup_id) group: vec3<u32>,
            ) {{
                sums[i] = (i + 1u) * (group.x + 1u);
                workgroupBarrier();
                for (var step = 1u; step < {count}u; step *= 2u) {{
                    var other = 0u;
                    if i + step < {count}u {{ other = sums[i + step]; }}
                    workgroupBarrier();
                    sums[i] += other;
                    workgroupBarrier();
                }}
                out[group.x * {count}u + i] = sums[i];
            }}"
        );
        let expected = (0..20).flat_map(|group| (0..count).map(move |i| (i + 1..=count).sum::<u32>() * (group + 1)));
        assert_eq!(run_output(&source, [20, 1, 1], 20 * count as usize), expected.collect::<Vec<_>>(), "{size:?}");
    }
}

#[test]
fn neighbours_see_what_was_written_before_the_barrier() {
    let source = "
        struct Cell { n: u32, v: vec3<u32> }
        @group(0) @binding(0) var<storage, read_write> out: array<u32>;
        var<workgroup> one: u32;
        var<workgroup> tile: array<array<Cell, 8>, 8>;
        @compute @workgroup_size(8, 8) fn main(@builtin(local_invocation_id) id: vec3<u32>) {
            tile[id.y][id.x].n = id.x;
            tile[id.y][id.x].v = vec3(id.y, 100u, 200u);
            if id.x == 3u && id.y == 4u { one = 7u; }
            workgroupBarrier();
            let cell = tile[7u - id.y][(id.x + 1u) % 8u];
            out[id.y * 8u + id.x] = cell.n + 10u * cell.v.x + one * 1000u + cell.v[2] * 100000u;
        }";
    let expected = (0..64).map(|i| (i + 1) % 8 + 10 * (7 - i / 8) + 7000 + 20_000_000);
    assert_eq!(run_output(source, [1, 1, 1], 64), expected.collect::<Vec<_>>());
}

#[test]
fn shared_memory_is_zero_at_the_start_of_every_workgroup() {
    let source = "
        @group(0) @binding(0) var<storage, read_write> out: array<u32>;
        var<workgroup> words: array<u32, 10>;
        var<workgroup> count: atomic<u32>;
        @compute @workgroup_size(10) fn main(
            @builtin(local_invocation_index) i: u32, @builtin(workgroup_id) group: vec3<u32>,
        ) {
            out[group.x * 10u + i] = words[i] + atomicLoad(&count);
            workgroupBarrier();
            words[i] = 5u;
            atomicAdd(&count, 1u);
        }";
    assert_eq!(run_output(source, [100, 1, 1], 1000), vec![0; 1000]);
}

#[test]
fn uniform_load_of_shared_memory() {
    let source = "
        @group(0) @binding(0) var<storage, read_write> out: array<u32>;
        var<workgroup> limit: u32;
        @compute @workgroup_size(70) fn main(
            @builtin(local_invocation_index) i: u32, @builtin(workgroup_id) group: vec3<u32>,
        ) {
            if i == 69u { limit = group.x + 2u; }
            let count = workgroupUniformLoad(&limit);
            var sum = 0u;
            for (var k = 0u; k < count; k++) { sum += k + i; workgroupBarrier(); }
            out[group.x * 70u + i] = sum;
        }";
    let expected = (0..3).flat_map(|group| (0..70).map(move |i| (0..group + 2).map(|k| k + i).sum::<u32>()));
    assert_eq!(run_output(source, [3, 1, 1], 210), expected.collect::<Vec<_>>());
}

/// Each operation from one invocation after another, so that results are certain: old value, then new value.
#[test]
fn atomic_operations_give_the_old_value_and_keep_the_new_one() {
    type Operation = (&'static str, fn(u32, u32) -> u32, fn(i32, i32) -> i32);
    let operations: [Operation; 8] = [
        ("Add", u32::wrapping_add, i32::wrapping_add),
        ("Sub", u32::wrapping_sub, i32::wrapping_sub),
        ("Max", Ord::max, Ord::max),
        ("Min", Ord::min, Ord::min),
        ("And", |a, b| a & b, |a, b| a & b),
        ("Or", |a, b| a | b, |a, b| a | b),
        ("Xor", |a, b| a ^ b, |a, b| a ^ b),
        ("Exchange", |_, b| b, |_, b| b),
    ];
    let values = [0, 1, 0x7fff_ffff, 0x8000_0000, 0xffff_ffff, 0x1234_5678, 0xffff_fff0];
    let pairs: Vec<[u32; 2]> = values.iter().flat_map(|&a| values.map(|b| [a, b])).collect();
    for (name, unsigned, signed) in operations {
        for (ty, is_signed) in [("u32", false), ("i32", true)] {
            for in_workgroup in [false, true] {
                let shared = "shared_[i]";
                let (cell, copy_in, copy_out) = match in_workgroup {
                    true => (
                        shared,
                        "atomicStore(&shared_[i], atomicLoad(&cells[i]));",
                        "atomicStore(&cells[i], atomicLoad(&shared_[i]));",
                    ),
                    false => ("cells[i]", "", ""),
                };
                let count = pairs.len();
                let source = format!(
                    "@group(0) @binding(0) var<storage, read_write> cells: array<atomic<{ty}>>;
                    @group(0) @binding(1) var<storage, read> values: array<{ty}>;
                    @group(0) @binding(2) var<storage, read_write> old: array<{ty}>;
                    var<workgroup> shared_: array<atomic<{ty}>, {count}>;
                    @compute @workgroup_size({count}) fn main(@builtin(local_invocation_index) i: u32) {{
                        {copy_in}
                        if i % 2u == 0u {{ old[i] = atomic{name}(&{cell}, values[i]); }} else {{
                            atomic{name}(&{cell}, values[i]);
                        }}
                        {copy_out}
                    }}"
                );
                let [first, second] = [0, 1].map(|part| pairs.iter().map(|pair| pair[part]).collect::<Vec<_>>());
                let after = run_buffers(&source, [1, 1, 1], &[first, second, vec![0; count]]);
                for (i, &[a, b]) in pairs.iter().enumerate() {
                    let new = if is_signed {
                        signed(a.cast_signed(), b.cast_signed()).cast_unsigned()
                    } else {
                        unsigned(a, b)
                    };
                    let old = if i % 2 == 0 { a } else { 0 };
                    let actual = (after[2][i], after[0][i]);
                    assert_eq!(actual, (old, new), "atomic{name} of {ty} {a:#x}, {b:#x}, workgroup: {in_workgroup}");
                }
            }
        }
    }
}

#[test]
fn atomic_counters_count_every_invocation_of_every_workgroup_once() {
    let source = "
        struct Counters { all: atomic<u32>, even: atomic<i32>, list: array<atomic<u32>, 4> }
        @group(0) @binding(0) var<storage, read_write> counters: Counters;
        @group(0) @binding(1) var<storage, read_write> taken: array<u32>;
        var<workgroup> here: atomic<u32>;
        @compute @workgroup_size(100) fn main(
            @builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) i: u32,
        ) {
            let ticket = atomicAdd(&counters.all, 1u);
            taken[ticket] += 1u;
            if id.x % 2u == 0u { atomicSub(&counters.even, 1i); }
            atomicMax(&counters.list[id.x % 4u], id.x);
            atomicAdd(&here, i);
            workgroupBarrier();
            if i == 0u && atomicLoad(&here) != 4950u { atomicStore(&counters.list[0], 0xffffffffu); }
        }";
    let after = run_buffers(source, [50, 1, 1], &[vec![0; 6], vec![0; 5000]]);
    assert_eq!(after[0], [5000, (-2500i32).cast_unsigned(), 4996, 4997, 4998, 4999]);
    assert_eq!(after[1], vec![1; 5000]);
}

#[test]
fn atomic_results_in_divergent_flow() {
    let source = "
        @group(0) @binding(0) var<storage, read_write> out: array<u32>;
        var<workgroup> next: atomic<u32>;
        @compute @workgroup_size(64) fn main(@builtin(local_invocation_index) i: u32) {
            var mine = 0u;
            loop {
                let ticket = atomicAdd(&next, 1u);
                if ticket >= 200u { break; }
                mine += 1u;
                if i % 2u == 0u { break; }
            }
            out[i] = mine;
            workgroupBarrier();
            if i == 0u { out[64] = atomicLoad(&next); }
        }";
    let out = run_output(source, [1, 1, 1], 65);
    assert_eq!(out[..64].iter().sum::<u32>(), 200);
    assert!((0..64).step_by(2).all(|i| out[i] == 1), "{out:?}");
    assert_eq!(out[64], 200 + 32, "each odd invocation takes one ticket too many");
}
