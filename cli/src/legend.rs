//! Legends of debug views, drawn below pictures so that they go where the pictures go.

use font8x8::{BASIC_FONTS, UnicodeFonts};
use image::{Rgb, RgbImage};
use limpid::{DebugView, Key};

use crate::picture;

const PAPER: Rgb<u8> = Rgb([32, 32, 32]);
const INK: Rgb<u8> = Rgb([230, 230, 230]);

// In units of a glyph's pixels, which grow with the picture.
const GLYPH: u32 = 8;
const MARGIN: u32 = 4;
const LINE: u32 = 12;
/// Least width from one stop of a ramp to the next.
const STOP: u32 = 56;
/// Widths of pictures that each unit of a pixel more is for.
const WIDTH_PER_UNIT: u32 = 1000;

fn text_width(text: &str) -> u32 {
    text.chars().count() as u32 * GLYPH
}

fn stop_width(ramp: &[Key]) -> u32 {
    ramp.iter().map(|key| text_width(key.label) + 2 * GLYPH).max().unwrap_or(0).max(STOP)
}

/// Where the keys go that follow each other and begin new lines where they do not fit: x, line, key.
fn flow(keys: &[Key], width: u32) -> Vec<(u32, u32, Key)> {
    let (mut x, mut line) = (MARGIN, 0);
    let place = |key: &Key| {
        let needed = LINE + text_width(key.label) + 2 * MARGIN;
        if x > MARGIN && x + needed > width {
            (x, line) = (MARGIN, line + 1);
        }
        x += needed;
        (x - needed, line, *key)
    };
    keys.iter().map(place).collect()
}

struct Sheet {
    image: RgbImage,
    unit: u32,
    top: u32,
}

impl Sheet {
    /// Fills a rectangle; the colour is a function of how far to the right.
    fn fill(&mut self, [x, y, width, height]: [u32; 4], color: impl Fn(f32) -> Rgb<u8>) {
        let (unit, top) = (self.unit, self.top);
        for (i, j) in (0..width * unit).flat_map(|i| (0..height * unit).map(move |j| (i, j))) {
            let share = (i as f32 + 0.5) / (width * unit) as f32;
            self.image.put_pixel(x * unit + i, top + y * unit + j, color(share));
        }
    }

    fn text(&mut self, x: u32, y: u32, text: &str) {
        for (index, glyph) in text.chars().map(|c| BASIC_FONTS.get(c).unwrap_or_default()).enumerate() {
            let is_ink = |&(i, j): &(u32, u32)| glyph[j as usize] >> i & 1 == 1;
            for (i, j) in (0..GLYPH).flat_map(|i| (0..GLYPH).map(move |j| (i, j))).filter(is_ink) {
                self.fill([x + index as u32 * GLYPH + i, y + j, 1, 1], |_| INK);
            }
        }
    }

    fn ramp(&mut self, y: u32, ramp: &[Key]) {
        let (stop, first) = (stop_width(ramp), MARGIN + stop_width(ramp) / 2);
        for (index, pair) in ramp.windows(2).enumerate() {
            let mixed = |t| std::array::from_fn(|i| pair[0].color[i] + (pair[1].color[i] - pair[0].color[i]) * t);
            self.fill([first + index as u32 * stop, y, stop, GLYPH], |t| picture::srgb(mixed(t)));
        }
        for (index, key) in ramp.iter().enumerate() {
            let middle = first + index as u32 * stop;
            self.text(middle - text_width(key.label) / 2, y + GLYPH + 2, key.label);
        }
    }
}

/// A picture with the legend of the view in it below.
pub(crate) fn with_legend(picture: &RgbImage, view: Option<DebugView>) -> RgbImage {
    let Some(legend) = view.map(DebugView::legend) else { return picture.clone() };
    let unit = picture.width().div_ceil(WIDTH_PER_UNIT).max(1);
    let longest = legend.keys.iter().map(|key| LINE + text_width(key.label)).max().unwrap_or(0);
    let ramp_width = legend.ramp.len() as u32 * stop_width(legend.ramp);
    let needed = 2 * MARGIN + longest.max(text_width(legend.title)).max(ramp_width);
    let width = (picture.width() / unit).max(needed);
    let keys = flow(legend.keys, width);
    let ramp_height = if legend.ramp.is_empty() { 0 } else { 2 * LINE };
    let keys_height = keys.last().map_or(0, |(_, line, _)| (line + 1) * LINE);
    let height = 2 * MARGIN + LINE + ramp_height + keys_height;

    let image = RgbImage::from_pixel((width * unit).max(picture.width()), picture.height() + height * unit, PAPER);
    let mut sheet = Sheet { image, unit, top: picture.height() };
    image::imageops::replace(&mut sheet.image, picture, 0, 0);
    sheet.text(MARGIN, MARGIN, legend.title);
    sheet.ramp(MARGIN + LINE, legend.ramp);
    for (x, line, key) in keys {
        let y = MARGIN + LINE + ramp_height + line * LINE;
        sheet.fill([x, y, GLYPH, GLYPH], |_| picture::srgb(key.color));
        sheet.text(x + LINE, y, key.label);
    }
    sheet.image
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_view_has_all_its_colours_below_a_picture_of_any_size() {
        for (_, view) in DebugView::ALL {
            for width in [1, 320, 3000] {
                let plain = RgbImage::from_pixel(width, 7, Rgb([1, 2, 3]));
                let explained = with_legend(&plain, Some(*view));
                assert!(plain.enumerate_pixels().all(|(x, y, pixel)| explained.get_pixel(x, y) == pixel));
                let legend = view.legend();
                let drawn =
                    |color| explained.pixels().skip(explained.width() as usize * 7).any(|pixel| *pixel == color);
                assert!(legend.keys.iter().all(|key| drawn(picture::srgb(key.color))), "{view:?} {width}");
                assert!(drawn(INK));
            }
        }
        let plain = RgbImage::new(3, 3);
        assert_eq!(with_legend(&plain, None), plain);
    }
}
