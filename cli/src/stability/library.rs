//! Every case there is.

use super::case::Case;
use super::{extremes, geometry, time};

/// Frames of long runs.
pub const LONG: usize = 10_000;

/// All cases, by group. Long runs last `long` frames.
pub fn all(long: usize) -> Vec<Case> {
    let groups = [
        extremes::radiance(),
        extremes::hit_distance(),
        extremes::roughness(),
        extremes::normals(),
        extremes::settings(),
        geometry::depth(),
        geometry::motion(),
        geometry::cameras(),
        geometry::sizes(),
        time::changes(),
        time::sensitivity(),
        time::long(long),
    ];
    groups.into_iter().flatten().collect()
}
