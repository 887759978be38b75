//! `switch` where invocations agree and where they do not.

mod support;

use support::check;

#[test]
fn switch_with_default_in_the_middle() {
    let code = "
        fn test(i: u32, u: u32) -> u32 {
            var r = 1000u;
            switch u {
                case 0u, 3u { r += 1u; }
                case 6u { r += 2u; }
                default { r += 3u; }
                case 1u, 2u { r += i; }
            }
            return r;
        }";
    check(code, |i, u| {
        1000 + match u {
            0 | 3 => 1,
            6 => 2,
            1 | 2 => i,
            _ => 3,
        }
    });
}

#[test]
fn switch_with_default_among_values() {
    let code = "
        fn test(i: u32, u: u32) -> u32 {
            var r = 0u;
            switch u {
                case 1u { r = 1u; }
                case 2u, default, 5u { r = 2u; }
                case 7u { r = 3u; }
            }
            return r;
        }";
    check(code, |_, u| match u {
        1 => 1,
        7 => 3,
        _ => 2,
    });
}

#[test]
fn switch_with_only_a_default() {
    let code = "
        fn test(i: u32, u: u32) -> u32 {
            var r = 0u;
            switch u {
                default {
                    r = 1u;
                    if i % 2u == 0u { break; }
                    r = 2u;
                }
            }
            return r;
        }";
    check(code, |i, _| 1 + i % 2);
}

#[test]
fn break_inside_switch() {
    let code = "
        fn test(i: u32, u: u32) -> u32 {
            var r = 0u;
            switch u {
                case 0u { break; }
                case 1u, 2u {
                    r += 1u;
                    if i % 2u == 0u { break; }
                    r += 2u;
                    if u == 2u { break; }
                    r += 4u;
                }
                case 3u {
                    r += 8u;
                    if i % 3u == 0u { r += 16u; break; } else { r += 32u; }
                    r += 64u;
                }
                default { r = 7u; if u == 4u { break; } r += i; }
            }
            return r + 1000u;
        }";
    check(code, |i, u| {
        1000 + match u {
            0 => 0,
            1 | 2 if i % 2 == 0 => 1,
            1 => 7,
            2 => 3,
            3 if i % 3 == 0 => 24,
            3 => 104,
            4 => 7,
            _ => 7 + i,
        }
    });
}

#[test]
fn switch_selector_changed_by_a_case() {
    let code = "
        fn test(i: u32, u: u32) -> u32 {
            var s = u;
            var r = 0u;
            switch s {
                case 0u { s = 1u; r += 1u; }
                case 1u { s = 2u; r += 10u; }
                case 2u { s = 9u; r += 100u; }
                default { s = 0u; r += 1000u; }
            }
            return r + s;
        }";
    check(code, |_, u| match u {
        0 => 2,
        1 => 12,
        2 => 109,
        _ => 1000,
    });
}

#[test]
fn switch_on_signed_values() {
    let code = "
        fn test(i: u32, u: u32) -> u32 {
            switch i32(u) - 3 {
                case -3 { return 1u; }
                case -1, 0 { if i % 2u == 0u { return 2u; } }
                case 2147483647, -2147483648 { return 3u; }
                default { return 4u; }
            }
            return 5u;
        }";
    check(code, |i, u| match u {
        0 => 1,
        2 | 3 if i % 2 == 0 => 2,
        2 | 3 => 5,
        _ => 4,
    });
}

#[test]
fn nested_switch() {
    let code = "
        fn test(i: u32, u: u32) -> u32 {
            var r = 0u;
            switch u / 2u {
                case 0u {
                    switch i % 3u {
                        case 0u { r = 1u; break; }
                        case 1u { if u == 1u { return 99u; } r = 2u; }
                        default { }
                    }
                    r += 10u;
                }
                case 1u {
                    switch u { case 2u { r = 5u; } default { r = 6u; } }
                    if i % 2u == 1u { break; }
                    r += 20u;
                }
                default { r = 30u; }
            }
            return r;
        }";
    check(code, |i, u| match (u / 2, i % 3) {
        (0, 0) => 11,
        (0, 1) if u == 1 => 99,
        (0, 1) => 12,
        (0, _) => 10,
        (1, _) => u + 3 + 20 * (1 - i % 2),
        _ => 30,
    });
}
