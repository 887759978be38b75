//! Sampled textures.

use super::{Bound, Machine};
use crate::LANES;
use crate::eval::f;
use crate::op::{Sample, SampleLod};
use crate::sampler::{Lod, Sampler, Sampling};

impl Machine<'_> {
    fn sampler(&self, slot: u32) -> Option<Sampler> {
        match self.bound.get(slot as usize) {
            Some(Bound::Sampler(sampler)) => Some(*sampler),
            _ => None,
        }
    }

    pub(super) fn sample(&mut self, op: &Sample) {
        let (Some(texture), Some(sampler)) = (self.texture(op.texture), self.sampler(op.sampler)) else { return };
        let mut reads = Vec::new();
        for row in 0..self.rows {
            let mask = self.mask_row(op.mask, row);
            let [x, y] = op.at.map(|operand| self.row(operand, row));
            let reference = op.reference.map(|operand| self.row(operand, row));
            let lod = match op.lod {
                SampleLod::Exact(operand) => [self.row(operand, row); 4],
                SampleLod::Gradient(operands) => operands.map(|operand| self.row(operand, row)),
            };
            let mut texels = [[0; LANES]; 4];
            for i in (0..LANES).filter(|&i| mask[i] != 0) {
                let mut at = [f(x[i]), f(y[i])];
                if op.clamp_to_edge {
                    let half = texture.size().map(|size| 0.5 / size as f32);
                    at = [0, 1].map(|axis| at[axis].max(half[axis]).min(1.0 - half[axis]));
                }
                let reference = reference.map(|reference| f(reference[i]));
                reads.clear();
                let mut sampling = Sampling { sampler, texture, at, offset: op.offset, reference, reads: &mut reads };
                let texel = match (op.gather, op.lod) {
                    (Some(component), _) => sampling.gather(component),
                    (None, SampleLod::Exact(_)) => sampling.sample(Lod::Exact(f(lod[0][i]))).map(f32::to_bits),
                    (None, SampleLod::Gradient(_)) => {
                        let [dx, dy] = [[0, 1], [2, 3]].map(|axis| axis.map(|part: usize| f(lod[part][i])));
                        sampling.sample(Lod::Gradient([dx, dy])).map(f32::to_bits)
                    }
                };
                if self.checker.as_ref().is_some_and(|checker| checker.is_written(op.texture)) {
                    self.check_reads(op.texture, &reads, row * LANES + i);
                }
                for (values, component) in texels.iter_mut().zip(texel) {
                    values[i] = component;
                }
            }
            for (to, values) in op.to.into_iter().zip(texels) {
                if let Some(to) = to {
                    let to = self.at(to, row);
                    self.lanes[to] = values;
                }
            }
        }
    }
}
