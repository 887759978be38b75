//! Exported WGSL and SPIR-V compute what the kernels compute: naga reads them again, and they run on the CPU backend, to
//! the same bits.

use glam::UVec2;
use limpid::emit::{SpirvOptions, WgslOptions};
use limpid::kernel::Kernel;
use limpid::{Denoiser, Plan};
use limpid_cli::scene;
use limpid_harness::executor::Cpu;

mod covering;
mod frames;

const SIZE: UVec2 = UVec2::new(60, 34);

/// The kernel with another program.
fn with_module(kernel: &Kernel, mut module: naga::Module) -> Kernel {
    module.entry_points[0].name = kernel.name.to_owned();
    let flags = naga::valid::ValidationFlags::all() - naga::valid::ValidationFlags::BINDINGS;
    let info = naga::valid::Validator::new(flags, naga::valid::Capabilities::all()).validate(&module).unwrap();
    Kernel { module, info, ..kernel.clone() }
}

/// Compares what kernels leave in memory with what their replacements do.
fn assert_same(replaced: impl Fn(&Kernel) -> Kernel) {
    let scene = scene::by_name("gallery").unwrap();
    for (name, settings) in covering::covering_settings() {
        let case = frames::case(&settings, (0..3).map(|number| scene.render(number, SIZE, 0)));
        let (plan, kernels) = Plan::new(&case.settings, SIZE).unwrap();
        let replacements = kernels.iter().map(&replaced).collect();
        let expected = case.run(&mut Cpu::new());
        let found = case.run_plan(&mut Cpu::new(), Denoiser::with_plan(&case.settings, plan, replacements));
        frames::assert_same(&name, &expected, &found);
    }
}

#[test]
fn wgsl_read_by_naga_computes_the_same() {
    assert_same(|kernel| {
        let text = kernel.wgsl(&WgslOptions::default()).unwrap();
        with_module(kernel, naga::front::wgsl::parse_str(&text).unwrap())
    });
}

#[test]
fn spirv_read_by_naga_computes_the_same() {
    assert_same(|kernel| {
        let words = kernel.spirv(&SpirvOptions::default()).unwrap();
        let options = naga::front::spv::Options { adjust_coordinate_space: false, ..Default::default() };
        let module = naga::front::spv::parse_u8_slice(bytemuck::cast_slice(&words), &options).unwrap();
        with_module(kernel, module)
    });
}
