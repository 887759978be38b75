//! Exported HLSL and GLSL compute what the kernels compute: DXC and glslang make SPIR-V of them, the ash backend runs it,
//! and everything that it leaves in memory has the bits that naga's SPIR-V leaves there.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use glam::UVec2;
use limpid::Plan;
use limpid::emit::{GlslDialect, GlslOptions, HlslOptions};
use limpid::kernel::Kernel;
use limpid_ash::SpirvSource;
use limpid_cli::scene;
use limpid_harness::executor::{Ash, AshOptions};

mod covering;
mod frames;
mod tools;

const SIZE: UVec2 = UVec2::new(60, 34);

/// From entry point and text to SPIR-V.
type Compile = Box<dyn Fn(&str, &str) -> Vec<u8>>;

/// A way from a kernel through another language to SPIR-V.
struct Detour {
    text: fn(&Kernel) -> String,
    compile: Compile,
    /// What was compiled before: most kernels are the same in most settings.
    compiled: HashMap<String, Vec<u32>>,
}

impl Detour {
    fn new(text: fn(&Kernel) -> String, compile: impl Fn(&str, &str) -> Vec<u8> + 'static) -> Self {
        Self { text, compile: Box::new(compile), compiled: HashMap::new() }
    }

    fn spirv(&mut self, kernel: &Kernel) -> Vec<u32> {
        let text = (self.text)(kernel);
        let compile = |text: &String| bytemuck::pod_collect_to_vec(&(self.compile)(kernel.name, text));
        self.compiled.entry(text).or_insert_with_key(compile).clone()
    }

    fn source(&mut self, kernels: &[Kernel]) -> SpirvSource {
        let words: BTreeMap<_, _> = kernels.iter().map(|kernel| (kernel.name, self.spirv(kernel))).collect();
        Arc::new(move |kernel| Ok(words[kernel.name].clone()))
    }
}

/// Mesa's lavapipe. It computes the same expression to the same bits, whatever is around it; other drivers need not.
const DEVICE: &str = "llvmpipe";

/// Compares every preset, feature and some mixtures.
fn assert_same(mut detour: Detour) {
    let open = |spirv| Ash::try_open(&AshOptions { device: DEVICE.to_owned(), spirv, ..AshOptions::default() });
    let mut direct = match open(None) {
        Ok(ash) => ash,
        Err(error) => return limpid_harness::skip(&error.to_string()),
    };
    let scene = scene::by_name("gallery").unwrap();
    for (name, settings) in covering::covering_settings() {
        let case = frames::case(&settings, (0..3).map(|number| scene.render(number, SIZE, 0)));
        let (_, kernels) = Plan::new(&case.settings, SIZE).unwrap();
        let mut replaced = open(Some(detour.source(&kernels))).unwrap();
        frames::assert_same(&name, &case.run(&mut direct), &case.run(&mut replaced));
    }
}

/// What DXC makes of `mul(matrix, vector)` in a column-major world is a vector times a transposed matrix, of which Mesa adds
/// up the products in another order than of a matrix times a vector: with the matrices the other way round, the order is
/// that of naga.
const SAME_ORDER: [&str; 4] = ["-D", "column_major=row_major", "-D", "mul(m, v)=mul(v, m)"];

#[test]
fn hlsl_compiled_by_dxc_computes_the_same() {
    let Some(compiler) = tools::dxc() else { return };
    let text = |kernel: &Kernel| kernel.hlsl(&HlslOptions { vk_binding: true, ..HlslOptions::default() }).unwrap();
    let detour = Detour::new(text, move |entry_point, text| {
        let arguments = ["-T", "cs_6_0", "-E", entry_point, "-WX", "-spirv"];
        tools::compile_hlsl(&compiler, text, &[&arguments[..], &SAME_ORDER].concat())
    });
    assert_same(detour);
}

#[test]
fn glsl_compiled_by_glslang_computes_the_same() {
    if !tools::has("glslangValidator") {
        return;
    }
    let folder = tools::Folder::new("glsl-round-trip");
    let text =
        |kernel: &Kernel| kernel.glsl(&GlslOptions { dialect: GlslDialect::Vulkan, ..GlslOptions::default() }).unwrap();
    let detour = Detour::new(text, move |entry_point, text| {
        let (source, object) = (folder.join("source.comp"), folder.join("object.spv"));
        std::fs::write(&source, text).unwrap();
        let renamed = ["-V", "--source-entrypoint", "main", "-e", entry_point];
        let paths = ["-o", object.to_str().unwrap(), source.to_str().unwrap()];
        tools::run("glslangValidator", &[&renamed[..], &paths].concat());
        std::fs::read(&object).unwrap()
    });
    assert_same(detour);
}
