//! Samplers against a device, where there is one. Devices may use 8 bits for the weight of a texel.

mod device;
mod support;

use device::Gpu;
use limpid_cpu::{AddressMode, Binding, Buffer, Compare, Filter, Sampler, TexelFormat, Texture};
use support::{bits, executor, floats};

const SIZE: [u32; 2] = [8, 4];
const LEVELS: u32 = 3;

/// Texels 0 to 1 of all levels, one component.
fn texels() -> impl Iterator<Item = u32> {
    (0..32 + 8 + 2).map(|i: u32| i.wrapping_mul(2_654_435_761) >> 16)
}

/// On the device, of 16-bit numbers.
fn device_texture(gpu: &Gpu, format: wgpu::TextureFormat) -> wgpu::TextureView {
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width: SIZE[0], height: SIZE[1], depth_or_array_layers: 1 },
        mip_level_count: LEVELS,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    let mut texels = texels();
    for level in 0..LEVELS {
        let [width, height] = SIZE.map(|size| (size >> level).max(1));
        let of_level = texels.by_ref().take((width * height) as usize);
        let half = |i: u32| half::f16::from_f32(i as f32 / 65535.0).to_bits();
        let is_depth = format == wgpu::TextureFormat::Depth16Unorm;
        let bytes: Vec<u8> = of_level.flat_map(|i| if is_depth { i as u16 } else { half(i) }.to_le_bytes()).collect();
        gpu.queue.write_texture(
            wgpu::TexelCopyTextureInfo {
                texture: &texture,
                mip_level: level,
                origin: wgpu::Origin3d::ZERO,
                aspect: wgpu::TextureAspect::All,
            },
            &bytes,
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(2 * width), rows_per_image: None },
            wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        );
    }
    texture.create_view(&Default::default())
}

fn device_sampler(gpu: &Gpu, sampler: Sampler) -> wgpu::Sampler {
    let address = sampler.address.map(|mode| match mode {
        AddressMode::Repeat => wgpu::AddressMode::Repeat,
        AddressMode::MirrorRepeat => wgpu::AddressMode::MirrorRepeat,
        _ => wgpu::AddressMode::ClampToEdge,
    });
    let filter = |filter| if filter == Filter::Linear { wgpu::FilterMode::Linear } else { wgpu::FilterMode::Nearest };
    gpu.device.create_sampler(&wgpu::SamplerDescriptor {
        address_mode_u: address[0],
        address_mode_v: address[1],
        mag_filter: filter(sampler.magnify),
        min_filter: filter(sampler.minify),
        mipmap_filter: match sampler.mip {
            Filter::Linear => wgpu::MipmapFilterMode::Linear,
            Filter::Nearest => wgpu::MipmapFilterMode::Nearest,
        },
        lod_min_clamp: sampler.lod[0],
        lod_max_clamp: sampler.lod[1],
        compare: sampler.compare.map(|compare| match compare {
            Compare::Less => wgpu::CompareFunction::Less,
            _ => wgpu::CompareFunction::GreaterEqual,
        }),
        ..Default::default()
    })
}

/// Coordinates in and around the texture that are on no boundary, with a level of detail and a reference.
fn places() -> Vec<[f32; 4]> {
    (0..256u32)
        .map(|i| {
            let part = |salt: u32, steps: u32| (i.wrapping_mul(2_246_822_519).rotate_left(salt) % steps) as f32;
            let s = (part(3, 384) / 16.0 + 1.0 / 32.0) / SIZE[0] as f32 - 1.0;
            let t = (part(11, 192) / 16.0 + 1.0 / 32.0) / SIZE[1] as f32 - 1.0;
            [s, t, part(19, 44) / 16.0 - 0.4, part(25, 64) / 64.0]
        })
        .collect()
}

fn check(gpu: &Gpu, expression: &str, depth: bool, sampler: Sampler) {
    let texture_type = if depth { "texture_depth_2d" } else { "texture_2d<f32>" };
    let kind = if sampler.compare.is_some() { "sampler_comparison" } else { "sampler" };
    let source = format!(
        "@group(0) @binding(0) var<storage, read_write> out: array<vec4<f32>>;
        @group(0) @binding(1) var<storage, read> numbers: array<vec4<f32>>;
        @group(0) @binding(2) var image: {texture_type};
        @group(0) @binding(3) var s: {kind};
        @compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3<u32>) {{
            let p = numbers[id.x];
            out[id.x] = vec4({expression});
        }}"
    );
    let places = places();
    let input: Vec<u32> = places.iter().flat_map(|place| bits(place)).collect();
    let format = if depth { wgpu::TextureFormat::Depth16Unorm } else { wgpu::TextureFormat::R16Float };
    let (view, device_sampler) = (device_texture(gpu, format), device_sampler(gpu, sampler));
    let more = [
        wgpu::BindGroupEntry { binding: 2, resource: wgpu::BindingResource::TextureView(&view) },
        wgpu::BindGroupEntry { binding: 3, resource: wgpu::BindingResource::Sampler(&device_sampler) },
    ];
    let device = floats(&gpu.run_with(&source, 4, 4 * 256, &input, &more));
    let mut texture = Texture::with_levels(TexelFormat::R32Float, SIZE[0], SIZE[1], LEVELS);
    let stored = |i: f32| if depth { i } else { half::f16::from_f32(i).to_f32() };
    texture.write(texels().map(|i| stored(i as f32 / 65535.0).to_bits()));
    let (out, input) = (Buffer::zeroed(4 * 256), Buffer::new(input));
    let bindings = [
        Binding::buffer(0, 0, &out),
        Binding::buffer(0, 1, &input),
        Binding::texture(0, 2, &texture),
        Binding::sampler(0, 3, sampler),
    ];
    executor(&source).dispatch([4, 1, 1], &bindings).unwrap();
    for ((place, cpu), device) in places.iter().zip(floats(&out.read()).chunks(4)).zip(device.chunks(4)) {
        let close = cpu.iter().zip(device).all(|(a, b)| (a - b).abs() < 3.0 / 256.0);
        assert!(close, "{expression} at {place:?} with {sampler:?}: CPU {cpu:?}, device {device:?}");
    }
}

fn samplers() -> impl Iterator<Item = Sampler> {
    use AddressMode as M;
    let addresses = [[M::ClampToEdge, M::Repeat], [M::Repeat, M::MirrorRepeat], [M::MirrorRepeat, M::ClampToEdge]];
    addresses.into_iter().flat_map(|address| {
        (0..8).map(move |choice: u32| {
            let filter = |bit: u32| if choice >> bit & 1 == 1 { Filter::Linear } else { Filter::Nearest };
            let lod = if choice == 3 { [0.6, 1.3] } else { [0.0, 32.0] };
            Sampler { address, magnify: filter(0), minify: filter(1), mip: filter(2), lod, ..Default::default() }
        })
    })
}

#[test]
fn samples_agree_within_the_weights_of_a_device() {
    let Some(gpu) = Gpu::open(wgpu::Features::empty()) else { return };
    for sampler in samplers() {
        check(&gpu, "textureSampleLevel(image, s, p.xy, p.z)", false, sampler);
        check(&gpu, "textureSampleLevel(image, s, p.xy, p.z, vec2(2, -1))", false, sampler);
        check(&gpu, "textureSampleBaseClampToEdge(image, s, p.xy)", false, sampler);
        check(&gpu, "textureGather(0, image, s, p.xy)", false, sampler);
    }
}

#[test]
fn depth_comparisons_agree() {
    let Some(gpu) = Gpu::open(wgpu::Features::empty()) else { return };
    for sampler in samplers() {
        for compare in [Compare::Less, Compare::GreaterEqual] {
            let sampler = Sampler { compare: Some(compare), ..sampler };
            check(&gpu, "textureSampleCompareLevel(image, s, p.xy, p.w)", true, sampler);
            check(&gpu, "textureGatherCompare(image, s, p.xy, p.w)", true, sampler);
        }
        let nearest = Sampler { magnify: Filter::Nearest, minify: Filter::Nearest, mip: Filter::Nearest, ..sampler };
        check(&gpu, "textureSampleLevel(image, s, p.xy, u32(max(p.z, 0.0)))", true, nearest);
        check(&gpu, "textureGather(image, s, p.xy)", true, nearest);
    }
}
