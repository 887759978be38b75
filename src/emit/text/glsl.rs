//! GLSL, for OpenGL and for Vulkan.

use naga::{AtomicFunction, BinaryOperator, ImageQuery, MathFunction, Scalar, ScalarKind, TypeInner};
use serde::{Deserialize, Serialize};

use super::heading::Note;
use super::language::{Helper, Language, Operand, Text, call, common_function, is_integer, is_unsigned};
use super::words;
use crate::Error;
use crate::kernel::{Binding, BindingKind, Kernel};
use crate::resource::{Access, Format};

/// What GLSL is written for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "export", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum GlslDialect {
    /// OpenGL 4.5: texture units, image units and buffer bindings are counted apart.
    #[default]
    #[serde(rename = "opengl")]
    OpenGl,
    /// Vulkan: sets and bindings, textures without samplers.
    Vulkan,
}

/// How to write GLSL. The entry point is `main`.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "export", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct GlslOptions {
    /// Dialect.
    pub dialect: GlslDialect,
    /// Set of group 0, for Vulkan; that of group 1 follows.
    pub first_set: u32,
    /// Number of the first binding of each set, or of each kind of unit in OpenGL.
    pub first_binding: u32,
}

impl GlslOptions {
    /// Set, if there are sets, and number of a binding. In OpenGL the bindings of each kind are numbered in the
    /// order of all that the kernel has in any settings.
    pub fn slot_of(&self, kernel: &Kernel, binding: &Binding) -> (Option<u32>, u32) {
        match self.dialect {
            GlslDialect::Vulkan => (Some(self.first_set + binding.group), self.first_binding + binding.binding),
            GlslDialect::OpenGl => {
                let kind = |binding: &Binding| std::mem::discriminant(&unit(binding.kind));
                let same = |other: &&Binding| kind(other) == kind(binding);
                (None, self.first_binding + super::language::position(kernel, binding, same))
            }
        }
    }
}

/// What OpenGL binds a resource to.
pub(crate) enum Unit {
    Uniform,
    Texture,
    Image,
    Storage,
}

pub(crate) fn unit(kind: BindingKind) -> Unit {
    match kind {
        BindingKind::Uniform => Unit::Uniform,
        BindingKind::TextureFloat | BindingKind::TextureUint => Unit::Texture,
        BindingKind::StorageTexture(_) => Unit::Image,
        BindingKind::StorageBuffer(_) => Unit::Storage,
    }
}

impl Kernel {
    /// The kernel as GLSL 4.50.
    ///
    /// # Errors
    ///
    /// [`Error::Kernel`] if it uses something that has no text form; a defect of limpid.
    pub fn glsl(&self, options: &GlslOptions) -> Result<String, Error> {
        self.glsl_with(options, &Note::default())
    }

    pub(crate) fn glsl_with(&self, options: &GlslOptions, note: &Note) -> Result<String, Error> {
        super::write(self, options, note)
    }
}

/// `in_tiles` as `InTiles`.
fn block_name(name: &str) -> String {
    let capital = |word: &str| word[..1].to_uppercase() + &word[1..];
    name.split('_').filter(|word| !word.is_empty()).map(capital).collect()
}

impl Language for GlslOptions {
    fn stage(&self) -> &'static str {
        "write GLSL"
    }

    fn entry_name(&self, _kernel: &Kernel) -> &'static str {
        "main"
    }

    fn reserved(&self) -> &[&'static [&'static str]] {
        &[words::C, words::GLSL, words::FUNCTIONS]
    }

    fn prologue(&self, kernel: &Kernel) -> String {
        let [x, y, z] = kernel.workgroup_size;
        let extension = match self.dialect {
            GlslDialect::Vulkan => "#extension GL_EXT_samplerless_texture_functions : require\n",
            GlslDialect::OpenGl => "",
        };
        format!("#version 450\n{extension}\nlayout(local_size_x = {x}, local_size_y = {y}, local_size_z = {z}) in;\n")
    }

    fn vector(&self, size: u8, scalar: Scalar) -> Result<String, String> {
        let prefix = match scalar.kind {
            ScalarKind::Float => "",
            ScalarKind::Uint => "u",
            ScalarKind::Sint => "i",
            ScalarKind::Bool => "b",
            _ => return Err(format!("vectors of {scalar:?} have no text form")),
        };
        Ok(format!("{prefix}vec{size}"))
    }

    fn matrix(&self, columns: u8, rows: u8) -> String {
        if columns == rows { format!("mat{columns}") } else { format!("mat{columns}x{rows}") }
    }

    fn construct_struct(&self, name: &str, values: &[String]) -> Text {
        Text::whole(format!("{name}({})", values.join(", ")))
    }

    fn constant(&self, ty: &str, count: Option<u32>, name: &str, value: &str) -> String {
        let length = count.map(|count| format!("[{count}]")).unwrap_or_default();
        format!("const {ty} {name}{length} = {value};\n")
    }

    fn array_value(&self, ty: &str, values: &[String]) -> String {
        format!("{ty}[]{}", super::language::wrapped(values).replace('{', "(").replace('}', ")"))
    }

    fn resource(&self, kernel: &Kernel, binding: &Binding, name: &str, element: &str) -> String {
        let (set, number) = self.slot_of(kernel, binding);
        let set = set.map(|set| format!("set = {set}, ")).unwrap_or_default();
        let image = match self.dialect {
            GlslDialect::OpenGl => "sampler2D",
            GlslDialect::Vulkan => "texture2D",
        };
        let block = block_name(name);
        let length = super::language::array_length(kernel, binding).map(|count| count.to_string()).unwrap_or_default();
        let slot = format!("{set}binding = {number}");
        match binding.kind {
            BindingKind::Uniform => format!("layout({slot}, std140) uniform {block}Block {{ {element} {name}; }};\n"),
            BindingKind::TextureFloat => format!("layout({slot}) uniform {image} {name};\n"),
            BindingKind::TextureUint => format!("layout({slot}) uniform u{image} {name};\n"),
            BindingKind::StorageTexture(Format::Rgba16Float) => {
                format!("layout({slot}, rgba16f) uniform writeonly image2D {name};\n")
            }
            BindingKind::StorageTexture(Format::Rgba32Uint) => {
                format!("layout({slot}, rgba32ui) uniform writeonly uimage2D {name};\n")
            }
            BindingKind::StorageTexture(Format::Rg32Uint) => {
                format!("layout({slot}, rg32ui) uniform writeonly uimage2D {name};\n")
            }
            BindingKind::StorageTexture(Format::R32Uint) => {
                format!("layout({slot}, r32ui) uniform writeonly uimage2D {name};\n")
            }
            BindingKind::StorageBuffer(access) => {
                let access = if access == Access::Read { "readonly " } else { "" };
                format!("layout({slot}, std430) {access}buffer {block}Block {{ {element} {name}[{length}]; }};\n")
            }
        }
    }

    fn slot(&self, kernel: &Kernel, binding: &Binding) -> String {
        let (set, number) = self.slot_of(kernel, binding);
        match set {
            Some(set) => format!("set {set} binding {number}"),
            None => {
                let unit = match unit(binding.kind) {
                    Unit::Uniform => "uniform buffer",
                    Unit::Texture => "texture unit",
                    Unit::Image => "image unit",
                    Unit::Storage => "storage buffer",
                };
                format!("{unit} {number}")
            }
        }
    }

    fn workgroup(&self, ty: &str, _is_atomic: bool, count: Option<u32>, name: &str) -> String {
        let length = count.map(|count| format!("[{count}]")).unwrap_or_default();
        format!("shared {ty} {name}{length};")
    }

    fn helper(&self, _name: &str) -> &'static str {
        ""
    }

    fn entry_point(&self, _kernel: &Kernel, _arguments: &[(String, String)]) -> String {
        "void main() {\n".to_owned()
    }

    fn built_in(&self, built_in: naga::BuiltIn) -> Option<&'static str> {
        Some(match built_in {
            naga::BuiltIn::WorkGroupId => "gl_WorkGroupID",
            naga::BuiltIn::LocalInvocationIndex => "gl_LocalInvocationIndex",
            naga::BuiltIn::LocalInvocationId => "gl_LocalInvocationID",
            naga::BuiltIn::GlobalInvocationId => "gl_GlobalInvocationID",
            _ => return None,
        })
    }

    fn built_ins_are_global(&self) -> bool {
        true
    }

    fn zero(&self, ty: &str, inner: &TypeInner) -> Result<Text, String> {
        match (super::language::zero_literal(inner), super::language::shape(inner)) {
            (Some(zero), _) => Ok(Text::whole(zero)),
            (None, Some((scalar, _))) => {
                let zero = super::language::zero_literal(&TypeInner::Scalar(scalar)).unwrap_or("0");
                Ok(call(ty, &[zero]))
            }
            _ => Err("structs are zero member by member".to_owned()),
        }
    }

    fn splat(&self, ty: &str, _size: u8, value: Text) -> Text {
        call(ty, &[&value.text])
    }

    fn compare(&self, operator: BinaryOperator, left: &Text, right: &Text) -> Option<Text> {
        let name = match operator {
            BinaryOperator::Less => "lessThan",
            BinaryOperator::LessEqual => "lessThanEqual",
            BinaryOperator::Greater => "greaterThan",
            BinaryOperator::GreaterEqual => "greaterThanEqual",
            BinaryOperator::Equal => "equal",
            BinaryOperator::NotEqual => "notEqual",
            _ => return None,
        };
        Some(call(name, &[&left.text, &right.text]))
    }

    fn not(&self, value: Text, size: u8) -> Text {
        if size > 1 { call("not", &[&value.text]) } else { super::language::negated(value) }
    }

    fn select(&self, condition: Text, accept: Text, reject: Text, size: u8, _ty: &str) -> (Text, Option<Helper>) {
        if size > 1 {
            return (call("mix", &[&reject.text, &accept.text, &condition.text]), None);
        }
        (super::language::ternary(condition, accept, reject), None)
    }

    fn bitcast(&self, to: ScalarKind, ty: &str, from: &TypeInner, value: &Text) -> Option<Text> {
        let from = super::language::shape(from)?.0.kind;
        let name = match (from, to) {
            (ScalarKind::Float, ScalarKind::Uint) => "floatBitsToUint",
            (ScalarKind::Float, ScalarKind::Sint) => "floatBitsToInt",
            (ScalarKind::Uint, ScalarKind::Float) => "uintBitsToFloat",
            (ScalarKind::Sint, ScalarKind::Float) => "intBitsToFloat",
            (ScalarKind::Uint | ScalarKind::Sint, ScalarKind::Uint | ScalarKind::Sint) => ty,
            _ => return None,
        };
        Some(call(name, &[&value.text]))
    }

    fn math(&self, fun: MathFunction, operands: &[Operand]) -> Option<(Text, Option<Helper>)> {
        use MathFunction as M;
        let mut texts: Vec<_> = operands.iter().map(|operand| operand.text.text.as_str()).collect();
        let name = match fun {
            M::Saturate => {
                texts.extend(["0.0", "1.0"]);
                "clamp"
            }
            M::InverseSqrt => "inversesqrt",
            M::Fract => "fract",
            M::Mix => "mix",
            M::Atan2 => "atan",
            M::Round => "roundEven",
            // GLSL has it for floats alone.
            M::Dot if is_integer(operands[0].ty) => return None,
            M::Fma => "fma",
            // A signed number there.
            M::CountOneBits if *operands[0].ty == TypeInner::Scalar(Scalar::U32) => {
                return Some((call("uint", &[&call("bitCount", &texts).text]), None));
            }
            M::Pack2x16float => "packHalf2x16",
            M::Unpack2x16float => "unpackHalf2x16",
            M::Pack2x16snorm => "packSnorm2x16",
            M::Unpack2x16snorm => "unpackSnorm2x16",
            _ => common_function(fun)?,
        };
        Some((call(name, &texts), None))
    }

    fn image_load(&self, image: &str, coordinate: &Operand, level: &str) -> Text {
        call("texelFetch", &[image, &signed(coordinate), &signed_level(level)])
    }

    fn image_query(&self, image: &str, query: ImageQuery, level: Option<&str>) -> Option<(Text, Option<Helper>)> {
        match query {
            ImageQuery::Size { .. } => {
                let size = call("textureSize", &[image, &signed_level(level.unwrap_or("0"))]);
                Some((call("uvec2", &[&size.text]), None))
            }
            ImageQuery::NumLevels => Some((call("uint", &[&call("textureQueryLevels", &[image]).text]), None)),
            _ => None,
        }
    }

    fn image_store(&self, image: &str, coordinate: &Operand, value: &str) -> String {
        format!("imageStore({image}, {}, {value});", signed(coordinate))
    }

    fn atomic(&self, fun: AtomicFunction, place: &str, value: &str, result: Option<(&str, &str)>) -> Option<String> {
        let call = format!("{}({place}, {value});", super::language::atomic_function(fun)?);
        Some(match result {
            Some((ty, name)) => format!("{ty} {name} = {call}"),
            None => call,
        })
    }

    fn barrier(&self) -> &'static str {
        "barrier();"
    }
}

fn signed(coordinate: &Operand) -> String {
    if is_unsigned(coordinate.ty) { format!("ivec2({})", coordinate.text.text) } else { coordinate.text.text.clone() }
}

fn signed_level(level: &str) -> String {
    if level.parse::<i32>().is_ok() { level.to_owned() } else { format!("int({level})") }
}
