//! Variables of all types: indices known only when running, copies, parts.

mod support;

use support::{check, run_buffers, run_output};

#[test]
fn loads_keep_what_was_there_before_a_store() {
    let code = "
        fn test(i: u32, u: u32) -> u32 {
            var x = u;
            let a = x;
            x = i;
            let b = x;
            if i % 2u == 0u { x = 5u; }
            let c = x;
            x += 1u;
            return ((a * 100u + b) * 100u + c) * 10u + x;
        }";
    check(code, |i, u| {
        let c = if i % 2 == 0 { 5 } else { i };
        ((u * 100 + i) * 100 + c) * 10 + c + 1
    });
}

#[test]
fn swaps_through_values() {
    let code = "
        fn test(i: u32, u: u32) -> u32 {
            var v = vec3(u, i, 3u);
            v = v.zxy;
            let old = v;
            v.x = old.y;
            v.y = old.x;
            var a = v.x;
            var b = v.y;
            let t = a;
            a = b;
            b = t;
            return (a * 1000u + b) * 10u + v.z % 10u;
        }";
    check(code, |i, u| (3 * 1000 + u) * 10 + i % 10);
}

#[test]
fn copies_of_aggregates_are_independent() {
    let code = "
        struct S { a: u32, list: array<u32, 3>, v: vec2<u32> }
        fn test(i: u32, u: u32) -> u32 {
            var s = S(u, array(1u, 2u, 3u), vec2(i, 4u));
            let kept = s;
            var copy = s;
            s.list[i % 3u] = 50u;
            s.a = 9u;
            copy.v.y += 1u;
            let list = s.list;
            s.list = kept.list;
            return kept.a + kept.list[i % 3u] * 10u + copy.v.y * 100u + list[i % 3u] * 1000u
                + s.list[i % 3u] * 100000u + kept.v.y * 1000000u;
        }";
    check(code, |i, u| u + (i % 3 + 1) * 100_010 + 500 + 50_000 + 4_000_000);
}

#[test]
fn shadowing() {
    let code = "
        const x = 7u;
        fn test(i: u32, u: u32) -> u32 {
            var r = x;
            let x = u;
            r = r * 10u + x;
            {
                var x = i;
                x += 1u;
                r = r * 100u + x;
                if u > 3u { let x = 3u; r = r * 10u + x; }
            }
            for (var x = 0u; x < 2u; x++) { r += x; }
            return r * 10u + x;
        }";
    check(code, |i, u| {
        let mut r = (70 + u) * 100 + i + 1;
        if u > 3 {
            r = r * 10 + 3;
        }
        (r + 1) * 10 + u
    });
}

#[test]
fn uniform_variable_that_some_invocations_change() {
    let code = "
        fn test(i: u32, u: u32) -> u32 {
            var a = u;
            var b = a + 1u;
            if i % 4u == 0u { a = 100u; b = a; }
            let c = a + b;
            a = 1u;
            return a * 1000u + c;
        }";
    check(code, |i, u| if i % 4 == 0 { 1200 } else { 1001 + 2 * u });
}

#[test]
fn private_variables_start_anew_in_every_invocation() {
    let source = "
        @group(0) @binding(0) var<storage, read_write> out: array<u32>;
        var<private> count = 5u;
        var<private> list: array<vec2<u32>, 2> = array(vec2(1u, 2u), vec2(3u, 4u));
        var<private> zero: vec3<u32>;
        fn step() { count += 1u; zero.y += 2u; }
        @compute @workgroup_size(20) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
            if id.x % 2u == 0u { step(); list[id.x % 4u / 2u].y += id.x; }
            step();
            out[id.x] = count + 10u * zero.y + 1000u * list[0].y + 1000000u * list[1].y;
        }";
    let expected = (0..200).map(|i| match i % 4 {
        0 => 7 + 40 + 1000 * (2 + i) + 4_000_000,
        2 => 7 + 40 + 2000 + 1_000_000 * (4 + i),
        _ => 6 + 20 + 2000 + 4_000_000,
    });
    assert_eq!(run_output(source, [10, 1, 1], 200), expected.collect::<Vec<_>>());
}

#[test]
fn select_by_scalars_and_by_components() {
    let code = "
        fn test(i: u32, u: u32) -> u32 {
            let a = vec3(1u, 2u, i);
            let b = vec3(4u, u, 6u);
            let whole = select(a, b, u > 3u);
            let parts = select(a, b, vec3(i % 2u == 0u, u == 1u, true));
            let one = select(i, u, i > u);
            return whole.x + 10u * parts.x + 100u * parts.y + 1000u * parts.z + 10000u * one;
        }";
    check(code, |i, u| {
        let whole = if u > 3 { 4 } else { 1 };
        let x = if i % 2 == 0 { 4 } else { 1 };
        let y = if u == 1 { 1 } else { 2 };
        whole + 10 * x + 100 * y + 6000 + 10_000 * i.min(u)
    });
}

#[test]
fn swizzles_composition_and_splats() {
    let code = "
        fn test(i: u32, u: u32) -> u32 {
            let v = vec4(vec2(1u, 2u), i % 10u, u);
            let w = v.wzyx;
            let x = vec3(w.xx, v.g);
            var y = vec2<u32>(x.zy);
            y += vec2(1u);
            y = y.yx * 2u;
            let z = vec4(y, vec2(3u));
            return z.x + 100u * z.y + 10000u * z.z + 100000u * (v.rgb.b + w.yzw.x) + 10000000u * x.y;
        }";
    check(code, |i, u| 2 * (u + 1) + 600 + 30_000 + 100_000 * (2 * (i % 10)) + 10_000_000 * u);
}

#[test]
fn comparisons_of_vectors_with_all_and_any() {
    let code = "
        fn test(i: u32, u: u32) -> u32 {
            let a = vec3(i % 3u, u, 2u);
            let b = vec3(1u, 3u, 2u);
            let less = a < b;
            let flags = vec4(all(a == b), any(a == b), all(less), any(less));
            let more = vec3<u32>(a >= b) + vec3<u32>(a != b) * 2u + vec3<u32>(!(a > b) & less) * 4u
                + vec3<u32>(less | (a <= b)) * 8u;
            let f = vec4<u32>(flags);
            return f.x + 2u * f.y + 4u * f.z + 8u * f.w + 100u * (more.x + 16u * more.y + 256u * more.z);
        }";
    check(code, |i, u| {
        let (a, b) = ([i % 3, u, 2], [1, 3, 2]);
        let pairs = || a.into_iter().zip(b);
        let equal = pairs().filter(|(a, b)| a == b).count();
        let less = pairs().filter(|(a, b)| a < b).count();
        let flags = [equal == 3, equal > 0, less == 3, less > 0];
        let more = pairs().enumerate().map(|(k, (a, b))| {
            let bits = [a >= b, a != b, a < b, a <= b].map(u32::from);
            (bits[0] + 2 * bits[1] + 4 * bits[2] + 8 * bits[3]) << (4 * k)
        });
        (0..4).map(|k| u32::from(flags[k]) << k).sum::<u32>() + 100 * more.sum::<u32>()
    });
}

#[test]
fn booleans_in_variables_and_arrays() {
    let code = "
        fn test(i: u32, u: u32) -> u32 {
            var flags: array<bool, 4>;
            flags[u % 4u] = true;
            if i % 2u == 0u { flags[i % 4u] = !flags[i % 4u]; }
            var v = vec2<bool>(flags[0], flags[1]);
            v.y = v.y != flags[2];
            var r = u32(v.x) + 2u * u32(v.y) + 4u * u32(flags[3]);
            if v.x == v.y { r += 8u; }
            if flags[0] != flags[2] { r += 16u; }
            if f32(v.x) > 0.5 || i32(v.y) == 1 { r += 32u; }
            return r;
        }";
    check(code, |i, u| {
        let mut flags = [false; 4];
        flags[(u % 4) as usize] = true;
        if i % 2 == 0 {
            flags[(i % 4) as usize] ^= true;
        }
        let (x, y) = (flags[0], flags[1] != flags[2]);
        u32::from(x)
            + 2 * u32::from(y)
            + 4 * u32::from(flags[3])
            + 8 * u32::from(x == y)
            + 16 * u32::from(flags[0] != flags[2])
            + 32 * u32::from(x || y)
    });
}

#[test]
fn matrices_multiply_and_transpose() {
    let source = "
        @group(0) @binding(0) var<storage, read_write> out: array<f32>;
        @group(0) @binding(1) var<storage, read> numbers: array<f32>;
        @compute @workgroup_size(3) fn main(@builtin(local_invocation_index) i: u32) {
            let n = numbers[i];
            let a = mat3x2(vec2(n, 1.0), vec2(2.0, 3.0), vec2(4.0, 5.0));
            let b = mat2x3(vec3(1.0, n, 2.0), vec3(3.0, 4.0, 5.0));
            let ab = a * b;
            let ba = b * a;
            let t = transpose(a);
            let at = i * 10u;
            out[at] = ab[0].x; out[at + 1u] = ab[1].y;
            out[at + 2u] = ba[2].z; out[at + 3u] = ba[0].y;
            out[at + 4u] = (a * vec3(1.0, 2.0, 3.0)).y;
            out[at + 5u] = (vec2(10.0, n) * a).z;
            out[at + 6u] = t[1].z; out[at + 7u] = t[0].x;
            let sum = (a + a * 2.0 - 0.5 * a)[1];
            out[at + 8u] = sum.x; out[at + 9u] = sum.y;
        }";
    let inputs = [1.0f32, -3.0, 8.0];
    let buffers = [vec![0; 30], support::bits(&inputs)];
    let out = support::floats(&run_buffers(source, [1, 1, 1], &buffers)[0]);
    for (n, actual) in inputs.into_iter().zip(out.chunks(10)) {
        let expected = [
            n + 2.0 * n + 8.0,
            3.0 + 12.0 + 25.0,
            8.0 + 25.0,
            n * n + 4.0,
            1.0 + 6.0 + 15.0,
            40.0 + 5.0 * n,
            5.0,
            n,
            5.0,
            7.5,
        ];
        assert_eq!(actual, expected, "n = {n}");
    }
}

#[test]
fn determinants() {
    let source = "
        @group(0) @binding(0) var<storage, read_write> out: array<f32>;
        @group(0) @binding(1) var<storage, read> numbers: array<f32>;
        @compute @workgroup_size(3) fn main(@builtin(local_invocation_index) i: u32) {
            let n = numbers[i];
            out[i * 3u] = determinant(mat2x2(n, 2.0, 3.0, 4.0));
            out[i * 3u + 1u] = determinant(mat3x3(n, 2.0, 3.0, 0.0, 1.0, 4.0, 5.0, 6.0, 0.0));
            out[i * 3u + 2u] =
                determinant(mat4x4(n, 0.0, 0.0, 0.0, 9.0, 2.0, 0.0, 0.0, 8.0, 7.0, 3.0, 0.0, 6.0, 5.0, 4.0, 1.0));
        }";
    let inputs = [1.0f32, -3.0, 8.0];
    let out = support::floats(&run_buffers(source, [1, 1, 1], &[vec![0; 9], support::bits(&inputs)])[0]);
    let expected = inputs.map(|n| [4.0 * n - 6.0, 25.0 - 24.0 * n, 6.0 * n]);
    assert_eq!(out, expected.concat());
}
