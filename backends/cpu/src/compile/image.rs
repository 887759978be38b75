//! Textures and samplers.

use naga::{Expression, Handle, ImageQuery, SampleLevel, ScalarKind};

use super::{Compiler, Inlined, Result, Value, unsupported};
use crate::op::{Op, Operand, Sample, SampleLod, Unary};

impl<'a> Compiler<'a> {
    /// The binding of a texture or sampler.
    pub(super) fn resource(&self, frame: &Inlined<'a>, handle: Handle<Expression>) -> Result<u32> {
        let value = match &frame.function.expressions[handle] {
            Expression::GlobalVariable(global) => self.globals.get(global),
            Expression::FunctionArgument(index) => frame.arguments.get(*index as usize),
            _ => None,
        };
        match value {
            Some(Value::Resource(slot)) => Ok(*slot),
            _ => unsupported("a texture or sampler that is no global variable"),
        }
    }

    fn level(&mut self, frame: &mut Inlined<'a>, level: Option<Handle<Expression>>) -> Result<Operand> {
        level.map_or(Ok(Operand::Const(0)), |level| Ok(self.data(frame, level)?[0]))
    }

    /// Registers for the components of a texel that are wanted, and the value made of them.
    fn texel(&mut self, frame: &Inlined<'a>, handle: Handle<Expression>) -> Result<([Option<u32>; 4], Vec<Operand>)> {
        let count = self.count(&self.inner(frame, handle))? as usize;
        let wanted = frame.wanted_components.get(&handle).copied().unwrap_or([false; 4]);
        let to = [0, 1, 2, 3].map(|i| (i < count && wanted[i]).then(|| self.registers.allocate()));
        let value = to[..count].iter().map(|to| to.map_or(Operand::Const(0), Operand::Lane));
        Ok((to, value.collect()))
    }

    pub(super) fn image_load(&mut self, frame: &mut Inlined<'a>, handle: Handle<Expression>) -> Result<Vec<Operand>> {
        let Expression::ImageLoad { image, coordinate, array_index: None, sample: None, level } =
            frame.function.expressions[handle]
        else {
            return unsupported("a load from an array of textures or a multisampled texture");
        };
        let texture = self.resource(frame, image)?;
        let at = self.data(frame, coordinate)?;
        let level = self.level(frame, level)?;
        let (to, value) = self.texel(frame, handle)?;
        self.emit(Op::TextureLoad { to, texture, x: at[0], y: at[1], level, mask: self.mask });
        Ok(value)
    }

    pub(super) fn image_sample(&mut self, frame: &mut Inlined<'a>, handle: Handle<Expression>) -> Result<Vec<Operand>> {
        let Expression::ImageSample {
            image,
            sampler,
            gather,
            coordinate,
            array_index: None,
            offset,
            level,
            depth_ref,
            clamp_to_edge,
        } = frame.function.expressions[handle]
        else {
            return unsupported("a sample of an array of textures");
        };
        let (texture, sampler) = (self.resource(frame, image)?, self.resource(frame, sampler)?);
        let at = self.data(frame, coordinate)?;
        let offset = match offset {
            None => [0; 2],
            Some(offset) => match self.data(frame, offset)?[..] {
                [Operand::Const(x), Operand::Const(y)] => [x.cast_signed(), y.cast_signed()],
                _ => return unsupported("an offset of texels that is not constant"),
            },
        };
        // A level that is an integer is converted.
        let mut converted = None;
        let lod = match level {
            SampleLevel::Zero => SampleLod::Exact(Operand::Const(0)),
            SampleLevel::Exact(level) => {
                let operand = self.data(frame, level)?[0];
                let op = match self.kind(frame, level)? {
                    ScalarKind::Sint => Some(Unary::IntToFloat),
                    ScalarKind::Uint => Some(Unary::UintToFloat),
                    _ => None,
                };
                converted = op.map(|op| self.unary(op, operand));
                SampleLod::Exact(converted.unwrap_or(operand))
            }
            SampleLevel::Gradient { x, y } => {
                let (x, y) = (self.data(frame, x)?, self.data(frame, y)?);
                SampleLod::Gradient([x[0], x[1], y[0], y[1]])
            }
            SampleLevel::Auto | SampleLevel::Bias(_) => return unsupported("a sample with implicit derivatives"),
        };
        let reference = depth_ref.map(|reference| self.data(frame, reference)).transpose()?.map(|operands| operands[0]);
        let (to, value) = self.texel(frame, handle)?;
        self.emit(Op::TextureSample(Box::new(Sample {
            to,
            texture,
            sampler,
            at: [at[0], at[1]],
            offset,
            lod,
            reference,
            gather: gather.map(|component| component as usize),
            clamp_to_edge,
            mask: self.mask,
        })));
        self.release(converted.as_slice());
        Ok(value)
    }

    pub(super) fn image_query(
        &mut self,
        frame: &mut Inlined<'a>,
        image: Handle<Expression>,
        query: ImageQuery,
    ) -> Result<Vec<Operand>> {
        let texture = self.resource(frame, image)?;
        match query {
            ImageQuery::Size { level } => {
                let level = self.level(frame, level)?;
                let to = [self.result(&[level]), self.result(&[level])];
                self.emit(Op::TextureSize { to, texture, level });
                Ok(to.to_vec())
            }
            ImageQuery::NumLevels => {
                let to = self.scalar();
                self.emit(Op::TextureLevels { to, texture });
                Ok(vec![to])
            }
            other => unsupported(format!("image query {other:?}")),
        }
    }
}
