//! WGSL of a specialised kernel.

use naga::{AtomicFunction, ImageQuery, MathFunction, Scalar, ScalarKind, TypeInner};
use serde::{Deserialize, Serialize};

use super::heading::Note;
use super::language::{Helper, Language, Operand, Text, call, common_function};
use super::words;
use crate::Error;
use crate::kernel::{Binding, BindingKind, Kernel};
use crate::resource::{Access, Format};

/// How to write WGSL.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "export", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct WgslOptions {
    /// Number of bind group 0; that of group 1 follows.
    pub first_group: u32,
    /// Number of the first binding of each group.
    pub first_binding: u32,
}

impl WgslOptions {
    /// Bind group and number of a binding.
    pub fn slot_of(&self, binding: &Binding) -> (u32, u32) {
        (self.first_group + binding.group, self.first_binding + binding.binding)
    }
}

impl Kernel {
    /// The specialised kernel as WGSL. The entry point has the kernel's name.
    ///
    /// # Errors
    ///
    /// [`Error::Kernel`] if it uses something that has no text form; a defect of limpid.
    pub fn wgsl(&self, options: &WgslOptions) -> Result<String, Error> {
        self.wgsl_with(options, &Note::default())
    }

    pub(crate) fn wgsl_with(&self, options: &WgslOptions, note: &Note) -> Result<String, Error> {
        super::write(self, options, note)
    }
}

impl Language for WgslOptions {
    fn stage(&self) -> &'static str {
        "write WGSL"
    }

    fn reserved(&self) -> &[&'static [&'static str]] {
        &[naga::keywords::wgsl::RESERVED, words::FUNCTIONS]
    }

    fn prologue(&self, _kernel: &Kernel) -> String {
        String::new()
    }

    fn scalar(&self, scalar: Scalar) -> Result<&'static str, String> {
        match (scalar.kind, scalar.width) {
            (ScalarKind::Float, 4) => Ok("f32"),
            (ScalarKind::Uint, 4) => Ok("u32"),
            (ScalarKind::Sint, 4) => Ok("i32"),
            (ScalarKind::Bool, _) => Ok("bool"),
            _ => Err(format!("the type {scalar:?} has no text form")),
        }
    }

    fn vector(&self, size: u8, scalar: Scalar) -> Result<String, String> {
        Ok(format!("vec{size}<{}>", self.scalar(scalar)?))
    }

    fn matrix(&self, columns: u8, rows: u8) -> String {
        format!("mat{columns}x{rows}<f32>")
    }

    // Members have names of their own.
    fn member(&self, name: &str) -> String {
        name.to_owned()
    }

    fn field(&self, ty: &str, name: &str) -> String {
        format!("{name}: {ty},")
    }

    fn struct_end(&self) -> &'static str {
        "}\n"
    }

    fn construct_struct(&self, name: &str, values: &[String]) -> Text {
        Text::whole(format!("{name}({})", values.join(", ")))
    }

    fn constant(&self, ty: &str, count: Option<u32>, name: &str, value: &str) -> String {
        match count {
            Some(count) => format!("const {name} = array<{ty}, {count}>{value};\n"),
            None => format!("const {name}: {ty} = {value};\n"),
        }
    }

    fn array_value(&self, _ty: &str, values: &[String]) -> String {
        super::language::wrapped(values).replace('{', "(").replace('}', ")")
    }

    fn resource(&self, kernel: &Kernel, binding: &Binding, name: &str, element: &str) -> String {
        let (group, number) = self.slot_of(binding);
        let elements =
            || super::language::array_length(kernel, binding).map(|count| format!(", {count}")).unwrap_or_default();
        let is_atomic = super::language::is_atomic(kernel, binding);
        let element = if is_atomic { format!("atomic<{element}>") } else { element.to_owned() };
        let (space, ty) = match binding.kind {
            BindingKind::Uniform => ("<uniform>", element),
            BindingKind::TextureFloat => ("", "texture_2d<f32>".to_owned()),
            BindingKind::TextureUint => ("", "texture_2d<u32>".to_owned()),
            BindingKind::StorageTexture(format) => {
                let format = match format {
                    Format::Rgba16Float => "rgba16float",
                    Format::Rgba32Uint => "rgba32uint",
                    Format::Rg32Uint => "rg32uint",
                    Format::R32Uint => "r32uint",
                };
                ("", format!("texture_storage_2d<{format}, write>"))
            }
            BindingKind::StorageBuffer(Access::Read) => ("<storage, read>", format!("array<{element}{}>", elements())),
            BindingKind::StorageBuffer(_) => ("<storage, read_write>", format!("array<{element}{}>", elements())),
        };
        format!("@group({group}) @binding({number}) var{space} {name}: {ty};\n")
    }

    fn slot(&self, _kernel: &Kernel, binding: &Binding) -> String {
        let (group, number) = self.slot_of(binding);
        format!("@group({group}) @binding({number})")
    }

    fn workgroup(&self, ty: &str, is_atomic: bool, count: Option<u32>, name: &str) -> String {
        let ty = if is_atomic { format!("atomic<{ty}>") } else { ty.to_owned() };
        match count {
            Some(count) => format!("var<workgroup> {name}: array<{ty}, {count}>;"),
            None => format!("var<workgroup> {name}: {ty};"),
        }
    }

    fn helper(&self, _name: &str) -> &'static str {
        ""
    }

    fn function(&self, result: Option<&str>, name: &str, arguments: &[(String, String)]) -> String {
        let arguments: Vec<_> = arguments.iter().map(|(ty, name)| format!("{name}: {ty}")).collect();
        let result = result.map(|ty| format!(" -> {ty}")).unwrap_or_default();
        format!("fn {name}({}){result} {{\n", arguments.join(", "))
    }

    fn entry_point(&self, kernel: &Kernel, arguments: &[(String, String)]) -> String {
        let [x, y, z] = kernel.workgroup_size;
        let arguments: Vec<_> = arguments
            .iter()
            .map(|(ty, name)| {
                let (name, attribute) = name.split_once(' ').unwrap_or((name, ""));
                format!("{attribute} {name}: {ty}")
            })
            .collect();
        format!("@compute @workgroup_size({x}, {y}, {z})\nfn {}({}) {{\n", kernel.name, arguments.join(", "))
    }

    fn built_in(&self, built_in: naga::BuiltIn) -> Option<&'static str> {
        Some(match built_in {
            naga::BuiltIn::WorkGroupId => " @builtin(workgroup_id)",
            naga::BuiltIn::LocalInvocationIndex => " @builtin(local_invocation_index)",
            naga::BuiltIn::LocalInvocationId => " @builtin(local_invocation_id)",
            naga::BuiltIn::GlobalInvocationId => " @builtin(global_invocation_id)",
            _ => return None,
        })
    }

    fn named_value(&self, _ty: &str, name: &str, value: &str) -> String {
        format!("let {name} = {value};")
    }

    fn variable(&self, _ty: &str, name: &str, value: &str) -> String {
        format!("var {name} = {value};")
    }

    fn array_variable(&self, ty: &str, name: &str, count: u32) -> String {
        format!("var {name}: array<{ty}, {count}>;")
    }

    fn condition(&self, text: &str) -> String {
        text.to_owned()
    }

    fn for_head(&self, first: &str, condition: &str, step: &str) -> String {
        format!("for ({first}; {condition}; {step}) {{")
    }

    fn zero(&self, ty: &str, inner: &TypeInner) -> Result<Text, String> {
        Ok(match super::language::zero_literal(inner) {
            Some(zero) => Text::whole(zero),
            None => call(ty, &[]),
        })
    }

    fn splat(&self, ty: &str, _size: u8, value: Text) -> Text {
        call(ty, &[&value.text])
    }

    fn select(&self, condition: Text, accept: Text, reject: Text, _size: u8, _ty: &str) -> (Text, Option<Helper>) {
        (call("select", &[&reject.text, &accept.text, &condition.text]), None)
    }

    fn bitcast(&self, _to: ScalarKind, ty: &str, _from: &TypeInner, value: &Text) -> Option<Text> {
        Some(call(&format!("bitcast<{ty}>"), &[&value.text]))
    }

    fn math(&self, fun: MathFunction, operands: &[Operand]) -> Option<(Text, Option<Helper>)> {
        use MathFunction as M;
        let name = match fun {
            M::InverseSqrt => "inverseSqrt",
            M::Fract => "fract",
            M::Mix => "mix",
            M::Saturate => "saturate",
            M::Atan2 => "atan2",
            M::Round => "round",
            M::Fma => "fma",
            M::CountOneBits => "countOneBits",
            M::Pack2x16float => "pack2x16float",
            M::Unpack2x16float => "unpack2x16float",
            M::Pack2x16snorm => "pack2x16snorm",
            M::Unpack2x16snorm => "unpack2x16snorm",
            _ => common_function(fun)?,
        };
        let texts: Vec<_> = operands.iter().map(|operand| operand.text.text.as_str()).collect();
        Some((call(name, &texts), None))
    }

    fn image_load(&self, image: &str, coordinate: &Operand, level: &str) -> Text {
        call("textureLoad", &[image, &coordinate.text.text, level])
    }

    fn image_query(&self, image: &str, query: ImageQuery, level: Option<&str>) -> Option<(Text, Option<Helper>)> {
        match query {
            ImageQuery::Size { .. } => Some((call("textureDimensions", &[image, level.unwrap_or("0u")]), None)),
            ImageQuery::NumLevels => Some((call("textureNumLevels", &[image]), None)),
            _ => None,
        }
    }

    fn image_store(&self, image: &str, coordinate: &Operand, value: &str) -> String {
        format!("textureStore({image}, {}, {value});", coordinate.text.text)
    }

    fn atomic_load(&self, place: &str) -> Text {
        call("atomicLoad", &[&format!("&{place}")])
    }

    fn atomic_store(&self, place: &str, value: &str) -> String {
        format!("atomicStore(&{place}, {value});")
    }

    fn atomic(&self, fun: AtomicFunction, place: &str, value: &str, result: Option<(&str, &str)>) -> Option<String> {
        let call = format!("{}(&{place}, {value});", super::language::atomic_function(fun)?);
        Some(match result {
            Some((_, name)) => format!("let {name} = {call}"),
            None => call,
        })
    }

    fn barrier(&self) -> &'static str {
        "workgroupBarrier();"
    }
}
