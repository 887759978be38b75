//! `if` and `return` where invocations agree and where they do not.

mod support;

use support::check;

#[test]
fn nested_if_else() {
    let code = "
        fn test(i: u32, u: u32) -> u32 {
            var r = 0u;
            if u < 4u {
                r = 1u;
                if i % 2u == 0u {
                    r += 10u;
                } else {
                    r += 20u;
                    if u == 2u { r += 100u; }
                }
                r *= 3u;
            } else if u == 5u {
                r = 50u + i;
            } else {
                if i > 3u { r = 6u; }
                r += 7u;
            }
            return r;
        }";
    check(code, |i, u| match u {
        0..=3 if i % 2 == 0 => 33,
        2 => 363,
        0..=3 => 63,
        5 => 50 + i,
        _ if i > 3 => 13,
        _ => 7,
    });
}

#[test]
fn condition_changed_by_its_own_branch() {
    let code = "
        fn test(i: u32, u: u32) -> u32 {
            var c = u;
            var r = 0u;
            if c > 3u { c = 0u; r += 1u; } else { c = 9u; r += 2u; }
            if c > 3u { r += 10u; } else { r += 20u; }
            return r;
        }";
    check(code, |_, u| if u > 3 { 21 } else { 12 });
}

#[test]
fn empty_branches() {
    let code = "
        fn test(i: u32, u: u32) -> u32 {
            var r = i;
            if u > 3u { } else { r += 1u; }
            if i % 2u == 1u { r += 10u; } else { }
            if u == 1u { } else { }
            return r;
        }";
    check(code, |i, u| i + u32::from(u <= 3) + 10 * (i % 2));
}

#[test]
fn short_circuit_operators() {
    let code = "
        var<private> calls: u32;
        fn note(value: bool) -> bool { calls += 1u; return value; }
        fn test(i: u32, u: u32) -> u32 {
            calls = 0u;
            var r = 0u;
            if u > 3u && note(i % 2u == 0u) { r += 1u; }
            if u > 5u || note(i % 3u == 0u) { r += 2u; }
            if (u > 2u && i > 2u) || !(u == 0u) { r += 4u; }
            return r * 10u + calls;
        }";
    check(code, |i, u| {
        let mut calls = 0;
        let mut note = |value| {
            calls += 1;
            value
        };
        let mut r = 0;
        if u > 3 && note(i % 2 == 0) {
            r += 1;
        }
        if u > 5 || note(i % 3 == 0) {
            r += 2;
        }
        if u != 0 {
            r += 4;
        }
        r * 10 + calls
    });
}

#[test]
fn early_return_at_several_depths() {
    let code = "
        var<private> trace: u32;
        fn inner(i: u32, u: u32) {
            trace = trace * 10u + 1u;
            if u == 0u { return; }
            if i % 2u == 0u {
                if u == 1u { return; }
                trace = trace * 10u + 2u;
                if i % 4u == 0u {
                    if u < 4u { trace = trace * 10u + 3u; return; }
                    trace = trace * 10u + 4u;
                }
                trace = trace * 10u + 5u;
            } else {
                if u > 5u { return; }
            }
            trace = trace * 10u + 6u;
        }
        fn test(i: u32, u: u32) -> u32 {
            trace = 0u;
            inner(i, u);
            trace = trace * 10u + 9u;
            return trace;
        }";
    check(code, |i, u| {
        let digits: &[u32] = match (u, i % 4) {
            (0, _) | (1, 0 | 2) => &[1, 9],
            (2 | 3, 0) => &[1, 2, 3, 9],
            (_, 0) => &[1, 2, 4, 5, 6, 9],
            (_, 2) => &[1, 2, 5, 6, 9],
            (6.., _) => &[1, 9],
            _ => &[1, 6, 9],
        };
        digits.iter().fold(0, |number, digit| number * 10 + digit)
    });
}

#[test]
fn return_in_both_branches() {
    let code = "
        fn test(i: u32, u: u32) -> u32 {
            if u > 2u {
                if i % 2u == 0u { return 1u; } else { return 2u; }
            } else {
                return 3u;
            }
        }";
    check(code, |i, u| if u > 2 { 1 + i % 2 } else { 3 });
}
