//! Indices that are known only when running.

mod support;

use support::check;

#[test]
fn dynamic_index_into_a_local_array() {
    let code = "
        fn test(i: u32, u: u32) -> u32 {
            var list = array(10u, 20u, 30u, 40u, 50u);
            list[u % 5u] = 1u;
            if i % 2u == 0u { list[i % 5u] += 2u; }
            for (var k = 0u; k < 4u; k++) { list[k + 1u] += list[k]; }
            return list[(i + u) % 5u] * 1000u + list[4];
        }";
    check(code, |i, u| {
        let mut list = [10, 20, 30, 40, 50];
        list[(u % 5) as usize] = 1;
        if i % 2 == 0 {
            list[(i % 5) as usize] += 2;
        }
        for k in 0..4 {
            list[k + 1] += list[k];
        }
        list[((i + u) % 5) as usize] * 1000 + list[4]
    });
}

#[test]
fn dynamic_index_into_constants() {
    let code = "
        const table = array(3u, 1u, 4u, 1u, 5u, 9u, 2u, 6u);
        const vectors = array(vec2(1u, 2u), vec2(3u, 4u), vec2(5u, 6u));
        fn test(i: u32, u: u32) -> u32 {
            let local = array(vec3(7u, 8u, 9u), vec3(4u, 5u, 6u));
            let v = vectors[i % 3u];
            return table[u] + 10u * table[i % 8u] + 100u * v.y + 1000u * vectors[u % 3u].x
                + 10000u * local[i % 2u][u % 3u];
        }";
    check(code, |i, u| {
        let table = [3, 1, 4, 1, 5, 9, 2, 6];
        let local = [[7, 8, 9], [4, 5, 6]];
        table[u as usize]
            + 10 * table[(i % 8) as usize]
            + 100 * (i % 3 * 2 + 2)
            + 1000 * (u % 3 * 2 + 1)
            + 10_000 * local[(i % 2) as usize][(u % 3) as usize]
    });
}

#[test]
fn dynamic_index_into_vectors() {
    let code = "
        fn test(i: u32, u: u32) -> u32 {
            var v = vec4(1u, 2u, 3u, 4u);
            let value = vec3(i, u, 7u);
            v[u % 4u] = 9u;
            if i % 3u == 0u { v[i % 4u] = value[i % 3u]; }
            v[2] += 1u;
            return v[(i + 1u) % 4u] + 1000u * value[u % 3u] + 1000000u * (v.x + v.y * 2u + v.z * 3u + v.w * 5u);
        }";
    check(code, |i, u| {
        let mut v = [1, 2, 3, 4];
        v[(u % 4) as usize] = 9;
        if i % 3 == 0 {
            v[(i % 4) as usize] = i;
        }
        v[2] += 1;
        let value = [i, u, 7][(u % 3) as usize];
        v[((i + 1) % 4) as usize]
            .wrapping_add(1000 * value)
            .wrapping_add((v[0] + v[1] * 2 + v[2] * 3 + v[3] * 5).wrapping_mul(1_000_000))
    });
}

#[test]
fn dynamic_index_into_matrices() {
    let code = "
        fn test(i: u32, u: u32) -> u32 {
            var m = mat3x2(1.0, 2.0, 3.0, 4.0, 5.0, 6.0);
            m[u % 3u] = vec2(7.0, 8.0);
            if i % 2u == 1u { m[i % 3u] *= 2.0; }
            m[1].y += 1.0;
            let c = m[(i + u) % 3u];
            return u32(c.x) + 100u * u32(c[i % 2u]) + 10000u * u32(m[2].y);
        }";
    check(code, |i, u| {
        let mut m = [[1, 2], [3, 4], [5, 6]];
        m[(u % 3) as usize] = [7, 8];
        if i % 2 == 1 {
            let column = &mut m[(i % 3) as usize];
            *column = column.map(|value| value * 2);
        }
        m[1][1] += 1;
        let c = m[((i + u) % 3) as usize];
        c[0] + 100 * c[(i % 2) as usize] + 10_000 * m[2][1]
    });
}

#[test]
fn dynamic_index_into_an_array_of_structs_and_then_a_constant_one() {
    let code = "
        struct S { n: u32, v: vec3<u32>, inner: array<u32, 2> }
        fn test(i: u32, u: u32) -> u32 {
            var list: array<S, 3>;
            for (var k = 0u; k < 3u; k++) { list[k].n = k + 1u; list[k].v = vec3(k, 10u, 20u + k); }
            list[u % 3u].v.y = i;
            list[i % 3u].inner[1] = 5u;
            list[(i + 1u) % 3u] = S(8u, vec3(9u), array(1u, 2u));
            let s = list[u % 3u];
            return s.n + 10u * s.v.z + 1000u * s.v.y + 1000000u * list[i % 3u].inner[1] + 10000000u * s.inner[0];
        }";
    check(code, |i, u| {
        let (at, replaced) = (u % 3, (i + 1) % 3);
        let (n, y, z, inner) = if at == replaced { (8, 9, 9, 1) } else { (at + 1, i, 20 + at, 0) };
        n + 10 * z + 1000 * y + 5_000_000 + 10_000_000 * inner
    });
}

#[test]
fn dynamic_index_out_of_bounds_stays_inside() {
    let code = "
        fn test(i: u32, u: u32) -> u32 {
            var before = 11u;
            var list = array(1u, 1u, 1u);
            var after = 22u;
            list[u + i] = 5u;
            let value = list[i * 1000u + 3u];
            let inside = value == 1u || value == 5u || value == 0u;
            return select(0u, 1u, inside) + before * 10u + after * 1000u;
        }";
    check(code, |_, _| 22_111);
}
