//! LDR-FLIP, the difference a viewer notices when two images alternate in place.
//!
//! After P. Andersson, J. Nilsson, T. Akenine-Möller, M. Oskarsson, K. Åström, M. D. Fairchild:
//! "FLIP: A Difference Evaluator for Alternating Images", Proc. ACM Comput. Graph. Interact. Tech.
//! 3 (2), 2020. Constants are the paper's.

use glam::{UVec2, Vec3};
use rayon::prelude::*;
use std::f64::consts::PI;

use super::colour::{hunt_lab_from_rgb, rgb_from_ycxcz, ycxcz_from_srgb};
use super::filter::{Kernel, Plane};

/// Pixels per degree of visual angle: a 0.7 m wide display of 3840 pixels seen from 0.7 m.
const PIXELS_PER_DEGREE: f64 = 3840.0 * PI / 180.0;

/// FLIP per pixel, 0 (no difference) to 1 (largest), between two sRGB-encoded images with values
/// 0 to 1, at 67 pixels per degree.
///
/// # Panics
/// When an image does not have `size.x * size.y` pixels.
pub fn flip(reference: &[[f32; 3]], test: &[[f32; 3]], size: UVec2) -> Vec<f32> {
    let pixels = size.x as usize * size.y as usize;
    assert!(reference.len() == pixels && test.len() == pixels, "image sizes must agree");
    if pixels == 0 {
        return Vec::new();
    }
    let filters = Filters::new();
    let (reference, test) = rayon::join(|| Seen::new(reference, size, &filters), || Seen::new(test, size, &filters));
    let largest = colour_distance(hunt_lab_from_rgb(Vec3::Y), hunt_lab_from_rgb(Vec3::Z));
    (0..pixels)
        .into_par_iter()
        .map(|i| {
            let colour = redistribute(colour_distance(reference.lab[i], test.lab[i]), largest);
            let edge = (reference.edge[i] - test.edge[i]).abs();
            let point = (reference.point[i] - test.point[i]).abs();
            let feature = (edge.max(point) * std::f32::consts::FRAC_1_SQRT_2).sqrt();
            colour.powf(1.0 - feature)
        })
        .collect()
}

/// HyAB distance, compressed.
fn colour_distance(a: Vec3, b: Vec3) -> f32 {
    let d = a - b;
    (d.x.abs() + d.y.hypot(d.z)).powf(0.7)
}

/// Distances 0 to `largest` onto 0 to 1, the most room given to the smaller ones.
fn redistribute(distance: f32, largest: f32) -> f32 {
    const KNEE: f32 = 0.4;
    const KNEE_VALUE: f32 = 0.95;
    let knee = KNEE * largest;
    if distance < knee {
        distance * KNEE_VALUE / knee
    } else {
        KNEE_VALUE + (distance - knee) / (largest - knee) * (1.0 - KNEE_VALUE)
    }
}

/// A Gaussian of the contrast sensitivity functions: `a * sqrt(pi / b) * exp(-pi^2 d^2 / b)` at
/// `d` degrees.
struct Sensitivity {
    kernel: Kernel,
    /// Sum over the unnormalised 2D kernel, its share where Gaussians are added.
    weight: f64,
}

impl Sensitivity {
    /// The widest Gaussian of the table; its extent is used for all.
    const WIDEST: f64 = 0.04;

    fn new(a: f64, b: f64) -> Self {
        let radius = (3.0 * (Self::WIDEST / (2.0 * PI * PI)).sqrt() * PIXELS_PER_DEGREE).ceil() as i32;
        let gaussian = |x: f64| (-(PI * x / PIXELS_PER_DEGREE).powi(2) / b).exp();
        let sum: f64 = (-radius..=radius).map(|x| gaussian(f64::from(x))).sum();
        Self { kernel: Kernel::new(radius, gaussian), weight: a * (PI / b).sqrt() * sum * sum }
    }

    fn apply(&self, plane: &Plane) -> Vec<f32> {
        plane.rows(&self.kernel).columns(&self.kernel).values
    }
}

struct Filters {
    luminance: Sensitivity,
    red_green: Sensitivity,
    blue_yellow: [Sensitivity; 2],
    gaussian: Kernel,
    edge: Kernel,
    point: Kernel,
}

impl Filters {
    fn new() -> Self {
        // Feature detectors: the width of an edge as the eye sees it is 0.082 degrees.
        let sigma = 0.5 * 0.082 * PIXELS_PER_DEGREE;
        let radius = (3.0 * sigma).ceil() as i32;
        let gaussian = |x: f64| (-x * x / (2.0 * sigma * sigma)).exp();
        Self {
            luminance: Sensitivity::new(1.0, 0.0047),
            red_green: Sensitivity::new(1.0, 0.0053),
            blue_yellow: [Sensitivity::new(34.1, 0.04), Sensitivity::new(13.5, 0.025)],
            gaussian: Kernel::new(radius, gaussian),
            edge: Kernel::new(radius, |x| -x * gaussian(x)),
            point: Kernel::new(radius, |x| (x * x / (sigma * sigma) - 1.0) * gaussian(x)),
        }
    }
}

/// An image as the eye sees it.
struct Seen {
    /// Colours after contrast sensitivity, Hunt-adjusted CIELab.
    lab: Vec<Vec3>,
    /// Strength of the edge through each pixel.
    edge: Vec<f32>,
    /// Strength of the point at each pixel.
    point: Vec<f32>,
}

impl Seen {
    fn new(image: &[[f32; 3]], size: UVec2, filters: &Filters) -> Self {
        let opponent: Vec<Vec3> = image.par_iter().map(|&rgb| ycxcz_from_srgb(rgb)).collect();
        let plane = |f: fn(&Vec3) -> f32| Plane { size, values: opponent.iter().map(f).collect() };
        let (edge, point) = features(&plane(|c| (c.x + 16.0) / 116.0), filters);

        let y = filters.luminance.apply(&plane(|c| c.x));
        let cx = filters.red_green.apply(&plane(|c| c.y));
        let cz = plane(|c| c.z);
        let [wide, narrow] = &filters.blue_yellow;
        let share = (wide.weight / (wide.weight + narrow.weight)) as f32;
        let (wide, narrow) = (wide.apply(&cz), narrow.apply(&cz));
        let lab = (0..image.len())
            .into_par_iter()
            .map(|i| {
                let cz = share * wide[i] + (1.0 - share) * narrow[i];
                let rgb = rgb_from_ycxcz(Vec3::new(y[i], cx[i], cz));
                hunt_lab_from_rgb(rgb.clamp(Vec3::ZERO, Vec3::ONE))
            })
            .collect();
        Self { lab, edge, point }
    }
}

/// Gradient magnitude and second-derivative magnitude of a grey image.
fn features(grey: &Plane, filters: &Filters) -> (Vec<f32>, Vec<f32>) {
    let magnitude = |x: Plane, y: Plane| {
        let pairs = x.values.into_par_iter().zip(y.values);
        pairs.map(|(x, y)| x.hypot(y)).collect()
    };
    let smooth = grey.rows(&filters.gaussian);
    let across = |kernel: &Kernel| grey.rows(kernel).columns(&filters.gaussian);
    (
        magnitude(across(&filters.edge), smooth.columns(&filters.edge)),
        magnitude(across(&filters.point), smooth.columns(&filters.point)),
    )
}
