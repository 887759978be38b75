//! Subgroup operations against a device that has them, whatever the size of its subgroups.

mod device;
mod support;

use device::Gpu;
use support::run_buffers;

/// Expressions of `v` and of the place in the subgroup that are the same for all sizes of subgroups.
const INDEPENDENT: [&str; 15] = [
    "subgroupAdd(1u) - countOneBits(subgroupBallot(true).x) - countOneBits(subgroupBallot(true).y)",
    "subgroupInclusiveAdd(v) - subgroupExclusiveAdd(v) - v",
    "subgroupExclusiveAdd(1u) - lane",
    "subgroupInclusiveMul(3u) - 3u * subgroupExclusiveMul(3u)",
    "subgroupShuffleXor(lane, 1u) ^ lane",
    "subgroupShuffleXor(lane, 3u) ^ lane",
    "quadSwapX(lane) ^ lane",
    "quadSwapY(lane) ^ lane",
    "quadSwapDiagonal(lane) ^ lane",
    "quadBroadcast(lane, 2u) - lane / 4u * 4u",
    "subgroupBroadcastFirst(lane) + 10u * subgroupBroadcast(lane, 3u)",
    "subgroupShuffle(v, lane) - v",
    "subgroupMax(lane) - subgroupMin(lane) + 1u - size",
    "u32(subgroupAll(lane < size)) + 2u * u32(subgroupAll(lane < 3u)) + 4u * u32(subgroupAny(lane == 3u))",
    "u32(subgroupAny(lane == size)) + subgroupAnd(lane | 64u) + subgroupOr(lane % 4u) + subgroupXor(lane)",
];

#[test]
fn what_does_not_depend_on_the_size_of_subgroups_agrees() {
    let Some(gpu) = Gpu::open(wgpu::Features::SUBGROUP) else { return };
    let count = INDEPENDENT.len() + 1;
    let lines: String = (0..).zip(INDEPENDENT).map(|(i, e)| format!("out[id.x * {count}u + {i}u] = {e};\n")).collect();
    let source = format!(
        "@group(0) @binding(0) var<storage, read_write> out: array<u32>;
        @group(0) @binding(1) var<storage, read> numbers: array<u32>;
        var<workgroup> total: atomic<u32>;
        @compute @workgroup_size(128) fn main(
            @builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) i: u32,
            @builtin(subgroup_invocation_id) lane: u32, @builtin(subgroup_size) size: u32,
        ) {{
            let v = numbers[id.x];
            {lines}
            // A sum over the workgroup of what every third invocation has.
            if i % 3u == 0u {{
                let sum = subgroupAdd(v);
                let first = subgroupMin(lane);
                if lane == first {{ atomicAdd(&total, sum); }}
            }}
            workgroupBarrier();
            out[id.x * {count}u + {last}u] = atomicLoad(&total);
        }}",
        last = INDEPENDENT.len()
    );
    let numbers: Vec<u32> = (0..512u32).map(|i| i.wrapping_mul(2_654_435_761) >> 22).collect();
    let device = gpu.run(&source, 4, 512 * count, &numbers);
    let cpu = run_buffers(&source, [4, 1, 1], &[vec![0; 512 * count], numbers]).remove(0);
    for (at, (cpu, device)) in cpu.iter().zip(&device).enumerate() {
        let expression = INDEPENDENT.get(at % count).unwrap_or(&"the sum of the workgroup");
        assert_eq!(cpu, device, "{expression} of invocation {}", at / count);
    }
}
