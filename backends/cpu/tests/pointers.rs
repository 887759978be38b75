//! Pointers into every kind of memory, and indices that are part of them.

mod support;

use support::{check, run_buffers};

#[test]
fn an_index_in_a_pointer_is_the_one_when_it_was_taken() {
    let code = "
        fn test(i: u32, u: u32) -> u32 {
            var list = array(1u, 2u, 3u, 4u);
            var k = u % 4u;
            let p = &list[k];
            k = (k + 1u) % 4u;
            *p = 9u;
            let q = &list[k];
            if i % 2u == 0u { k = 0u; }
            *q += 20u;
            return ((list[0] * 100u + list[1]) * 100u + list[2]) * 100u + list[3] + k * 100000000u;
        }";
    check(code, |i, u| {
        let mut list = [1, 2, 3, 4];
        let next = (u + 1) % 4;
        list[(u % 4) as usize] = 9;
        list[next as usize] += 20;
        let k = if i % 2 == 0 { 0 } else { next };
        list.iter().fold(0, |number, value| number * 100 + value) + k * 100_000_000
    });
}

#[test]
fn a_pointer_taken_before_a_loop_keeps_its_place() {
    let code = "
        fn test(i: u32, u: u32) -> u32 {
            var list = array(vec2(1u), vec2(2u), vec2(3u));
            var k = i % 3u;
            let p = &list[k];
            for (k = 0u; k < u; k++) { (*p).y += k; list[k % 3u].x += 1u; }
            return (*p).y * 1000u + list[0].x * 100u + list[1].x * 10u + list[2].x;
        }";
    check(code, |i, u| {
        let x = |slot: u32| slot + 1 + (0..u).filter(|k| k % 3 == slot).count() as u32;
        (i % 3 + 1 + (0..u).sum::<u32>()) * 1000 + x(0) * 100 + x(1) * 10 + x(2)
    });
}

#[test]
fn two_dynamic_indices_into_a_variable() {
    let code = "
        fn test(i: u32, u: u32) -> u32 {
            var grid: array<array<u32, 3>, 4>;
            var m = mat2x3<f32>();
            for (var a = 0u; a < 4u; a++) { for (var b = 0u; b < 3u; b++) { grid[a][b] = a * 10u + b; } }
            grid[i % 4u][u % 3u] += 500u;
            m[u % 2u][i % 3u] = 7.0;
            return grid[i % 4u][(u + 1u) % 3u] + grid[u % 4u][u % 3u] * 1000u + u32(m[1][i % 3u]) * 1000000u;
        }";
    check(code, |i, u| {
        let at = |a: u32, b: u32| a * 10 + b + if (a, b) == (i % 4, u % 3) { 500 } else { 0 };
        at(i % 4, (u + 1) % 3) + at(u % 4, u % 3) * 1000 + u % 2 * 7_000_000
    });
}

#[test]
fn results_of_calls_as_indices_and_through_pointers_to_whole_arrays() {
    let code = "
        fn next(p: ptr<function, u32>) -> u32 { *p += 1u; return *p % 3u; }
        fn fill(list: ptr<function, array<u32, 3>>, n: u32) {
            for (var k = 0u; k < n; k++) { if k >= 3u { return; } (*list)[k] = k * k + n; }
        }
        fn test(i: u32, u: u32) -> u32 {
            var n = i;
            var list = array(7u, 7u, 7u);
            fill(&list, u);
            list[next(&n)] += list[next(&n)];
            return list[0] + 100u * list[1] + 10000u * list[2] + 1000000u * (n - i);
        }";
    check(code, |i, u| {
        let mut list = [7; 3];
        for k in 0..u.min(3) {
            list[k as usize] = k * k + u;
        }
        list[((i + 1) % 3) as usize] += list[((i + 2) % 3) as usize];
        list[0] + 100 * list[1] + 10_000 * list[2] + 2_000_000
    });
}

#[test]
fn an_element_is_read_before_the_call_that_changes_it() {
    let code = "
        var<private> state: vec2<u32>;
        fn change(n: u32) -> u32 { state.x += n; state = state.yx; return state.x; }
        fn test(i: u32, u: u32) -> u32 {
            state = vec2(i, u);
            let before = state.x;
            let r = before * 3u + change(2u) + state.x;
            let both = state;
            let s = change(1u) * 10u + both.x * 100u + both.y * 1000u;
            return r * 100000u + s;
        }";
    check(code, |i, u| {
        let r = i * 3 + u + u;
        let s = (i + 2) * 10 + u * 100 + (i + 2) * 1000;
        r * 100_000 + s
    });
}

#[test]
fn pointers_into_storage() {
    let source = "
        struct Item { n: u32, v: vec3<u32> }
        @group(0) @binding(0) var<storage, read_write> items: array<Item>;
        @compute @workgroup_size(8) fn main(@builtin(local_invocation_index) i: u32) {
            var at = i;
            let item = &items[at];
            let v = &(*item).v;
            at = 7u - i;
            (*item).n += 1u;
            (*v).y = at;
            (*item).v[at % 3u] += 100u;
        }";
    let before: Vec<u32> = (0..64).collect();
    let mut expected = before.clone();
    for i in 0..8 {
        let at = 7 - i as u32;
        expected[8 * i] += 1;
        expected[8 * i + 5] = at;
        expected[8 * i + 4 + at as usize % 3] += 100;
    }
    assert_eq!(run_buffers(source, [1, 1, 1], &[before])[0], expected);
}
