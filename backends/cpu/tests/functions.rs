//! Functions of a kernel: arguments, pointers, results.

mod support;

use support::check;

#[test]
fn called_several_times_with_different_arguments() {
    let code = "
        fn scale(x: u32, by: u32) -> u32 {
            var r = x * by;
            if by > 3u { r += 1u; }
            return r;
        }
        fn test(i: u32, u: u32) -> u32 {
            let a = scale(i, u);
            let b = scale(u, 2u);
            let c = scale(scale(i, 3u), scale(u, 4u));
            return scale(a, 5u) + b * 7u + c;
        }";
    let scale = |x: u32, by: u32| x * by + u32::from(by > 3);
    check(code, |i, u| scale(scale(i, u), 5) + scale(u, 2) * 7 + scale(scale(i, 3), scale(u, 4)));
}

#[test]
fn locals_start_anew_with_every_call() {
    let code = "
        fn count(upto: u32) -> u32 {
            var zero: u32;
            var list: array<u32, 3>;
            for (var k = 0u; k < upto; k++) { zero += 1u; list[k % 3u] += k; }
            return zero + 100u * list[0] + 10000u * list[2];
        }
        fn test(i: u32, u: u32) -> u32 {
            var sum = 0u;
            for (var k = 0u; k < 3u; k++) { sum += count(u + k); }
            return sum + count(i % 4u);
        }";
    let count = |upto: u32| {
        let list = |slot| (0..upto).filter(|k| k % 3 == slot).sum::<u32>();
        upto + 100 * list(0) + 10_000 * list(2)
    };
    check(code, |i, u| count(u) + count(u + 1) + count(u + 2) + count(i % 4));
}

#[test]
fn pointer_arguments() {
    let code = "
        fn add(target_: ptr<function, u32>, value: u32) { *target_ = *target_ + value; }
        fn exchange(a: ptr<function, u32>, b: ptr<function, u32>) {
            let old = *a;
            *a = *b;
            *b = old;
        }
        fn divide(a: u32, b: u32, quotient: ptr<function, u32>, remainder: ptr<function, u32>) -> bool {
            *quotient = 0u;
            if b == 0u { return false; }
            *quotient = a / b;
            *remainder = a % b;
            return true;
        }
        fn test(i: u32, u: u32) -> u32 {
            var a = u;
            var b = i;
            add(&a, i);
            if i % 2u == 0u { exchange(&a, &b); } else { add(&b, 3u); }
            var q = 77u;
            var r = 78u;
            if divide(a + 20u, u, &q, &r) { add(&q, 1u); }
            return ((a * 31u + b) * 31u + q) * 31u + r;
        }";
    check(code, |i, u| {
        let (mut a, mut b) = (u + i, i);
        if i % 2 == 0 {
            (a, b) = (b, a);
        } else {
            b += 3;
        }
        let q = (a + 20).checked_div(u).map_or(0, |quotient| quotient + 1);
        let r = (a + 20).checked_rem(u).unwrap_or(78);
        ((a * 31 + b) * 31 + q) * 31 + r
    });
}

#[test]
fn pointers_to_parts_and_through_several_functions() {
    let code = "
        struct Pair { first: u32, second: vec3<u32> }
        fn bump(p: ptr<function, u32>) { *p += 1u; }
        fn bump_twice(p: ptr<function, u32>) { bump(p); bump(p); }
        fn work(p: ptr<function, Pair>, by: u32) {
            if by == 2u { return; }
            (*p).second = (*p).second * by;
            (*p).first += (*p).second.y;
        }
        fn first(list: ptr<function, array<u32, 4>>, at: u32) -> u32 {
            (*list)[at] += 10u;
            return (*list)[(at + 1u) % 4u];
        }
        fn test(i: u32, u: u32) -> u32 {
            var pair = Pair(i, vec3(1u, 2u, 3u));
            var list = array(1u, 2u, 3u, 4u);
            work(&pair, u);
            work(&pair, i % 3u);
            let next = first(&list, u % 4u);
            var whole = pair.first;
            bump_twice(&whole);
            return whole + pair.second.z * 1000u + next * 100000u + list[u % 4u] * 1000000u;
        }";
    check(code, |i, u| {
        let (mut first, mut second) = (i, [1, 2, 3]);
        for by in [u, i % 3] {
            if by != 2 {
                second = second.map(|value| value * by);
                first += second[1];
            }
        }
        first + 2 + second[2] * 1000 + ((u + 1) % 4 + 1) * 100_000 + (u % 4 + 11) * 1_000_000
    });
}

#[test]
fn early_returns_with_results_from_nested_flow() {
    let code = "
        fn find(limit: u32, want: u32) -> u32 {
            for (var k = 0u; k < limit; k++) {
                if k * k > want { return k; }
                switch k {
                    case 2u { if want == 7u { return 70u; } }
                    default { }
                }
            }
            if want > 4u { return 50u; }
            return 60u;
        }
        fn test(i: u32, u: u32) -> u32 {
            var r = find(i % 5u, u);
            if r > 50u { r = find(r % 4u, i % 9u) + 1000u; }
            return r;
        }";
    let find = |limit: u32, want: u32| {
        for k in 0..limit {
            if k * k > want {
                return k;
            }
            if k == 2 && want == 7 {
                return 70;
            }
        }
        if want > 4 { 50 } else { 60 }
    };
    check(code, |i, u| match find(i % 5, u) {
        r if r > 50 => find(r % 4, i % 9) + 1000,
        r => r,
    });
}

#[test]
fn results_drive_divergent_flow() {
    let code = "
        fn is_even(i: u32) -> bool { return i % 2u == 0u; }
        fn pick(i: u32, u: u32) -> u32 {
            if is_even(i) { return u; }
            if is_even(u) { return i % 4u; }
            return 3u;
        }
        fn test(i: u32, u: u32) -> u32 {
            var r = 0u;
            switch pick(i, u) {
                case 0u { r = 1u; }
                case 1u, 2u { for (var k = 0u; k < pick(u, i); k++) { r += 3u; if pick(k, u) == 2u { break; } } }
                default { if is_even(pick(i + 1u, u)) { r = 9u; } else { return 8u; } }
            }
            return r + 100u * pick(u, u);
        }";
    let pick = |i: u32, u: u32| match (i % 2, u % 2) {
        (0, _) => u,
        (_, 0) => i % 4,
        _ => 3,
    };
    check(code, |i, u| {
        let mut r = 0;
        match pick(i, u) {
            0 => r = 1,
            1 | 2 => {
                for k in 0..pick(u, i) {
                    r += 3;
                    if pick(k, u) == 2 {
                        break;
                    }
                }
            }
            _ if pick(i + 1, u) % 2 == 0 => r = 9,
            _ => return 8,
        }
        r + 100 * pick(u, u)
    });
}

#[test]
fn structs_arrays_and_matrices_as_arguments_and_results() {
    let code = "
        struct Inner { at: vec2<u32>, list: array<u32, 3> }
        struct Outer { inner: Inner, m: mat2x3<f32>, flag: bool }
        fn make(i: u32, flag: bool) -> Outer {
            var o: Outer;
            o.flag = flag;
            if !flag { return o; }
            o.inner = Inner(vec2(i, 2u), array(3u, i, 5u));
            o.m = mat2x3(vec3(f32(i)), vec3(1.0, 2.0, 3.0));
            return o;
        }
        fn total(o: Outer) -> u32 {
            let column = o.m * vec2(1.0, 10.0);
            return o.inner.at.x + o.inner.at.y * 3u + o.inner.list[1] * 5u + o.inner.list[2] * 7u
                + u32(column.z) * 11u + select(0u, 1u, o.flag);
        }
        fn test(i: u32, u: u32) -> u32 {
            let a = make(i, u > 3u);
            var b = make(u, i % 2u == 0u);
            b.inner.list[u % 3u] = a.inner.at.x;
            return total(a) * 1000u + total(b);
        }";
    let total = |at: [u32; 2], list: [u32; 3], z: u32, flag: bool| {
        at[0] + at[1] * 3 + list[1] * 5 + list[2] * 7 + z * 11 + u32::from(flag)
    };
    check(code, |i, u| {
        let (first, second) = (u > 3, i % 2 == 0);
        let a = if first { total([i, 2], [3, i, 5], i + 30, true) } else { 0 };
        let mut list = if second { [3, u, 5] } else { [0; 3] };
        list[(u % 3) as usize] = if first { i } else { 0 };
        let b = if second { total([u, 2], list, u + 30, true) } else { total([0; 2], list, 0, false) };
        a * 1000 + b
    });
}

#[test]
fn a_function_without_result_returns_early_in_loops() {
    let code = "
        var<private> log_: u32;
        fn walk(from_: u32, step: u32) {
            var at = from_;
            loop {
                log_ = log_ * 3u + at;
                if at > 6u { return; }
                loop {
                    at += step;
                    if at % 2u == 0u { break; }
                    if at > 11u { log_ += 1u; return; }
                }
            }
        }
        fn test(i: u32, u: u32) -> u32 {
            log_ = 0u;
            walk(i % 4u, u + 1u);
            if i % 3u == 0u { walk(u, 3u); }
            return log_;
        }";
    fn walk(mut at: u32, step: u32, log: &mut u32) {
        loop {
            *log = *log * 3 + at;
            if at > 6 {
                return;
            }
            loop {
                at += step;
                if at.is_multiple_of(2) {
                    break;
                }
                if at > 11 {
                    *log += 1;
                    return;
                }
            }
        }
    }
    check(code, |i, u| {
        let mut log = 0;
        walk(i % 4, u + 1, &mut log);
        if i % 3 == 0 {
            walk(u, 3, &mut log);
        }
        log
    });
}

#[test]
fn a_pointer_to_a_private_variable() {
    let code = "
        var<private> shared_: array<u32, 3>;
        fn raise(p: ptr<private, array<u32, 3>>, at: u32) { (*p)[at % 3u] += 1u; }
        fn test(i: u32, u: u32) -> u32 {
            shared_ = array(0u, 0u, 0u);
            raise(&shared_, i);
            if i % 2u == 0u { raise(&shared_, u); }
            return shared_[0] + 10u * shared_[1] + 100u * shared_[2];
        }";
    check(code, |i, u| 10u32.pow(i % 3) + if i % 2 == 0 { 10u32.pow(u % 3) } else { 0 });
}
