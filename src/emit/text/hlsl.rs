//! HLSL, for DXC and FXC.

use naga::{AtomicFunction, ImageQuery, MathFunction, ScalarKind, TypeInner};
use serde::{Deserialize, Serialize};

use super::heading::Note;
use super::language::{Binds, Helper, Language, Operand, Text, call, is_unsigned};
use super::words;
use crate::Error;
use crate::kernel::{Binding, BindingKind, Kernel};
use crate::resource::{Access, Format};

/// What HLSL is written for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "export", derive(schemars::JsonSchema))]
pub enum ShaderModel {
    /// 5.1, for FXC.
    #[serde(rename = "5.1")]
    V5_1,
    /// 6.0, for DXC.
    #[serde(rename = "6.0")]
    #[default]
    V6_0,
    /// 6.2 with `-enable-16bit-types`: packing to half floats converts to `float16_t` and rounds to the nearest.
    #[serde(rename = "6.2-16bit")]
    V6_2Half,
}

impl ShaderModel {
    /// The profile to compile for.
    pub fn profile(self) -> &'static str {
        match self {
            Self::V5_1 => "cs_5_1",
            Self::V6_0 => "cs_6_0",
            Self::V6_2Half => "cs_6_2",
        }
    }
}

/// How to write HLSL. Group and number of a binding are its space and register, in the class of its kind
/// (`b`, `t` or `u`): the same in all settings.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "export", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct HlslOptions {
    /// Shader model.
    pub shader_model: ShaderModel,
    /// Space of group 0; that of group 1 follows.
    pub first_space: u32,
    /// Number of the first register of each class.
    pub first_register: u32,
    /// Puts the root signature, which is always written as a macro, on the entry point.
    pub root_signature: bool,
    /// Adds `[[vk::binding]]` and `[[vk::image_format]]`, for DXC's `-spirv`.
    pub vk_binding: bool,
}

impl HlslOptions {
    /// Class (`b`, `t` or `u`), register and space of a binding.
    pub fn register(&self, binding: &Binding) -> (char, u32, u32) {
        let class = match binding.kind {
            BindingKind::Uniform => 'b',
            BindingKind::StorageTexture(_) => 'u',
            BindingKind::StorageBuffer(access) if access != Access::Read => 'u',
            _ => 't',
        };
        (class, self.first_register + binding.binding, self.first_space + binding.group)
    }

    /// A root signature for a kernel: the constants as a root descriptor, all else in one table, by space and
    /// register, shader resources first.
    pub fn root_signature_of(&self, kernel: &Kernel) -> String {
        self.root_signature_lines(kernel).concat()
    }

    fn root_signature_lines(&self, kernel: &Kernel) -> Vec<String> {
        let mut lines = Vec::new();
        let mut ranges = [Vec::new(), Vec::new()];
        for binding in &kernel.bindings {
            let (class, register, space) = self.register(binding);
            match class {
                'b' => lines.push(format!("CBV(b{register}, space = {space}), ")),
                't' => ranges[0].push(format!("SRV(t{register}, space = {space})")),
                _ => ranges[1].push(format!("UAV(u{register}, space = {space})")),
            }
        }
        let ranges = ranges.concat();
        let chunks: Vec<_> = ranges.chunks(4).map(|chunk| chunk.join(", ")).collect();
        for (index, chunk) in chunks.iter().enumerate() {
            let begin = if index == 0 { "DescriptorTable(" } else { "" };
            let end = if index + 1 == chunks.len() { ")" } else { ", " };
            lines.push(format!("{begin}{chunk}{end}"));
        }
        lines
    }

    fn vk(&self, binding: &Binding) -> String {
        if !self.vk_binding {
            return String::new();
        }
        let format = match binding.kind {
            BindingKind::StorageTexture(Format::Rgba16Float) => "[[vk::image_format(\"rgba16f\")]] ",
            BindingKind::StorageTexture(Format::Rgba32Uint) => "[[vk::image_format(\"rgba32ui\")]] ",
            BindingKind::StorageTexture(Format::Rg32Uint) => "[[vk::image_format(\"rg32ui\")]] ",
            BindingKind::StorageTexture(Format::R32Uint) => "[[vk::image_format(\"r32ui\")]] ",
            _ => "",
        };
        format!(
            "[[vk::binding({}, {})]] {format}",
            self.first_register + binding.binding,
            self.first_space + binding.group
        )
    }
}

impl Kernel {
    /// The kernel as HLSL. The entry point has the kernel's name.
    ///
    /// # Errors
    ///
    /// [`Error::Kernel`] if it uses something that has no text form; a defect of limpid.
    pub fn hlsl(&self, options: &HlslOptions) -> Result<String, Error> {
        self.hlsl_with(options, &Note::default())
    }

    pub(crate) fn hlsl_with(&self, options: &HlslOptions, note: &Note) -> Result<String, Error> {
        super::write(self, options, note)
    }
}

fn helper_text(name: &str, half: bool) -> &'static str {
    match name {
        "pack_half2" if half => {
            "// Two half floats in a word, rounded to the nearest.\n\
             uint pack_half2(float2 value) {\n\
             \x20   uint16_t2 bits = asuint16(float16_t2(value));\n\
             \x20   return uint(bits.x) | (uint(bits.y) << 16u);\n}\n"
        }
        "pack_half2" => {
            "// Two half floats in a word.\n\
             uint pack_half2(float2 value) {\n\
             \x20   return f32tof16(value.x) | (f32tof16(value.y) << 16u);\n}\n"
        }
        "unpack_half2" => {
            "float2 unpack_half2(uint packed) {\n\
             \x20   return float2(f16tof32(packed & 0xffffu), f16tof32(packed >> 16u));\n}\n"
        }
        "pack_snorm2" => {
            "// Two numbers from -1 to 1 in 16 bits each.\n\
             uint pack_snorm2(float2 value) {\n\
             \x20   int2 bits = int2(round(clamp(value, -1.0, 1.0) * 32767.0)) & 0xffff;\n\
             \x20   return uint(bits.x) | (uint(bits.y) << 16u);\n}\n"
        }
        "unpack_snorm2" => {
            "float2 unpack_snorm2(uint packed) {\n\
             \x20   int2 bits = int2(int(packed << 16u), int(packed)) >> 16;\n\
             \x20   precise float2 value = float2(bits) / 32767.0; // not times a rounded reciprocal\n\
             \x20   return clamp(value, -1.0, 1.0);\n}\n"
        }
        "choose float2" => {
            "// Component by component.\n\
             float2 choose(bool2 condition, float2 accept, float2 reject) {\n\
             \x20   return float2(condition.x ? accept.x : reject.x, condition.y ? accept.y : reject.y);\n}\n"
        }
        "choose float3" => {
            "// Component by component.\n\
             float3 choose(bool3 condition, float3 accept, float3 reject) {\n\
             \x20   float2 xy = float2(condition.x ? accept.x : reject.x, condition.y ? accept.y : reject.y);\n\
             \x20   return float3(xy, condition.z ? accept.z : reject.z);\n}\n"
        }
        "choose float4" => {
            "// Component by component.\n\
             float4 choose(bool4 condition, float4 accept, float4 reject) {\n\
             \x20   float2 xy = float2(condition.x ? accept.x : reject.x, condition.y ? accept.y : reject.y);\n\
             \x20   return float4(xy, condition.z ? accept.z : reject.z, condition.w ? accept.w : reject.w);\n}\n"
        }
        "choose int2" => {
            "// Component by component.\n\
             int2 choose(bool2 condition, int2 accept, int2 reject) {\n\
             \x20   return int2(condition.x ? accept.x : reject.x, condition.y ? accept.y : reject.y);\n}\n"
        }
        "choose uint2" => {
            "// Component by component.\n\
             uint2 choose(bool2 condition, uint2 accept, uint2 reject) {\n\
             \x20   return uint2(condition.x ? accept.x : reject.x, condition.y ? accept.y : reject.y);\n}\n"
        }
        "texture_size" => {
            "uint2 texture_size(Texture2D<float4> image, uint level) {\n\
             \x20   uint2 size;\n\
             \x20   uint levels;\n\
             \x20   image.GetDimensions(level, size.x, size.y, levels);\n\
             \x20   return size;\n}\n"
        }
        "texture_levels" => {
            "uint texture_levels(Texture2D<float4> image) {\n\
             \x20   uint2 size;\n\
             \x20   uint levels;\n\
             \x20   image.GetDimensions(0u, size.x, size.y, levels);\n\
             \x20   return levels;\n}\n"
        }
        _ => "",
    }
}

impl Language for HlslOptions {
    fn stage(&self) -> &'static str {
        "write HLSL"
    }

    fn reserved(&self) -> &[&'static [&'static str]] {
        &[words::C, words::HLSL, words::FUNCTIONS]
    }

    fn prologue(&self, kernel: &Kernel) -> String {
        let lines = self.root_signature_lines(kernel);
        let lines: String = lines.iter().map(|line| format!(" \\\n    \"{line}\"")).collect();
        format!("#define {}_ROOT_SIGNATURE{lines}\n", kernel.name.to_uppercase())
    }

    fn matrix(&self, columns: u8, rows: u8) -> String {
        format!("column_major float{rows}x{columns}")
    }

    // There are no expressions of struct type.
    fn constructor(&self, name: &str, fields: &[(String, String)]) -> String {
        let arguments: Vec<_> = fields.iter().map(|(ty, name)| format!("{ty} {name}")).collect();
        let assignments: String = fields.iter().map(|(_, field)| format!("    made.{field} = {field};\n")).collect();
        let made = self.construct_struct(name, &[]).text;
        let made = made.split('(').next().unwrap_or_default();
        format!("\n{name} {made}({}) {{\n    {name} made;\n{assignments}    return made;\n}}\n", arguments.join(", "))
    }

    fn construct_struct(&self, name: &str, values: &[String]) -> Text {
        Text::whole(format!("make_{}({})", name.to_lowercase(), values.join(", ")))
    }

    fn constant(&self, ty: &str, count: Option<u32>, name: &str, value: &str) -> String {
        let length = count.map(|count| format!("[{count}]")).unwrap_or_default();
        format!("static const {ty} {name}{length} = {value};\n")
    }

    fn array_value(&self, _ty: &str, values: &[String]) -> String {
        super::language::wrapped(values)
    }

    fn resource(&self, _kernel: &Kernel, binding: &Binding, name: &str, element: &str) -> String {
        let (class, register, space) = self.register(binding);
        let ty = match binding.kind {
            BindingKind::Uniform => format!("ConstantBuffer<{element}>"),
            BindingKind::TextureFloat => "Texture2D<float4>".to_owned(),
            BindingKind::TextureUint => "Texture2D<uint4>".to_owned(),
            BindingKind::StorageTexture(Format::Rgba16Float) => "RWTexture2D<float4>".to_owned(),
            BindingKind::StorageTexture(Format::Rgba32Uint) => "RWTexture2D<uint4>".to_owned(),
            BindingKind::StorageTexture(Format::Rg32Uint) => "RWTexture2D<uint2>".to_owned(),
            BindingKind::StorageTexture(Format::R32Uint) => "RWTexture2D<uint>".to_owned(),
            BindingKind::StorageBuffer(Access::Read) => format!("StructuredBuffer<{element}>"),
            BindingKind::StorageBuffer(_) => format!("RWStructuredBuffer<{element}>"),
        };
        format!("{}{ty} {name} : register({class}{register}, space{space});\n", self.vk(binding))
    }

    fn slot(&self, _kernel: &Kernel, binding: &Binding) -> String {
        let (class, register, space) = self.register(binding);
        format!("{class}{register} space{space}")
    }

    fn workgroup(&self, ty: &str, _is_atomic: bool, count: Option<u32>, name: &str) -> String {
        let length = count.map(|count| format!("[{count}]")).unwrap_or_default();
        format!("groupshared {ty} {name}{length};")
    }

    fn helper(&self, name: &str) -> &'static str {
        helper_text(name, self.shader_model == ShaderModel::V6_2Half)
    }

    fn entry_point(&self, kernel: &Kernel, arguments: &[(String, String)]) -> String {
        let [x, y, z] = kernel.workgroup_size;
        let arguments: Vec<_> = arguments.iter().map(|(ty, name)| format!("{ty} {name}")).collect();
        let root = if self.root_signature {
            format!("[RootSignature({}_ROOT_SIGNATURE)]\n", kernel.name.to_uppercase())
        } else {
            String::new()
        };
        format!("{root}[numthreads({x}, {y}, {z})]\nvoid {}({}) {{\n", kernel.name, arguments.join(", "))
    }

    fn built_in(&self, built_in: naga::BuiltIn) -> Option<&'static str> {
        Some(match built_in {
            naga::BuiltIn::WorkGroupId => " : SV_GroupID",
            naga::BuiltIn::LocalInvocationIndex => " : SV_GroupIndex",
            naga::BuiltIn::LocalInvocationId => " : SV_GroupThreadID",
            naga::BuiltIn::GlobalInvocationId => " : SV_DispatchThreadID",
            _ => return None,
        })
    }

    // In FXC and in older modes of DXC.
    fn loop_variables_leak(&self) -> bool {
        true
    }

    fn zero(&self, ty: &str, inner: &TypeInner) -> Result<Text, String> {
        Ok(match super::language::zero_literal(inner) {
            Some(zero) => Text::whole(zero),
            None => Text { text: format!("({ty})0"), binds: Binds::Unary },
        })
    }

    fn splat(&self, ty: &str, _size: u8, value: Text) -> Text {
        Text { text: format!("({ty}){}", value.at_least(Binds::Whole)), binds: Binds::Unary }
    }

    fn compares_with_scalars(&self) -> bool {
        true
    }

    fn matrix_product(&self, left: &Text, right: &Text) -> Option<Text> {
        Some(call("mul", &[&left.text, &right.text]))
    }

    fn has_matrix_columns(&self) -> bool {
        false
    }

    fn select(&self, condition: Text, accept: Text, reject: Text, size: u8, ty: &str) -> (Text, Option<Helper>) {
        // FXC and HLSL 2018 have no `select`, HLSL 2021 has no `?:` on vectors.
        let helper = match ty {
            "float2" => "choose float2",
            "float3" => "choose float3",
            "float4" => "choose float4",
            "int2" => "choose int2",
            _ => "choose uint2",
        };
        if size > 1 {
            return (call("choose", &[&condition.text, &accept.text, &reject.text]), Some(helper));
        }
        (super::language::ternary(condition, accept, reject), None)
    }

    fn bitcast(&self, to: ScalarKind, _ty: &str, _from: &TypeInner, value: &Text) -> Option<Text> {
        let name = match to {
            ScalarKind::Float => "asfloat",
            ScalarKind::Uint => "asuint",
            ScalarKind::Sint => "asint",
            _ => return None,
        };
        Some(call(name, &[&value.text]))
    }

    fn math(&self, fun: MathFunction, operands: &[Operand]) -> Option<(Text, Option<Helper>)> {
        use MathFunction as M;
        let helper = match fun {
            M::Pack2x16float => Some("pack_half2"),
            M::Unpack2x16float => Some("unpack_half2"),
            M::Pack2x16snorm => Some("pack_snorm2"),
            M::Unpack2x16snorm => Some("unpack_snorm2"),
            _ => None,
        };
        let name = match fun {
            M::InverseSqrt => "rsqrt",
            M::Fract => "frac",
            M::Mix => "lerp",
            M::Saturate => "saturate",
            M::Atan2 => "atan2",
            M::Round => "round",
            M::Fma => "mad",
            M::CountOneBits => "countbits",
            _ => helper.or_else(|| super::language::common_function(fun))?,
        };
        let texts: Vec<_> = operands.iter().map(|operand| operand.text.text.as_str()).collect();
        Some((call(name, &texts), helper))
    }

    fn image_load(&self, image: &str, coordinate: &Operand, level: &str) -> Text {
        Text::whole(format!("{image}.Load(int3({}, {level}))", coordinate.text.text))
    }

    fn image_query(&self, image: &str, query: ImageQuery, level: Option<&str>) -> Option<(Text, Option<Helper>)> {
        match query {
            ImageQuery::Size { .. } => {
                Some((call("texture_size", &[image, level.unwrap_or("0u")]), Some("texture_size")))
            }
            ImageQuery::NumLevels => Some((call("texture_levels", &[image]), Some("texture_levels"))),
            _ => None,
        }
    }

    fn image_store(&self, image: &str, coordinate: &Operand, value: &str) -> String {
        let coordinate = match is_unsigned(coordinate.ty) {
            true => coordinate.text.text.clone(),
            false => format!("uint2({})", coordinate.text.text),
        };
        format!("{image}[{coordinate}] = {value};")
    }

    fn stores_full_values(&self) -> bool {
        false
    }

    fn atomic(&self, fun: AtomicFunction, place: &str, value: &str, result: Option<(&str, &str)>) -> Option<String> {
        let name = match fun {
            AtomicFunction::Add => "InterlockedAdd",
            AtomicFunction::And => "InterlockedAnd",
            AtomicFunction::ExclusiveOr => "InterlockedXor",
            AtomicFunction::InclusiveOr => "InterlockedOr",
            AtomicFunction::Min => "InterlockedMin",
            AtomicFunction::Max => "InterlockedMax",
            AtomicFunction::Subtract | AtomicFunction::Exchange { .. } => return None,
        };
        Some(match result {
            Some((ty, result)) => format!("{ty} {result};\n{name}({place}, {value}, {result});"),
            None => format!("{name}({place}, {value});"),
        })
    }

    fn barrier(&self) -> &'static str {
        "GroupMemoryBarrierWithGroupSync();"
    }
}
