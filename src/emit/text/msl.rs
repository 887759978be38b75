//! Metal Shading Language.

use naga::{AtomicFunction, ImageQuery, Literal, MathFunction, ScalarKind, TypeInner};
use serde::{Deserialize, Serialize};

use super::heading::Note;
use super::language::{Helper, Language, Operand, Text, c_literal, call, common_function, is_integer, is_unsigned};
use super::words;
use crate::Error;
use crate::kernel::{Binding, BindingKind, Kernel};
use crate::resource::Access;

/// How to write Metal. Buffers and textures are numbered apart, in the order of all that a kernel has in any
/// settings.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "export", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct MslOptions {
    /// Index of the first buffer.
    pub first_buffer: u32,
    /// Index of the first texture.
    pub first_texture: u32,
}

fn is_buffer(binding: &Binding) -> bool {
    matches!(binding.kind, BindingKind::Uniform | BindingKind::StorageBuffer(_))
}

impl MslOptions {
    /// `buffer` or `texture`, and index of a binding.
    pub fn slot_of(&self, kernel: &Kernel, binding: &Binding) -> (&'static str, u32) {
        let index = super::language::position(kernel, binding, |other| is_buffer(other) == is_buffer(binding));
        if is_buffer(binding) { ("buffer", self.first_buffer + index) } else { ("texture", self.first_texture + index) }
    }
}

impl Kernel {
    /// The kernel as Metal Shading Language 2.0 or later. The entry point has the kernel's name.
    ///
    /// # Errors
    ///
    /// [`Error::Kernel`] if it uses something that has no text form; a defect of limpid.
    pub fn msl(&self, options: &MslOptions) -> Result<String, Error> {
        self.msl_with(options, &Note::default())
    }

    pub(crate) fn msl_with(&self, options: &MslOptions, note: &Note) -> Result<String, Error> {
        super::write(self, options, note)
    }
}

fn helper_text(name: &str) -> &'static str {
    match name {
        "pack_half2" => {
            "// Two half floats in a word.\n\
             static uint pack_half2(float2 value) {\n\
             \x20   return as_type<uint>(half2(value));\n}\n"
        }
        "unpack_half2" => {
            "static float2 unpack_half2(uint bits) {\n\
             \x20   return float2(as_type<half2>(bits));\n}\n"
        }
        "texture_size" => {
            "static uint2 texture_size(texture2d<float, access::read> image, uint mip) {\n\
             \x20   return uint2(image.get_width(mip), image.get_height(mip));\n}\n"
        }
        _ => "",
    }
}

impl Language for MslOptions {
    fn stage(&self) -> &'static str {
        "write MSL"
    }

    fn reserved(&self) -> &[&'static [&'static str]] {
        &[words::C, words::MSL, words::FUNCTIONS]
    }

    fn prologue(&self, _kernel: &Kernel) -> String {
        "#include <metal_stdlib>\n\nusing namespace metal;\n".to_owned()
    }

    fn matrix(&self, columns: u8, rows: u8) -> String {
        format!("float{columns}x{rows}")
    }

    fn construct_struct(&self, name: &str, values: &[String]) -> Text {
        Text::whole(format!("{name}{{{}}}", values.join(", ")))
    }

    fn constant(&self, ty: &str, count: Option<u32>, name: &str, value: &str) -> String {
        let length = count.map(|count| format!("[{count}]")).unwrap_or_default();
        format!("constant {ty} {name}{length} = {value};\n")
    }

    fn array_value(&self, _ty: &str, values: &[String]) -> String {
        super::language::wrapped(values)
    }

    fn resource(&self, _kernel: &Kernel, binding: &Binding, name: &str, element: &str) -> String {
        match binding.kind {
            BindingKind::Uniform => format!("constant {element} &{name}"),
            BindingKind::TextureFloat => format!("texture2d<float, access::read> {name}"),
            BindingKind::TextureUint => format!("texture2d<uint, access::read> {name}"),
            BindingKind::StorageTexture(format) => {
                let ty = match format {
                    crate::resource::Format::Rgba16Float => "float",
                    _ => "uint",
                };
                format!("texture2d<{ty}, access::write> {name}")
            }
            BindingKind::StorageBuffer(Access::Read) => format!("device const {element} *{name}"),
            BindingKind::StorageBuffer(_) => format!("device {element} *{name}"),
        }
    }

    fn slot(&self, kernel: &Kernel, binding: &Binding) -> String {
        let (table, index) = self.slot_of(kernel, binding);
        format!("{table}({index})")
    }

    fn workgroup(&self, ty: &str, is_atomic: bool, count: Option<u32>, name: &str) -> String {
        let ty = if is_atomic { "atomic_uint" } else { ty };
        let length = count.map(|count| format!("[{count}]")).unwrap_or_default();
        format!("threadgroup {ty} {name}{length};")
    }

    fn passes_globals(&self) -> bool {
        true
    }

    fn helper(&self, name: &str) -> &'static str {
        helper_text(name)
    }

    fn function(&self, result: Option<&str>, name: &str, arguments: &[(String, String)]) -> String {
        let arguments: Vec<_> = arguments.iter().map(|(ty, name)| format!("{ty} {name}").trim().to_owned()).collect();
        format!("static {} {name}({}) {{\n", result.unwrap_or("void"), arguments.join(", "))
    }

    fn entry_point(&self, kernel: &Kernel, arguments: &[(String, String)]) -> String {
        let arguments: Vec<_> =
            arguments.iter().map(|(ty, name)| format!("\n    {ty} {name}").replace("\n     ", "\n    ")).collect();
        format!("kernel void {}({}\n) {{\n", kernel.name, arguments.join(","))
    }

    fn built_in(&self, built_in: naga::BuiltIn) -> Option<&'static str> {
        Some(match built_in {
            naga::BuiltIn::WorkGroupId => " [[threadgroup_position_in_grid]]",
            naga::BuiltIn::LocalInvocationIndex => " [[thread_index_in_threadgroup]]",
            naga::BuiltIn::LocalInvocationId => " [[thread_position_in_threadgroup]]",
            naga::BuiltIn::GlobalInvocationId => " [[thread_position_in_grid]]",
            _ => return None,
        })
    }

    fn literal(&self, literal: Literal) -> Result<String, String> {
        let suffix = if matches!(literal, Literal::F32(_)) { "f" } else { "" };
        Ok(c_literal(literal)? + suffix)
    }

    fn zero(&self, ty: &str, inner: &TypeInner) -> Result<Text, String> {
        Ok(match (super::language::zero_literal(inner), inner) {
            (Some("0.0"), _) => Text::whole("0.0f"),
            (Some(zero), _) => Text::whole(zero),
            (None, TypeInner::Struct { .. }) => Text::whole(format!("{ty}{{}}")),
            (None, _) => call(ty, &["0"]),
        })
    }

    fn splat(&self, ty: &str, _size: u8, value: Text) -> Text {
        call(ty, &[&value.text])
    }

    fn compares_with_scalars(&self) -> bool {
        true
    }

    fn select(&self, condition: Text, accept: Text, reject: Text, size: u8, _ty: &str) -> (Text, Option<Helper>) {
        if size > 1 {
            return (call("select", &[&reject.text, &accept.text, &condition.text]), None);
        }
        (super::language::ternary(condition, accept, reject), None)
    }

    fn bitcast(&self, _to: ScalarKind, ty: &str, _from: &TypeInner, value: &Text) -> Option<Text> {
        Some(call(&format!("as_type<{ty}>"), &[&value.text]))
    }

    fn math(&self, fun: MathFunction, operands: &[Operand]) -> Option<(Text, Option<Helper>)> {
        use MathFunction as M;
        // Metal has them for floats alone.
        if matches!(fun, M::Dot | M::Sign) && is_integer(operands[0].ty) {
            return None;
        }
        let helper = match fun {
            M::Pack2x16float => Some("pack_half2"),
            M::Unpack2x16float => Some("unpack_half2"),
            _ => None,
        };
        let name = match fun {
            M::InverseSqrt => "rsqrt",
            M::Fract => "fract",
            M::Mix => "mix",
            M::Saturate => "saturate",
            M::Atan2 => "atan2",
            M::Round => "rint",
            M::Fma => "fma",
            M::CountOneBits => "popcount",
            M::Pack2x16snorm => "pack_float_to_snorm2x16",
            M::Unpack2x16snorm => "unpack_snorm2x16_to_float",
            _ => helper.or_else(|| common_function(fun))?,
        };
        let texts: Vec<_> = operands.iter().map(|operand| operand.text.text.as_str()).collect();
        Some((call(name, &texts), helper))
    }

    fn image_load(&self, image: &str, coordinate: &Operand, level: &str) -> Text {
        let level = if level == "0" || level == "0u" { String::new() } else { format!(", {level}") };
        Text::whole(format!("{image}.read({}{level})", unsigned(coordinate)))
    }

    fn image_query(&self, image: &str, query: ImageQuery, level: Option<&str>) -> Option<(Text, Option<Helper>)> {
        match query {
            ImageQuery::Size { .. } => {
                Some((call("texture_size", &[image, level.unwrap_or("0u")]), Some("texture_size")))
            }
            ImageQuery::NumLevels => Some((Text::whole(format!("{image}.get_num_mip_levels()")), None)),
            _ => None,
        }
    }

    fn image_store(&self, image: &str, coordinate: &Operand, value: &str) -> String {
        format!("{image}.write({value}, {});", unsigned(coordinate))
    }

    fn atomic_load(&self, place: &str) -> Text {
        call("atomic_load_explicit", &[&format!("&{place}"), "memory_order_relaxed"])
    }

    fn atomic_store(&self, place: &str, value: &str) -> String {
        format!("atomic_store_explicit(&{place}, {value}, memory_order_relaxed);")
    }

    fn atomic(&self, fun: AtomicFunction, place: &str, value: &str, result: Option<(&str, &str)>) -> Option<String> {
        let name = match fun {
            AtomicFunction::Add => "add",
            AtomicFunction::Subtract => "sub",
            AtomicFunction::And => "and",
            AtomicFunction::ExclusiveOr => "xor",
            AtomicFunction::InclusiveOr => "or",
            AtomicFunction::Min => "min",
            AtomicFunction::Max => "max",
            AtomicFunction::Exchange { .. } => return None,
        };
        let call = format!("atomic_fetch_{name}_explicit(&{place}, {value}, memory_order_relaxed);");
        Some(match result {
            Some((ty, name)) => format!("{ty} {name} = {call}"),
            None => call,
        })
    }

    fn barrier(&self) -> &'static str {
        "threadgroup_barrier(mem_flags::mem_threadgroup);"
    }
}

fn unsigned(coordinate: &Operand) -> String {
    if is_unsigned(coordinate.ty) { coordinate.text.text.clone() } else { format!("uint2({})", coordinate.text.text) }
}
