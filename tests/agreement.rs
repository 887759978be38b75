//! All backends leave the same in memory.

use glam::UVec2;
use limpid_harness::{Case, Pixel, Table, executors};

#[test]
fn smoke() {
    let case = Case::still(UVec2::new(40, 24), 3, |frame, p| {
        let noise = (p.x * 7919 + p.y * 104_729 + frame * 31) % 17;
        Pixel { radiance: [noise as f32 / 8.0, 0.5, 0.25, 3.0], ..Pixel::WALL }
    });
    let mut all = executors();
    let runs: Vec<_> = all.iter_mut().map(|executor| case.run(executor.as_mut())).collect();
    for (run, executor) in runs.iter().zip(&all) {
        let mut table = Table::default();
        for (a, b) in runs[0].iter().zip(run) {
            table.add(a, b);
        }
        println!("{}\n{table}", executor.name());
    }
}
