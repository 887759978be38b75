//! The colour spaces FLIP works in.
//!
//! YCxCz is the opponent space in which the eye's contrast sensitivity is known; CIELab, with its
//! chroma scaled by lightness (the Hunt effect), is the space in which colour distance is measured.

use glam::{Mat3, Vec3};

/// Linear sRGB to CIE XYZ (D65).
const XYZ_FROM_RGB: Mat3 = Mat3::from_cols_array(&[
    0.412_386_56,
    0.212_636_82,
    0.019_330_62,
    0.357_591_49,
    0.715_182_98,
    0.119_197_16,
    0.180_450_49,
    0.072_180_2,
    0.950_372_6,
]);

/// CIE XYZ (D65) to linear sRGB, the inverse of [`XYZ_FROM_RGB`].
const RGB_FROM_XYZ: Mat3 = Mat3::from_cols_array(&[
    3.241_003_3,
    -0.969_224_3,
    0.055_639_42,
    -1.537_398_9,
    1.875_93,
    -0.204_011_21,
    -0.498_615_9,
    0.041_554_23,
    1.057_148_9,
]);

/// XYZ of the reference white: linear RGB 1, 1, 1.
const WHITE: Vec3 = Vec3::new(0.950_428_55, 1.0, 1.088_900_3);

/// sRGB-encoded values 0 to 1 to linear ones.
fn srgb_decode(rgb: [f32; 3]) -> Vec3 {
    Vec3::from(rgb.map(|x| if x <= 0.040_45 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }))
}

/// sRGB-encoded colour to YCxCz: Y is 0 to 100, Cx red-green, Cz blue-yellow.
pub(super) fn ycxcz_from_srgb(rgb: [f32; 3]) -> Vec3 {
    let p = XYZ_FROM_RGB * srgb_decode(rgb) / WHITE;
    Vec3::new(116.0 * p.y - 16.0, 500.0 * (p.x - p.y), 200.0 * (p.y - p.z))
}

/// YCxCz to linear RGB, unclamped.
pub(super) fn rgb_from_ycxcz(c: Vec3) -> Vec3 {
    let y = (c.x + 16.0) / 116.0;
    RGB_FROM_XYZ * (Vec3::new(y + c.y / 500.0, y, y - c.z / 200.0) * WHITE)
}

/// Linear RGB 0 to 1 to CIELab with a\* and b\* scaled by L\* / 100.
pub(super) fn hunt_lab_from_rgb(rgb: Vec3) -> Vec3 {
    const DELTA: f32 = 6.0 / 29.0;
    let f = |t: f32| {
        if t > DELTA * DELTA * DELTA { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
    };
    let p = XYZ_FROM_RGB * rgb / WHITE;
    let (x, y, z) = (f(p.x), f(p.y), f(p.z));
    let lightness = 116.0 * y - 16.0;
    let hunt = 0.01 * lightness;
    Vec3::new(lightness, hunt * 500.0 * (x - y), hunt * 200.0 * (y - z))
}
