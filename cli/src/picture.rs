//! Pictures to look at: tone-mapped 8-bit images, put side by side and written as PNG.

use std::io;
use std::path::Path;

use glam::UVec2;
use image::{ImageFormat, Rgb, RgbImage};

use crate::metrics;
use crate::sequence::write_atomically;

/// The colour of pixels that are NaN or infinite.
const MAGENTA: Rgb<u8> = Rgb([255, 0, 255]);

/// The colour between pictures.
const GAP: Rgb<u8> = Rgb([32, 32, 32]);

/// Pixels between pictures.
const GAP_WIDTH: u32 = 4;

/// Linear radiance as it is viewed: times `exposure`, tone-mapped by `x / (1 + x)`, sRGB-encoded.
/// Negative values are black, pixels with a NaN or infinite value magenta.
///
/// # Panics
/// When `radiance` does not have `size.x * size.y` pixels.
pub fn tone_map(radiance: &[[f32; 3]], size: UVec2, exposure: f32) -> RgbImage {
    encode(radiance, size, |x| metrics::tone_map(f64::from(x * exposure).max(0.0).min(f64::from(f32::MAX))))
}

/// Linear colours, 0 to 1, sRGB-encoded.
///
/// # Panics
/// When `colors` does not have `size.x * size.y` pixels.
pub fn display(colors: &[[f32; 3]], size: UVec2) -> RgbImage {
    encode(colors, size, |x| f64::from(x).clamp(0.0, 1.0))
}

/// A linear colour, 0 to 1, sRGB-encoded.
pub(crate) fn srgb(color: [f32; 3]) -> Rgb<u8> {
    Rgb(color.map(|x| srgb_byte(f64::from(x))))
}

fn srgb_byte(linear: f64) -> u8 {
    (metrics::srgb_encode(linear) * 255.0).round() as u8
}

fn encode(pixels: &[[f32; 3]], size: UVec2, shown: impl Fn(f32) -> f64) -> RgbImage {
    assert_eq!(pixels.len(), size.x as usize * size.y as usize, "image size must agree");
    let mut picture = RgbImage::new(size.x, size.y);
    for (pixel, rgb) in picture.pixels_mut().zip(pixels) {
        *pixel = match rgb.iter().all(|x| x.is_finite()) {
            true => Rgb(rgb.map(|x| srgb_byte(shown(x)))),
            false => MAGENTA,
        };
    }
    picture
}

/// Pictures in one row, a thin gap between them.
pub fn side_by_side(pictures: &[RgbImage]) -> RgbImage {
    film_strip(pictures, pictures.len())
}

/// Pictures in rows of `columns`, a thin gap between them. Each cell is as large as the largest
/// picture; smaller ones sit at its top left.
pub fn film_strip(pictures: &[RgbImage], columns: usize) -> RgbImage {
    let columns = columns.clamp(1, pictures.len().max(1));
    let rows = pictures.len().div_ceil(columns);
    let width = pictures.iter().map(RgbImage::width).max().unwrap_or(0);
    let height = pictures.iter().map(RgbImage::height).max().unwrap_or(0);
    let total = |count: usize, side: u32| match count as u32 {
        0 => 0,
        count => count * (side + GAP_WIDTH) - GAP_WIDTH,
    };
    let mut strip = RgbImage::from_pixel(total(columns.min(pictures.len()), width), total(rows, height), GAP);
    for (i, picture) in pictures.iter().enumerate() {
        let x = (i % columns) as i64 * i64::from(width + GAP_WIDTH);
        let y = (i / columns) as i64 * i64::from(height + GAP_WIDTH);
        image::imageops::replace(&mut strip, picture, x, y);
    }
    strip
}

/// Writes a PNG file, which appears whole or not at all.
pub fn write_png(path: &Path, picture: &RgbImage) -> io::Result<()> {
    write_atomically(path, |file| picture.write_to(file, ImageFormat::Png).map_err(io::Error::other))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn radiance_becomes_srgb() {
        let radiance = [[0.0, 1.0, -1.0], [f32::NAN, 0.0, 0.0], [f32::MAX, 3.0, 1e-5]];
        let picture = tone_map(&radiance, UVec2::new(3, 1), 1.0);
        // 1 -> 0.5 -> sRGB 187.5 of 255; 3 -> 0.75 -> 224.6.
        let expected = [[0, 188, 0], [255, 0, 255], [255, 225, 0]];
        assert!(picture.pixels().map(|p| p.0).eq(expected));
    }

    #[test]
    fn strips_keep_every_picture() {
        let picture = |w, h, grey| RgbImage::from_pixel(w, h, Rgb([grey; 3]));
        let pictures = [picture(5, 3, 1), picture(4, 3, 2), picture(5, 2, 3)];
        let strip = film_strip(&pictures, 2);
        assert_eq!(strip.dimensions(), (14, 10));
        assert_eq!(strip.get_pixel(0, 0).0, [1; 3]);
        assert_eq!(*strip.get_pixel(5, 0), GAP);
        assert_eq!(strip.get_pixel(9, 0).0, [2; 3]);
        assert_eq!(strip.get_pixel(4, 8).0, [3; 3]);
        assert_eq!(side_by_side(&pictures).dimensions(), (23, 3));
        assert_eq!(side_by_side(&[]).dimensions(), (0, 0));
    }
}
