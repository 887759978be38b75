//! The probe's view of each instruction, before it runs.

use super::Machine;
use crate::LANES;
use crate::eval;
use crate::op::{Binary, Memory, Op, Operand, Unary};
use crate::probe::{Moment, Recorder, Shadow, exact_binary, exact_unary, packs};

/// Shadows of all registers, and what was seen.
#[derive(Debug, Default)]
pub(crate) struct Probing {
    lanes: Vec<[Shadow; LANES]>,
    scalars: Vec<Shadow>,
    pub(crate) recorder: Recorder,
}

impl Probing {
    pub(crate) fn new(lanes: usize, scalars: usize) -> Self {
        Self {
            lanes: vec![[Shadow::default(); LANES]; lanes],
            scalars: vec![Shadow::default(); scalars],
            recorder: Recorder::default(),
        }
    }
}

impl Machine<'_> {
    /// The shadow of an operand in a lane: what was computed for it, unless the register was written otherwise.
    fn shadow(&self, probing: &Probing, operand: Operand, row: usize, lane: usize) -> Shadow {
        let (bits, shadow) = match operand {
            Operand::Const(bits) => return Shadow::anew(bits),
            Operand::Scalar(register) => (self.scalars[register as usize], probing.scalars[register as usize]),
            Operand::Lane(register) => {
                let at = self.at(register, row);
                (self.lanes[at][lane], probing.lanes[at][lane])
            }
        };
        if shadow.bits == bits { shadow } else { Shadow::anew(bits) }
    }

    /// Calls `look` for each value of an instruction, once for a scalar, else for each lane, and keeps the shadow
    /// that it gives. Without one the value begins anew.
    fn each(
        &mut self,
        to: Option<Operand>,
        mask: Option<u32>,
        look: impl Fn(&Self, &mut Probing, usize, Moment) -> Option<Shadow>,
    ) {
        let Some(mut probing) = self.probing.take() else { return };
        let instruction = self.current;
        if let Some(Operand::Scalar(register)) = to {
            let at = Moment { instruction, invocation: 0, is_active: true };
            probing.scalars[register as usize] = look(self, &mut probing, 0, at).unwrap_or_default();
            self.probing = Some(probing);
            return;
        }
        let invocations = self.code.workgroup_size.iter().product::<u32>() as usize;
        for row in 0..self.rows {
            let active = self.mask_row(mask, row);
            for (lane, active) in active.into_iter().enumerate() {
                let invocation = row * LANES + lane;
                let is_active = invocation < invocations && active != 0;
                let shadow = look(self, &mut probing, row, Moment { instruction, invocation, is_active });
                if let Some(Operand::Lane(register)) = to {
                    let at = self.at(register, row);
                    probing.lanes[at][lane] = shadow.unwrap_or_default();
                }
            }
        }
        self.probing = Some(probing);
    }

    /// Follows an instruction that is about to run.
    #[cold]
    pub(super) fn probe(&mut self, op: &Op) {
        let code = self.code;
        let span = |instruction: usize| code.spans[instruction].to_range().map(|range| range.start);
        let mask = code.masks[self.current];
        match *op {
            Op::Unary { op: Unary::Copy, to, a } => {
                self.each(Some(to), None, |m, probing, row, at| Some(m.shadow(probing, a, row, at.invocation % LANES)));
            }
            Op::Unary { op, to, a } => self.each(Some(to), mask, |m, probing, row, at| {
                let a = m.shadow(probing, a, row, at.invocation % LANES);
                if packs(op) {
                    probing.recorder.output(at, span, a);
                }
                let exact = exact_unary(op, a)?;
                let bits = eval::unary(op, a.bits);
                Some(probing.recorder.note(at, span, (bits, exact), &[a], false))
            }),
            Op::Binary { op, to, a, b } => self.each(Some(to), mask, |m, probing, row, at| {
                let lane = at.invocation % LANES;
                let (a, b) = (m.shadow(probing, a, row, lane), m.shadow(probing, b, row, lane));
                let exact = exact_binary(op, a, b)?;
                let bits = eval::binary(op, a.bits, b.bits);
                let is_sum = matches!(op, Binary::AddF | Binary::SubF);
                Some(probing.recorder.note(at, span, (bits, exact), &[a, b], is_sum))
            }),
            Op::Fma { to, a, b, c } => self.each(Some(to), mask, |m, probing, row, at| {
                let [a, b, c] = [a, b, c].map(|operand| m.shadow(probing, operand, row, at.invocation % LANES));
                let value = eval::f(a.bits).mul_add(eval::f(b.bits), eval::f(c.bits));
                let exact = a.exact.mul_add(b.exact, c.exact);
                Some(probing.recorder.note(at, span, (value.to_bits(), exact), &[a, b, c], true))
            }),
            Op::Select { to, condition, a, b } => self.each(Some(to), None, |m, probing, row, at| {
                let lane = at.invocation % LANES;
                let taken = if m.shadow(probing, condition, row, lane).bits != 0 { a } else { b };
                Some(m.shadow(probing, taken, row, lane))
            }),
            Op::Assign { to, a, mask } => self.each(Some(to), mask, |m, probing, row, at| {
                let source = if at.is_active { a } else { to };
                Some(m.shadow(probing, source, row, at.invocation % LANES))
            }),
            Op::Store { memory: Memory::Buffer(_) | Memory::Halves(_), a, mask, .. } => {
                self.each(None, mask, |m, probing, row, at| {
                    let a = m.shadow(probing, a, row, at.invocation % LANES);
                    probing.recorder.output(at, span, a);
                    None
                });
            }
            Op::TextureStore { texel, mask, .. } => self.each(None, mask, |m, probing, row, at| {
                for operand in texel {
                    let value = m.shadow(probing, operand, row, at.invocation % LANES);
                    probing.recorder.output(at, span, value);
                }
                None
            }),
            _ => written(op).into_iter().for_each(|to| self.each(Some(to), None, |_, _, _, _| None)),
        }
    }
}

/// Registers that are written by instructions which compute no float.
fn written(op: &Op) -> Vec<Operand> {
    let lanes = |to: &[Option<u32>]| to.iter().flatten().map(|register| Operand::Lane(*register)).collect();
    match *op {
        Op::BuiltIn { to, .. }
        | Op::ReadIndexed { to, .. }
        | Op::Table { to, .. }
        | Op::Load { to, .. }
        | Op::ArrayLength { to, .. }
        | Op::TextureLevels { to, .. } => vec![to],
        Op::TextureSize { to, .. } => to.to_vec(),
        Op::TextureLoad { to, .. } => lanes(&to),
        Op::TextureSample(ref sample) => lanes(&sample.to),
        Op::Atomic { to, .. } => lanes(&[to]),
        Op::Subgroup { to, .. } => lanes(&[Some(to)]),
        Op::WriteIndexed { base, stride, count, .. } => (0..count)
            .map(|index| match base {
                Operand::Lane(register) => Operand::Lane(register + stride * index),
                Operand::Scalar(register) => Operand::Scalar(register + stride * index),
                constant => constant,
            })
            .collect(),
        _ => Vec::new(),
    }
}
