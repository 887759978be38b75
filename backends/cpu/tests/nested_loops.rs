//! Loops in loops, in switches and in branches.

mod support;

use support::check;

#[test]
fn nested_loops_with_break_and_continue_of_each() {
    let code = "
        fn test(i: u32, u: u32) -> u32 {
            var r = 0u;
            for (var a = 0u; a < 5u; a++) {
                if a == u { continue; }
                for (var b = 0u; b < 4u; b++) {
                    if (a + b + i) % 4u == 0u { continue; }
                    r = r * 3u + b;
                    if r % 7u == 5u { break; }
                }
                r += 1u;
                if r > 5000u + 200u * u { break; }
            }
            return r;
        }";
    check(code, |i, u| {
        let mut r = 0;
        for a in 0..5 {
            if a == u {
                continue;
            }
            for b in 0..4 {
                if (a + b + i) % 4 == 0 {
                    continue;
                }
                r = r * 3 + b;
                if r % 7 == 5 {
                    break;
                }
            }
            r += 1;
            if r > 5000 + 200 * u {
                break;
            }
        }
        r
    });
}

#[test]
fn break_inside_if_inside_loop_inside_divergent_if() {
    let code = "
        fn test(i: u32, u: u32) -> u32 {
            var r = 0u;
            if i % 2u == 0u {
                for (var k = 0u; k < 8u; k++) {
                    if k >= u {
                        if k > 2u { r += 100u; break; } else { r += 1000u; }
                    }
                    r += 1u;
                }
            } else {
                for (var k = 0u; k < 3u; k++) { r += u; }
            }
            return r;
        }";
    check(code, |i, u| {
        let mut r = 0;
        if i % 2 == 0 {
            for k in 0..8 {
                if k >= u {
                    if k > 2 {
                        r += 100;
                        break;
                    }
                    r += 1000;
                }
                r += 1;
            }
        } else {
            r = 3 * u;
        }
        r
    });
}

#[test]
fn return_from_inside_loops() {
    let code = "
        fn test(i: u32, u: u32) -> u32 {
            var r = 0u;
            for (var a = 0u; a < 4u; a++) {
                for (var b = 0u; b < 4u; b++) {
                    r += 1u;
                    if a * 4u + b == i % 20u { return 500u + r; }
                    if u == 2u && b == 1u { break; }
                }
                if a == u { return 900u + r; }
                r += 10u;
            }
            return r;
        }";
    check(code, |i, u| {
        let mut r = 0;
        for a in 0..4 {
            for b in 0..4 {
                r += 1;
                if a * 4 + b == i % 20 {
                    return 500 + r;
                }
                if u == 2 && b == 1 {
                    break;
                }
            }
            if a == u {
                return 900 + r;
            }
            r += 10;
        }
        r
    });
}

#[test]
fn switch_inside_loop_with_continue_and_break() {
    let code = "
        fn test(i: u32, u: u32) -> u32 {
            var r = 0u;
            for (var k = 0u; k < 8u; k++) {
                switch (k + i) % 5u {
                    case 0u { r += 1u; break; }
                    case 1u { r += 10u; continue; }
                    case 2u { if u > 4u { continue; } r += 100u; }
                    case 3u { if k == u { return r + 500000u; } }
                    default { }
                }
                r += 1000u;
                if k == 6u && u == 7u { break; }
            }
            return r;
        }";
    check(code, |i, u| {
        let mut r = 0;
        for k in 0..8 {
            match (k + i) % 5 {
                0 => r += 1,
                1 => {
                    r += 10;
                    continue;
                }
                2 if u > 4 => continue,
                2 => r += 100,
                3 if k == u => return r + 500_000,
                _ => {}
            }
            r += 1000;
            if k == 6 && u == 7 {
                break;
            }
        }
        r
    });
}

#[test]
fn switch_on_the_loop_counter_with_divergent_breaks() {
    let code = "
        fn test(i: u32, u: u32) -> u32 {
            var r = 0u;
            for (var k = 0u; k < 6u; k++) {
                switch k {
                    case 1u, 4u { if i % 2u == 0u { break; } r += 10u; }
                    case 2u { if i % 3u == 0u { continue; } r += 100u; }
                    default { r += u; }
                }
                r = r * 2u + 1u;
            }
            return r;
        }";
    check(code, |i, u| {
        let mut r = 0;
        for k in 0..6 {
            match k {
                1 | 4 => r += if i % 2 == 0 { 0 } else { 10 },
                2 if i % 3 == 0 => continue,
                2 => r += 100,
                _ => r += u,
            }
            r = r * 2 + 1;
        }
        r
    });
}

#[test]
fn loop_inside_switch_inside_loop() {
    let code = "
        fn test(i: u32, u: u32) -> u32 {
            var r = 0u;
            for (var a = 0u; a < 4u; a++) {
                switch a {
                    case 1u {
                        loop {
                            r += 1u;
                            if r > i % 9u { break; }
                        }
                    }
                    case 2u {
                        for (var b = 0u; b < u; b++) { if b == 3u { continue; } r += 20u; }
                        if i % 2u == 1u { continue; }
                    }
                    default { r += 1u; }
                }
                r += 1000u;
            }
            return r;
        }";
    check(code, |i, u| {
        let mut r = 1001;
        r += 1;
        while r <= i % 9 {
            r += 1;
        }
        r += 1000;
        r += 20 * (u - u32::from(u > 3)) + if i % 2 == 1 { 0 } else { 1000 };
        r + 1001
    });
}
