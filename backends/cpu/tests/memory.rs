//! Storage and constant buffers: layouts, runtime-sized arrays, accesses out of bounds.

mod support;

use support::{UNTOUCHED, bits, floats, run_buffers};

#[test]
fn structs_in_storage_have_the_layout_of_wgsl() {
    let source = "
        struct Item { a: u32, v: vec3<u32>, b: u32, w: vec2<u32>, m: mat2x3<f32>, list: array<u32, 3> }
        @group(0) @binding(0) var<storage, read_write> items: array<Item>;
        @compute @workgroup_size(4) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
            let i = id.x;
            if i >= arrayLength(&items) { return; }
            let old = items[i];
            items[i].a = i + 1u;
            items[i].v = vec3(10u, 11u, 12u) + old.a;
            items[i].b = old.list[2];
            items[i].w.y = 20u;
            items[i].m[1] = vec3(1.0, 2.0, f32(i));
            items[i].list[i % 3u] = 30u;
        }";
    // a 0, v 4..7, b 7, w 8..10, m 12..20, list 20..23, size 24 words.
    let mut before = vec![UNTOUCHED; 3 * 24 + 5];
    before[0] = 100;
    (before[24], before[48]) = (200, 300);
    before[22] = 77;
    let mut expected = before.clone();
    for i in 0..3 {
        let item = &mut expected[24 * i..][..24];
        let (a, last) = (item[0], item[22]);
        item[0] = i as u32 + 1;
        item[4..7].copy_from_slice(&[10 + a, 11 + a, 12 + a]);
        item[7] = last;
        item[9] = 20;
        item[16..19].copy_from_slice(&bits(&[1.0, 2.0, i as f32]));
        item[20 + i] = 30;
    }
    assert_eq!(run_buffers(source, [2, 1, 1], &[before])[0], expected);
}

#[test]
fn whole_structs_are_copied_without_their_padding() {
    let source = "
        struct Inner { v: vec3<f32>, n: u32 }
        struct Item { a: u32, inner: array<Inner, 2>, m: mat3x3<f32>, flag: vec2<u32> }
        @group(0) @binding(0) var<storage, read_write> to: array<Item, 3>;
        @group(0) @binding(1) var<storage, read> from_: array<Item, 3>;
        @compute @workgroup_size(3) fn main(@builtin(local_invocation_index) i: u32) {
            var item = from_[2u - i];
            item.inner[i % 2u].n += 1u;
            to[i] = item;
        }";
    // a 0, inner 4..12, m 12..24 with columns of 4 words, flag 24..26, size 28 words.
    let from: Vec<u32> = (0..3 * 28).map(|word| 1000 + word).collect();
    let mut expected = vec![0; 3 * 28];
    for i in 0..3 {
        for word in (0..28).filter(|word| !matches!(word, 1..4 | 15 | 19 | 23 | 26..)) {
            expected[28 * i + word] = from[28 * (2 - i) + word];
        }
        expected[28 * i + 7 + 4 * (i % 2)] += 1;
    }
    assert_eq!(run_buffers(source, [1, 1, 1], &[vec![0; 3 * 28], from])[0], expected);
}

#[test]
fn arrays_of_vec3_have_a_stride_of_four_words() {
    let source = "
        @group(0) @binding(0) var<storage, read_write> list: array<vec3<u32>>;
        @compute @workgroup_size(64) fn main(@builtin(local_invocation_index) i: u32) {
            if i < arrayLength(&list) {
                let v = list[i];
                list[i] = v.yzx;
                list[i].y += arrayLength(&list);
            }
        }";
    let before: Vec<u32> = (0..40).collect();
    let expected = before.chunks(4).flat_map(|v| [v[1], v[2] + 10, v[0], v[3]]);
    assert_eq!(run_buffers(source, [1, 1, 1], std::slice::from_ref(&before))[0], expected.collect::<Vec<_>>());
}

#[test]
fn length_of_a_runtime_sized_array_counts_whole_elements_after_the_members_before_it() {
    let source = "
        struct List { head: vec3<u32>, count: u32, tail: array<vec2<u32>> }
        @group(0) @binding(0) var<storage, read_write> out: array<u32>;
        @group(0) @binding(1) var<storage, read> list: List;
        @compute @workgroup_size(1) fn main() {
            out[0] = arrayLength(&list.tail);
            out[1] = arrayLength(&out);
            out[2] = list.tail[arrayLength(&list.tail) - 1u].y + list.count;
        }";
    for words in [6usize, 8, 9, 21, 400] {
        let list: Vec<u32> = (0..words as u32).collect();
        let length = (words as u32 - 4) / 2;
        let last = 4 + 2 * length - 1;
        assert_eq!(run_buffers(source, [1, 1, 1], &[vec![0; 3], list])[0], [length, 3, last + 3], "{words} words");
    }
}

#[test]
fn two_dynamic_indices_into_storage() {
    let source = "
        struct Row { name: u32, cells: array<vec2<u32>, 3> }
        @group(0) @binding(0) var<storage, read_write> rows: array<Row>;
        @compute @workgroup_size(12) fn main(@builtin(local_invocation_index) i: u32) {
            let row = i / 3u;
            let cell = i % 3u;
            rows[row].cells[cell][i % 2u] = 100u + i + rows[row].cells[cell].x;
        }";
    let before: Vec<u32> = (0..32).map(|word| 1000 * word).collect();
    let mut expected = before.clone();
    for i in 0..12 {
        let cell = i / 3 * 8 + 2 + i % 3 * 2;
        expected[cell + i % 2] = 100 + i as u32 + before[cell];
    }
    assert_eq!(run_buffers(source, [1, 1, 1], &[before])[0], expected);
}

#[test]
fn constant_buffers_with_matrices_and_padding() {
    let source = "
        struct Light { color: vec3<f32>, power: f32, at: vec2<f32> }
        struct Scene {
            m43: mat4x3<f32>, m22: mat2x2<f32>, scale: f32, lights: array<Light, 2>, m34: mat3x4<f32>, last: u32,
        }
        @group(0) @binding(0) var<storage, read_write> out: array<f32>;
        @group(0) @binding(1) var<uniform> scene: Scene;
        @compute @workgroup_size(2) fn main(@builtin(local_invocation_index) i: u32) {
            let light = scene.lights[i];
            let at = i * 9u;
            out[at] = scene.m43[3].z;
            out[at + 1u] = scene.m22[i].y;
            out[at + 2u] = scene.scale;
            out[at + 3u] = light.color.z;
            out[at + 4u] = light.power;
            out[at + 5u] = scene.lights[i].at[i];
            out[at + 6u] = scene.m34[2u - i].w;
            out[at + 7u] = f32(scene.last);
            out[at + 8u] = (scene.m43 * vec4(0.0, f32(i), 0.0, 1.0)).y;
        }";
    // m43 0..16, m22 16..20, scale 20, lights 24..40 of 8 words each, m34 40..52, last 52, size 56 words.
    let mut scene = bits(&(0..56).map(|word| word as f32).collect::<Vec<_>>());
    scene[52] = 52;
    let first = [14.0, 17.0, 20.0, 26.0, 27.0, 28.0, 51.0, 52.0, 13.0];
    let second = [14.0, 19.0, 20.0, 34.0, 35.0, 37.0, 47.0, 52.0, 13.0 + 5.0];
    let out = run_buffers(source, [1, 1, 1], &[vec![0; 18], scene]).remove(0);
    assert_eq!(floats(&out), [first, second].concat());
}

#[test]
fn constant_buffers_give_uniform_control_flow() {
    let source = "
        struct Numbers { count: u32, list: array<vec4<u32>, 4> }
        @group(0) @binding(0) var<storage, read_write> out: array<u32>;
        @group(0) @binding(1) var<uniform> numbers: Numbers;
        @compute @workgroup_size(100) fn main(@builtin(local_invocation_index) i: u32) {
            var sum = i;
            for (var k = 0u; k < numbers.count; k++) {
                let n = numbers.list[k / 4u][k % 4u];
                if n == 3u { continue; }
                if n > 90u { break; }
                sum = sum * 2u + n;
            }
            out[i] = sum;
        }";
    let numbers = [12, 0, 0, 0, 1, 3, 4, 0, 7, 3, 91, 1, 1, 1, 1, 1, 0, 0, 0, 0];
    let expected = (0..100).map(|i| [1, 4, 0, 7].iter().fold(i, |sum, n| sum * 2 + n));
    let out = run_buffers(source, [1, 1, 1], &[vec![0; 100], numbers.to_vec()]).remove(0);
    assert_eq!(out, expected.collect::<Vec<_>>());
}

#[test]
fn values_loaded_from_storage_before_a_store_stay() {
    let source = "
        @group(0) @binding(0) var<storage, read_write> words: array<u32>;
        @compute @workgroup_size(64) fn main(@builtin(local_invocation_index) i: u32) {
            let a = words[i];
            words[i] = 5u;
            let b = words[i];
            if i % 2u == 0u { words[i] = a + b; }
            words[i] += words[i] + a;
        }";
    let before: Vec<u32> = (0..64).map(|i| i * i).collect();
    let expected = (0..64).map(|i| if i % 2 == 0 { 2 * (i * i + 5) + i * i } else { 10 + i * i });
    assert_eq!(run_buffers(source, [1, 1, 1], &[before])[0], expected.collect::<Vec<_>>());
}

#[test]
fn accesses_out_of_bounds_do_no_harm() {
    let source = "
        @group(0) @binding(0) var<storage, read_write> words: array<u32>;
        @group(0) @binding(1) var<storage, read_write> other: array<u32>;
        @compute @workgroup_size(64) fn main(@builtin(local_invocation_index) i: u32) {
            other[i] = words[(i + 4u) * 16777216u] + words[i + 0x40000000u];
            words[i * 0x01000001u + 4u] = 9u;
            words[0u - i - 1u] = 9u;
        }";
    let after = run_buffers(source, [1, 1, 1], &[vec![1, 2, 3, 4], vec![UNTOUCHED; 64]]);
    let allowed = |word: &u32| [1, 2, 3, 4, 9].contains(word);
    assert!(after[0].iter().all(allowed), "{:?}", after[0]);
    assert!(after[1].iter().all(|sum| *sum <= 18), "{:?}", after[1]);
}

#[test]
fn only_bound_groups_and_bindings_are_written() {
    let source = "
        @group(1) @binding(3) var<storage, read_write> a: array<u32>;
        @group(0) @binding(7) var<storage, read_write> b: u32;
        @compute @workgroup_size(1) fn main(@builtin(workgroup_id) id: vec3<u32>) {
            a[id.x] = 1u;
            if id.x == 2u { b = 2u; }
        }";
    use limpid_cpu::{Binding, Buffer};
    let [a, b, unused] = [Buffer::zeroed(4), Buffer::zeroed(1), Buffer::zeroed(1)];
    let bindings = [Binding::buffer(0, 3, &unused), Binding::buffer(0, 7, &b), Binding::buffer(1, 3, &a)];
    support::executor(source).dispatch([3, 1, 1], &bindings).unwrap();
    assert_eq!((a.read(), b.read(), unused.read()), (vec![1, 1, 1, 0], vec![2], vec![0]));
}
