//! Texels.

use std::sync::atomic::Ordering;

use super::{Bound, Lanes, Machine};
use crate::LANES;
use crate::op::Operand;
use crate::resource::{Channel, Texture};

impl<'a> Machine<'a> {
    pub(super) fn texture(&self, slot: u32) -> Option<&'a Texture> {
        match self.bound.get(slot as usize) {
            Some(Bound::Texture(texture)) => Some(texture),
            _ => None,
        }
    }

    /// Where each texel begins, in words; `u32::MAX` outside of the texture.
    #[inline(always)]
    pub(super) fn texel_words(&self, texture: &Texture, x: Operand, y: Operand, level: Operand, row: usize) -> Lanes {
        let words = texture.format().words() as u32;
        let (x, y) = (self.row(x, row), self.row(y, row));
        let mut first = [u32::MAX; LANES];
        if let Operand::Lane(_) = level {
            let level = self.row(level, row);
            for i in 0..LANES {
                let level = texture.levels.get(level[i] as usize);
                if let Some(level) = level.filter(|level| x[i] < level.width && y[i] < level.height) {
                    first[i] = level.first_word + (y[i] * level.width + x[i]) * words;
                }
            }
        } else if let Some(level) = texture.levels.get(self.scalar(level) as usize) {
            for i in 0..LANES {
                let inside = (x[i] < level.width) & (y[i] < level.height);
                let texel = y[i].wrapping_mul(level.width).wrapping_add(x[i]).wrapping_mul(words);
                first[i] = if inside { texel.wrapping_add(level.first_word) } else { u32::MAX };
            }
        }
        first
    }

    #[inline(always)]
    pub(super) fn texture_load(&mut self, to: [Option<u32>; 4], texture: u32, x: Operand, y: Operand, level: Operand) {
        let Some(texture) = self.texture(texture) else { return };
        let format = texture.format();
        for row in 0..self.rows {
            let first = self.texel_words(texture, x, y, level, row);
            let gather = |offset: u32| {
                let mut values = [0; LANES];
                for (value, first) in values.iter_mut().zip(first) {
                    let word = texture.words.get(first.wrapping_add(offset) as usize);
                    *value = if first == u32::MAX { 0 } else { word.map_or(0, |word| word.load(Ordering::Relaxed)) };
                }
                values
            };
            for (component, to) in to.into_iter().enumerate() {
                let Some(to) = to.map(|register| self.at(register, row)) else { continue };
                self.lanes[to] = if component < format.components() {
                    let (word, shift) = format.position(component);
                    decoded(format.channel(), gather(word as u32), shift, &first)
                } else {
                    [if component == 3 { format.channel().one() } else { 0 }; LANES]
                };
            }
        }
    }

    #[inline(always)]
    pub(super) fn texture_store(
        &mut self,
        texture: u32,
        x: Operand,
        y: Operand,
        texel: [Operand; 4],
        mask: Option<u32>,
    ) {
        let Some(texture) = self.texture(texture) else { return };
        let format = texture.format();
        for row in 0..self.rows {
            let mask = self.mask_row(mask, row);
            let first = self.texel_words(texture, x, y, Operand::Const(0), row);
            let values = texel.map(|operand| self.row(operand, row));
            let mut words = [[0; LANES]; 4];
            for (component, values) in values.iter().enumerate().take(format.components()) {
                let (word, shift) = format.position(component);
                encode(format.channel(), values, shift, &mut words[word]);
            }
            for i in 0..LANES {
                if mask[i] != 0 && first[i] != u32::MAX {
                    for (offset, word) in words[..format.words()].iter().enumerate() {
                        if let Some(cell) = texture.words.get(first[i] as usize + offset) {
                            cell.store(word[i], Ordering::Relaxed);
                        }
                    }
                }
            }
        }
    }
}

/// Components of texels from the words that hold them; 0 where there is no texel.
#[inline(always)]
fn decoded(channel: Channel, words: Lanes, shift: u32, first: &Lanes) -> Lanes {
    macro_rules! each {
        ($channel:expr) => {{
            let mut values = words;
            for i in 0..LANES {
                let value = $channel.decode(words[i] >> shift);
                values[i] = if first[i] == u32::MAX { 0 } else { value };
            }
            values
        }};
    }
    // One loop each, so that each is made of vector instructions.
    match channel {
        Channel::Float32 => each!(Channel::Float32),
        Channel::Float16 => each!(Channel::Float16),
        Channel::Uint(32) => each!(Channel::Uint(32)),
        other => each!(other),
    }
}

/// Adds components to the words of texels.
#[inline(always)]
fn encode(channel: Channel, values: &Lanes, shift: u32, words: &mut Lanes) {
    macro_rules! each {
        ($channel:expr) => {
            for i in 0..LANES {
                words[i] |= $channel.encode(values[i]) << shift;
            }
        };
    }
    match channel {
        Channel::Float16 => each!(Channel::Float16),
        other => each!(other),
    }
}
