//! `limpid cost` tells what RADV's compiler makes of each pass.

use std::process::{Command, Output};

use glam::UVec2;
use limpid::{Plan, Settings};
use limpid_cli::cost::{Cost, Driver};

mod tools;

fn cost(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_limpid")).arg("cost").args(arguments).output().unwrap()
}

fn costs(arguments: &[&str]) -> Vec<Cost> {
    let output = cost(&[&["--json"], arguments].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn total(cost: &Cost, statistic: &str) -> f64 {
    cost.passes.iter().map(|pass| pass.get(statistic).unwrap()).sum()
}

#[test]
fn passes_cost_registers_and_instructions_on_gpus_that_are_not_here() {
    if let Err(error) = Driver::find(None) {
        return tools::skip(&error.to_string());
    }
    let (plan, _) = Plan::new(&Settings::default(), UVec2::splat(64)).unwrap();
    let all = costs(&["--gpu", "vega10,navi21"]);
    assert_eq!(all.iter().map(|cost| cost.gpu.as_str()).collect::<Vec<_>>(), ["vega10", "navi21"]);
    for cost in &all {
        let passes: Vec<_> = cost.passes.iter().map(|pass| pass.pass.as_str()).collect();
        assert_eq!(passes, plan.passes.iter().map(|pass| pass.name.as_str()).collect::<Vec<_>>());
        for pass in &cost.passes {
            let [registers, waves, instructions] =
                ["VGPRs", "Subgroups per SIMD", "Instructions"].map(|name| pass.get(name).unwrap());
            assert!((1.0..=256.0).contains(&registers) && waves >= 1.0 && instructions > 10.0, "{pass:?}");
        }
    }
    // Other machines, other code.
    assert_ne!(all[0].passes, all[1].passes);
    let fewer = costs(&["--gpu", "navi21", "--features", "-outlier_spread,-spatial_filter"]);
    assert!(fewer[0].passes.iter().all(|pass| !pass.pass.starts_with("block_spread")));
    assert!(total(&fewer[0], "Instructions") < 0.8 * total(&all[1], "Instructions"));

    let output = cost(&["--gpu", "navi21"]);
    let table = String::from_utf8(output.stdout).unwrap();
    assert!(
        table.contains("VGPRs") && table.contains("GB/s") && table.lines().count() == 3 + plan.passes.len(),
        "{table}"
    );
}

#[test]
fn what_is_missing_is_named() {
    let fails = |arguments: &[&str], expected: &str| {
        let output = cost(arguments);
        let errors = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(1) && errors.contains(expected), "{arguments:?}: {errors}");
    };
    fails(&["--driver", "/nowhere/radeon_icd.json"], "/nowhere/radeon_icd.json");
    if Driver::find(None).is_ok() {
        fails(&["--gpu", "voodoo2"], "voodoo2");
    }
}
