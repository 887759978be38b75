//! Values in a frame that no renderer should write.

use std::fmt;

use super::Frame;

/// How many values of each image of a frame are NaN or infinite. Shown as text it names the
/// images that have any.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct InputWarnings {
    /// Radiance, rgb.
    pub radiance: usize,
    /// Hit distance.
    pub hit_distance: usize,
    /// Normal, xyz.
    pub normal: usize,
    /// Roughness.
    pub roughness: usize,
    /// Depth.
    pub depth: usize,
    /// Motion, xy.
    pub motion: usize,
    /// Motion of what was hit, xyz.
    pub hit_motion: usize,
    /// Reference, rgb.
    pub reference: usize,
}

impl InputWarnings {
    pub(super) fn of(frame: &Frame) -> Self {
        fn count<'a>(values: impl Iterator<Item = &'a f32>) -> usize {
            values.filter(|x| !x.is_finite()).count()
        }
        Self {
            radiance: count(frame.radiance.iter().flat_map(|x| &x[..3])),
            hit_distance: count(frame.radiance.iter().map(|x| &x[3])),
            normal: count(frame.normal.iter().flatten()),
            roughness: count(frame.roughness.iter()),
            depth: count(frame.depth.iter()),
            motion: count(frame.motion.iter().flatten()),
            hit_motion: count(frame.hit_motion.iter().flatten().flatten()),
            reference: count(frame.reference.iter().flatten().flatten()),
        }
    }

    /// Whether there is nothing to warn of.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

impl fmt::Display for InputWarnings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_empty() {
            return f.write_str("all values are finite");
        }
        f.write_str("values that are NaN or infinite:")?;
        let counts = [
            ("radiance", self.radiance),
            ("hit_distance", self.hit_distance),
            ("normal", self.normal),
            ("roughness", self.roughness),
            ("depth", self.depth),
            ("motion", self.motion),
            ("hit_motion", self.hit_motion),
            ("reference", self.reference),
        ];
        let mut separator = " ";
        for (name, count) in counts.into_iter().filter(|(_, count)| *count > 0) {
            write!(f, "{separator}{name} {count}")?;
            separator = ", ";
        }
        Ok(())
    }
}
