//! Exported texts compute what the kernels compute: each is compiled by another compiler, and what comes out runs on
//! the CPU backend or a device, to the same bits.

use glam::UVec2;
use limpid::emit::{GlslDialect, GlslOptions, HlslOptions, SpirvOptions, WgslOptions};
use limpid::kernel::Kernel;
use limpid::resource::{Copy, Kind};
use limpid::settings::{Fallback, NormalEncoding, RayList, RaysPerQuad, RoughnessEncoding};
use limpid::{FrameInputs, Plan, Preset, Settings};
use limpid_cli::scene;
use limpid_cpu::{TexelFormat, Texture};

mod device;
mod tools;

use device::Device;

const SIZE: UVec2 = UVec2::new(60, 34);

/// Settings that together switch everything on and off that changes code.
fn covering_settings() -> Vec<Settings> {
    let mut mirrored = Preset::Reference.settings();
    mirrored.coverage.fallback = Fallback::Environment;
    mirrored.conventions.roughness = RoughnessEncoding::Alpha;
    let mut sparse = Settings::default();
    sparse.coverage.fallback = Fallback::Black;
    sparse.coverage.roughness_threshold = 0.5;
    sparse.conventions.normal = NormalEncoding::Unsigned;
    let list = |rays, threshold| {
        let mut list = RayList::default();
        (list.rays_per_quad, list.variance_threshold) = (rays, threshold);
        Some(list)
    };
    sparse.coverage.ray_list = list(RaysPerQuad::One, Some(0.05));
    let mut paired = Settings::default();
    paired.conventions.normal = NormalEncoding::OctahedralUnsigned;
    paired.coverage.ray_list = list(RaysPerQuad::Two, None);
    vec![Settings::default(), mirrored, sparse, paired]
}

fn texture(format: TexelFormat, values: impl Iterator<Item = f32>) -> Texture {
    let mut texture = Texture::new(format, SIZE.x, SIZE.y);
    texture.write(values.map(f32::to_bits));
    texture
}

/// All that the denoiser holds after some frames.
fn state(settings: &Settings, kernels: Vec<Kernel>) -> Vec<(String, Vec<u32>)> {
    let (plan, _) = Plan::new(settings, SIZE).unwrap();
    let core = limpid::Denoiser::with_plan(settings, plan.clone(), kernels);
    let mut denoiser = limpid_cpu::Denoiser::with_core(core).unwrap();
    let scene = scene::by_name("gallery").unwrap();
    let mut environment = Texture::with_levels(TexelFormat::R32Float, 16, 8, 4);
    environment.write((0..16 * 8 + 8 * 4 + 4 * 2 + 2).map(|i| (0.1 + (i % 7) as f32).to_bits()));
    for number in 0..3 {
        let frame = scene.render(number, SIZE, 0);
        let radiance = texture(TexelFormat::Rgba32Float, frame.radiance.iter().flatten().copied());
        let normal = texture(TexelFormat::Rgba32Float, frame.normal.iter().flat_map(|&[x, y, z]| [x, y, z, 0.0]));
        let roughness = texture(TexelFormat::R32Float, frame.roughness.iter().copied());
        let depth = texture(TexelFormat::R32Float, frame.depth.iter().copied());
        let motion = texture(TexelFormat::Rg32Float, frame.motion.iter().flatten().copied());
        let inputs = limpid_cpu::Inputs {
            radiance: &radiance,
            normal: &normal,
            roughness: &roughness,
            depth: &depth,
            motion: &motion,
            environment: Some(&environment),
        };
        denoiser.denoise(&inputs, &FrameInputs::new(frame.camera, SIZE)).unwrap();
    }
    let copies = [Copy::Current, Copy::Previous];
    let textures = plan.resources.iter().filter(|r| matches!(r.kind, Kind::Texture { .. })).flat_map(|resource| {
        copies[..1 + usize::from(resource.ping_pong)].iter().map(|&copy| {
            let texture = denoiser.intermediate_texture(&resource.name, copy).unwrap();
            (format!("{} {copy:?}", resource.name), texture.read())
        })
    });
    let textures: Vec<_> = textures.collect();
    let buffers = plan.resources.iter().filter(|r| matches!(r.kind, Kind::Buffer { .. }) && r.name != "rays");
    // Workgroups enter lists in any order.
    let sorted = |mut words: Vec<u32>| {
        words.sort_unstable();
        words
    };
    let buffers = buffers.map(|r| (r.name.clone(), sorted(denoiser.intermediate_buffer(&r.name).unwrap().read())));
    let buffers: Vec<_> = buffers.collect();
    textures.into_iter().chain(buffers).collect()
}

/// The kernel with another program, if the CPU backend runs it.
fn with_module(kernel: &Kernel, mut module: naga::Module) -> Result<Kernel, String> {
    module.entry_points[0].name = kernel.name.to_owned();
    let flags = naga::valid::ValidationFlags::all() - naga::valid::ValidationFlags::BINDINGS;
    let info = naga::valid::Validator::new(flags, naga::valid::Capabilities::all()).validate(&module);
    let info = info.map_err(|error| format!("{:?}", error.as_inner()))?;
    limpid_cpu::Executor::new(&module, &info, kernel.name).map_err(|error| error.to_string())?;
    Ok(Kernel { module, info, ..kernel.clone() })
}

fn from_spirv(kernel: &Kernel, bytes: &[u8]) -> Result<Kernel, String> {
    let options = naga::front::spv::Options { adjust_coordinate_space: false, ..Default::default() };
    let module = naga::front::spv::parse_u8_slice(bytes, &options).map_err(|error| error.to_string())?;
    with_module(kernel, module)
}

/// Compares the state that kernels leave behind with that of their replacements.
fn assert_same(replaced: impl Fn(&Kernel) -> Kernel) {
    for (number, settings) in covering_settings().iter().enumerate() {
        let (_, kernels) = Plan::new(settings, SIZE).unwrap();
        let replacements = kernels.iter().map(&replaced).collect();
        let (expected, found) = (state(settings, kernels), state(settings, replacements));
        assert!(expected.iter().any(|(_, words)| words.iter().any(|&word| word != 0)));
        for ((name, expected), (_, found)) in expected.iter().zip(&found) {
            let differing = expected.iter().zip(found).filter(|(a, b)| a != b).count();
            assert_eq!(differing, 0, "settings {number}: {differing} of {} words of {name}", expected.len());
        }
    }
}

#[test]
fn wgsl_read_by_naga_computes_the_same() {
    assert_same(|kernel| {
        let text = kernel.wgsl(&WgslOptions::default()).unwrap();
        with_module(kernel, naga::front::wgsl::parse_str(&text).unwrap()).unwrap()
    });
}

#[test]
fn spirv_read_by_naga_computes_the_same() {
    assert_same(|kernel| {
        let words = kernel.spirv(&SpirvOptions::default()).unwrap();
        from_spirv(kernel, bytemuck::cast_slice(&words)).unwrap()
    });
}

#[test]
fn glsl_compiled_by_glslang_computes_the_same() {
    if !tools::has("glslangValidator") {
        return;
    }
    let folder = tools::Folder::new("glsl-text");
    assert_same(|kernel| {
        let options = GlslOptions { dialect: GlslDialect::Vulkan, ..GlslOptions::default() };
        let (text, object) = (folder.join(&format!("{}.comp", kernel.name)), folder.join("object.spv"));
        std::fs::write(&text, kernel.glsl(&options).unwrap()).unwrap();
        tools::run("glslangValidator", &["-V", "-o", object.to_str().unwrap(), text.to_str().unwrap()]);
        from_spirv(kernel, &std::fs::read(&object).unwrap()).unwrap()
    });
}

/// The textures that a device holds after some frames.
fn state_on_device(device: &Device, settings: &Settings, kernels: Vec<Kernel>) -> Vec<(String, Vec<u32>)> {
    let (plan, _) = Plan::new(settings, SIZE).unwrap();
    let core = limpid::Denoiser::with_plan(settings, plan.clone(), kernels);
    let options = limpid_wgpu::Options { readable_intermediates: true, ..Default::default() };
    let mut denoiser = limpid_wgpu::Denoiser::with_core(&device.device, core, options).unwrap();
    let scene = scene::by_name("gallery").unwrap();
    for number in 0..3 {
        let frame = scene.render(number, SIZE, 0);
        let bits = |values: &mut dyn Iterator<Item = f32>| values.map(f32::to_bits).collect::<Vec<_>>();
        let upload = |format, words: Vec<u32>| device.upload(SIZE, format, &words);
        use wgpu::TextureFormat::{R32Float, Rg32Float, Rgba32Float};
        let radiance = upload(Rgba32Float, bits(&mut frame.radiance.iter().flatten().copied()));
        let normals = bits(&mut frame.normal.iter().flat_map(|&[x, y, z]| [x, y, z, 0.0]));
        let normal = upload(Rgba32Float, normals);
        let roughness = upload(R32Float, bits(&mut frame.roughness.iter().copied()));
        let depth = upload(R32Float, bits(&mut frame.depth.iter().copied()));
        let motion = upload(Rg32Float, bits(&mut frame.motion.iter().flatten().copied()));
        let inputs = limpid_wgpu::Inputs {
            radiance: &radiance,
            normal: &normal,
            roughness: &roughness,
            depth: &depth,
            motion: &motion,
            environment: Some(&radiance),
        };
        let mut encoder = device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        denoiser.encode(&device.queue, &mut encoder, &inputs, &FrameInputs::new(frame.camera, SIZE)).unwrap();
        device.queue.submit([encoder.finish()]);
    }
    let textures = plan.resources.iter().filter(|r| matches!(r.kind, Kind::Texture { .. }));
    let read = |resource: &limpid::resource::Resource| {
        let texture = denoiser.intermediate_texture(&resource.name, Copy::Current).unwrap();
        (resource.name.clone(), device.words(texture))
    };
    textures.map(read).collect()
}

/// DXC does not say that images are never read, which the layout of the pipeline does.
fn only_stored(module: &mut naga::Module) {
    let types: Vec<_> = module.types.iter().map(|(handle, ty)| (handle, ty.clone())).collect();
    for (handle, mut ty) in types {
        if let naga::TypeInner::Image { class: naga::ImageClass::Storage { access, .. }, .. } = &mut ty.inner {
            *access = naga::StorageAccess::STORE;
            module.types.replace(handle, ty);
        }
    }
}

/// By DXC to SPIR-V, on a device: what DXC writes is not all known to the CPU backend. Not optimised, for naga does
/// not read all that optimising makes.
#[test]
fn hlsl_compiled_by_dxc_computes_the_same() {
    let (Some(compiler), Some(device)) = (tools::dxc(), Device::open()) else { return };
    for (number, settings) in covering_settings().iter().enumerate() {
        let (_, kernels) = Plan::new(settings, SIZE).unwrap();
        let replacements = kernels
            .iter()
            .map(|kernel| {
                let text = kernel.hlsl(&HlslOptions { vk_binding: true, ..HlslOptions::default() }).unwrap();
                let object =
                    tools::compile_hlsl(&compiler, &text, &["-T", "cs_6_0", "-E", kernel.name, "-WX", "-spirv", "-O0"]);
                let options = naga::front::spv::Options { adjust_coordinate_space: false, ..Default::default() };
                let mut module = naga::front::spv::parse_u8_slice(&object, &options).unwrap();
                module.entry_points[0].name = kernel.name.to_owned();
                only_stored(&mut module);
                Kernel { module, ..kernel.clone() }
            })
            .collect();
        let expected = state_on_device(&device, settings, kernels);
        let found = state_on_device(&device, settings, replacements);
        assert!(expected.iter().any(|(_, words)| words.iter().any(|&word| word != 0)));
        for ((name, expected), (_, found)) in expected.iter().zip(&found) {
            let differing = expected.iter().zip(found).filter(|(a, b)| a != b).count();
            assert_eq!(differing, 0, "settings {number}: {differing} of {} words of {name}", expected.len());
        }
    }
}
