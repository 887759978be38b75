//! Loops that invocations leave at different times.

mod support;

use support::check;

#[test]
fn each_lane_has_its_own_trip_count() {
    let code = "
        fn test(i: u32, u: u32) -> u32 {
            var sum = 0u;
            for (var k = 0u; k < u + i % 5u; k++) { sum += k * k + 1u; }
            return sum;
        }";
    check(code, |i, u| (0..u + i % 5).map(|k| k * k + 1).sum());
}

#[test]
fn while_with_break_and_continue() {
    let code = "
        fn test(i: u32, u: u32) -> u32 {
            var k = 0u;
            var sum = 0u;
            while k < 20u {
                k += 1u;
                if k % 3u == u % 3u { continue; }
                sum += k;
                if sum > 10u + i % 40u { break; }
                sum += 100u;
            }
            return sum * 100u + k;
        }";
    check(code, |i, u| {
        let (mut k, mut sum) = (0, 0);
        while k < 20 {
            k += 1;
            if k % 3 == u % 3 {
                continue;
            }
            sum += k;
            if sum > 10 + i % 40 {
                break;
            }
            sum += 100;
        }
        sum * 100 + k
    });
}

#[test]
fn break_if_in_continuing() {
    let code = "
        fn test(i: u32, u: u32) -> u32 {
            var k = 0u;
            var r = 0u;
            loop {
                if k % 2u == 1u { continue; }
                r += 1u;
                if r == 4u && u == 3u { break; }
                continuing {
                    let before = k;
                    k += 1u;
                    r += 10u;
                    break if before >= i % 6u + u;
                }
            }
            return r * 100u + k;
        }";
    check(code, |i, u| {
        let (mut k, mut r) = (0, 0);
        loop {
            if k % 2 == 0 {
                r += 1;
                if r == 4 && u == 3 {
                    break;
                }
            }
            let before = k;
            k += 1;
            r += 10;
            if before >= i % 6 + u {
                break;
            }
        }
        r * 100 + k
    });
}

#[test]
fn uniform_counters_declared_outside_of_divergent_code() {
    let code = "
        fn test(i: u32, u: u32) -> u32 {
            var count = 0u;
            var k = 0u;
            loop {
                if k >= 6u { break; }
                if i % 3u == 1u { count += k; }
                k += 1u;
            }
            // What was uniform so far is changed by some.
            if i % 2u == 0u { k = 100u; }
            return count * 1000u + k;
        }";
    check(code, |i, _| u32::from(i % 3 == 1) * 15_000 + if i % 2 == 0 { 100 } else { 6 });
}

#[test]
fn loop_that_only_returns_leave() {
    let code = "
        fn test(i: u32, u: u32) -> u32 {
            var r = i;
            loop {
                r += 3u;
                if r % 7u == u % 7u { return r; }
            }
            return 0u;
        }";
    check(code, |i, u| (1..).map(|n| i + 3 * n).find(|r| r % 7 == u % 7).unwrap());
}

#[test]
fn variables_inside_of_loops_start_anew() {
    let code = "
        fn test(i: u32, u: u32) -> u32 {
            var total = 0u;
            for (var k = 0u; k < 4u; k++) {
                var fresh: u32;
                var seeded = k + u;
                if i % 2u == 0u { fresh += 5u; }
                fresh += 1u;
                seeded += fresh;
                total = total * 7u + seeded;
            }
            return total;
        }";
    check(code, |i, u| (0..4).fold(0, |total, k| total * 7 + k + u + if i % 2 == 0 { 6 } else { 1 }));
}

#[test]
fn values_from_before_a_loop_survive_it() {
    let code = "
        fn test(i: u32, u: u32) -> u32 {
            let a = i * 3u + 1u;
            let b = a ^ u;
            var x = u;
            let before = x;
            for (var k = 0u; k < 3u + i % 3u; k++) {
                let c = a + k;
                x = c + x * 2u + b;
                if x % 5u == 0u { x += before; }
            }
            return x + a * before + b;
        }";
    check(code, |i, u| {
        let a = i * 3 + 1;
        let b = a ^ u;
        let mut x = u;
        for k in 0..3 + i % 3 {
            x = a + k + x * 2 + b;
            if x % 5 == 0 {
                x += u;
            }
        }
        x + a * u + b
    });
}

#[test]
fn uniform_variable_becomes_varying_on_a_later_round() {
    let code = "
        fn test(i: u32, u: u32) -> u32 {
            var a = 1u;
            var b = 2u;
            var c = 3u;
            for (var k = 0u; k < 5u; k++) {
                a = b;
                b = c;
                if k == u { c = i; } else { c += 1u; }
            }
            return a * 10000u + b * 100u + c;
        }";
    check(code, |i, u| {
        let (mut a, mut b, mut c) = (1, 2, 3);
        for k in 0..5 {
            a = b;
            b = c;
            c = if k == u { i } else { c + 1 };
        }
        a * 10_000 + b * 100 + c
    });
}

#[test]
fn return_before_a_uniform_break() {
    let code = "
        fn test(i: u32, u: u32) -> u32 {
            var k = 0u;
            loop {
                if i % 8u <= k * 3u { return 100u + k; }
                k += 1u;
                if k == 2u { break; }
            }
            return k;
        }";
    check(code, |i, _| match i % 8 {
        0 => 100,
        1..=3 => 101,
        _ => 2,
    });
    // The same where all return before the break.
    let code = "
        fn test(i: u32, u: u32) -> u32 {
            var k = 0u;
            loop {
                if i % 4u <= k { return 100u + k; }
                k += 1u;
                if k == 5u { break; }
            }
            return k;
        }";
    check(code, |i, _| 100 + i % 4);
}
