//! Checked execution finds what kernels must not do, and limpid's kernels do none of it.

use glam::{Mat4, UVec2, Vec2, camera::rh};
use limpid::settings::{Fallback, Pipeline, RayList, RaysPerQuad};
use limpid::{Camera, FrameInputs, Settings};
use limpid_cpu::{Binding, Buffer, Denoiser, Executor, Fault, FaultKind, Inputs, PrevGbuffer, TexelFormat, Texture};

/// Faults of one workgroup of 64 with a buffer of 64 words.
fn faults(body: &str) -> Vec<(Fault, String)> {
    let source = format!(
        "@group(0) @binding(0) var<storage, read_write> numbers: array<u32>;
        var<workgroup> shared_words: array<u32, 64>;
        var<workgroup> counter: atomic<u32>;
        @compute @workgroup_size(64)
        fn main(@builtin(local_invocation_index) lane: u32) {{
{body}
        }}"
    );
    let module = naga::front::wgsl::parse_str(&source).unwrap_or_else(|e| panic!("{}", e.emit_to_string(&source)));
    let mut validator = naga::valid::Validator::new(naga::valid::ValidationFlags::all(), Default::default());
    let executor = Executor::new(&module, &validator.validate(&module).unwrap(), "main").unwrap();
    let numbers = Buffer::zeroed(64);
    let found = executor.dispatch_checked([1, 1, 1], &[Binding::buffer(0, 0, &numbers)]).unwrap();
    let text = |fault: &Fault| source[fault.offset.unwrap()..].lines().next().unwrap_or_default().to_owned();
    found.into_iter().map(|fault| (fault.clone(), text(&fault))).collect()
}

fn kinds(body: &str) -> Vec<FaultKind> {
    faults(body).into_iter().map(|(fault, _)| fault.kind).collect()
}

#[test]
fn a_barrier_between_write_and_read_is_needed() {
    let exchange = "numbers[lane] = shared_words[63u - lane];";
    let with = format!("shared_words[lane] = lane;\nworkgroupBarrier();\n{exchange}");
    let without = format!("shared_words[lane] = lane;\n{exchange}");
    assert_eq!(kinds(&with), []);
    let load = format!("shared_words[lane] = lane;\nlet all = workgroupUniformLoad(&shared_words[5]);\n{exchange}");
    assert_eq!(kinds(&load), []);
    let found = faults(&without);
    assert_eq!(found.len(), 1);
    assert_eq!((found[0].0.kind, found[0].0.invocation, found[0].0.count), (FaultKind::Race, 0, 64));
    assert!(found[0].1.contains("63u - lane"), "{}", found[0].1);
}

#[test]
fn overwriting_what_others_read_needs_a_barrier() {
    let start = "shared_words[lane] = lane;\nworkgroupBarrier();\nlet seen = shared_words[(lane + 1u) % 64u];\n";
    let end = "shared_words[lane] = seen;\nworkgroupBarrier();\nnumbers[lane] = shared_words[lane];";
    assert_eq!(kinds(&format!("{start}{end}")), [FaultKind::Race]);
    assert_eq!(kinds(&format!("{start}workgroupBarrier();\n{end}")), []);
    // Several invocations writing one word is a race, atomically it is not.
    assert_eq!(kinds("shared_words[0] = lane;"), [FaultKind::Race]);
    assert_eq!(
        kinds("if lane == 0u { atomicStore(&counter, 0u); }\nworkgroupBarrier();\natomicAdd(&counter, 1u);"),
        []
    );
}

#[test]
fn memory_must_be_written_before_it_is_read() {
    let found =
        faults("if lane < 32u { shared_words[lane] = 1u; }\nworkgroupBarrier();\nnumbers[lane] = shared_words[lane];");
    assert_eq!(found.len(), 1);
    assert_eq!((found[0].0.kind, found[0].0.invocation, found[0].0.count), (FaultKind::UninitializedRead, 32, 32));
}

#[test]
fn bounds_are_watched_for_active_invocations_only() {
    assert_eq!(kinds("numbers[lane + 1u] = 1u;"), [FaultKind::WriteOutOfBounds]);
    assert_eq!(kinds("numbers[lane] = numbers[lane * 2u];"), [FaultKind::ReadOutOfBounds]);
    assert_eq!(kinds("if lane < 32u { numbers[lane] = numbers[lane * 2u]; }"), []);
}

#[test]
fn barriers_must_be_reached_by_all() {
    // naga lets this pass.
    let found = kinds("if numbers[lane] == lane { workgroupBarrier(); }");
    assert_eq!(found, [FaultKind::DivergentBarrier]);
}

/// A deterministic number in 0..1.
fn noise(seed: u32) -> f32 {
    let hash = (seed ^ seed >> 15).wrapping_mul(0x2c1b_3c6d);
    let hash = (hash ^ hash >> 12).wrapping_mul(0x297a_2d39);
    ((hash ^ hash >> 15) >> 8) as f32 / (1 << 24) as f32
}

fn image(format: TexelFormat, size: UVec2, texel: impl Fn(UVec2) -> Vec<f32>) -> Texture {
    let mut texture = Texture::new(format, size.x, size.y);
    let pixels = (0..size.y).flat_map(|y| (0..size.x).map(move |x| UVec2::new(x, y)));
    texture.write(pixels.flat_map(texel).map(f32::to_bits));
    texture
}

#[test]
fn kernels_do_nothing_of_the_kind() {
    let camera = Camera {
        world_to_view: Mat4::IDENTITY,
        view_to_clip: rh::proj::directx::perspective(1.0, 1.6, 0.1, 100.0),
        jitter: Vec2::ZERO,
    };
    use Pipeline::{Footprint, Published};
    for (index, (pipeline, fallback, rays)) in [
        (Footprint, Fallback::Input, None),
        (Published, Fallback::Black, Some(RaysPerQuad::One)),
        (Footprint, Fallback::Environment, Some(RaysPerQuad::Two)),
        (Published, Fallback::Environment, None),
        (Footprint, Fallback::Input, Some(RaysPerQuad::Four)),
    ]
    .into_iter()
    .enumerate()
    {
        let mut settings = Settings::default();
        settings.features.gbuffer_copy = index % 4 == 0;
        settings.features.packed_guide = index < 2;
        settings.pipeline = pipeline;
        settings.conventions.depth = limpid::settings::DepthEncoding::Linear;
        settings.features.hit_motion = true;
        settings.coverage.roughness_threshold = 0.7;
        settings.coverage.fallback = fallback;
        settings.coverage.ray_list = rays.map(|rays| {
            let mut list = RayList::default();
            list.rays_per_quad = rays;
            list.variance_threshold = Some(0.1);
            list
        });
        let size = UVec2::new(61, 37);
        let mut denoiser = Denoiser::new(&settings, size).unwrap();
        denoiser.watch();
        let environment = Texture::with_levels(TexelFormat::Rgba32Float, 32, 16, 5);
        for number in 0..4u32 {
            let seed = |p: UVec2, salt: u32| noise((p.y * 61 + p.x) * 16 + salt + number * 100_003);
            // Tiles of sky, steps in depth, all roughness, motion to everywhere.
            let sky = |p: UVec2| (p.x / 16 + p.y / 16).is_multiple_of(3);
            let depth = |p: UVec2| if sky(p) { 0.0 } else { 2.0 + f32::from(p.x > 30) * 3.0 };
            let radiance =
                image(TexelFormat::Rgba32Float, size, |p| vec![seed(p, 1), seed(p, 2) * 9.0, 0.5, seed(p, 3) * 20.0]);
            let normal = image(TexelFormat::Rgba32Float, size, |p| vec![0.1 * seed(p, 4), 0.0, 1.0, 0.0]);
            let roughness = image(TexelFormat::R32Float, size, |p| vec![seed(p / 8, 5)]);
            let depth = image(TexelFormat::R32Float, size, |p| vec![depth(p)]);
            let motion = image(TexelFormat::Rg32Float, size, |p| vec![seed(p, 6) * 0.3 - 0.15, seed(p, 7) * 3.0 - 1.5]);
            let hit_motion =
                image(TexelFormat::Rgba32Float, size, |p| vec![seed(p, 8) - 0.5, seed(p, 9) * 1e30, 0.0, 0.0]);
            // The last frame uses a part of the textures.
            let frame_size = if number == 3 { UVec2::new(33, 20) } else { size };
            let inputs = Inputs {
                radiance: &radiance,
                normal: &normal,
                roughness: &roughness,
                depth: &depth,
                motion: &motion,
                hit_motion: Some(&hit_motion),
                environment: Some(&environment),
                previous: Some(PrevGbuffer { normal: &normal, roughness: &roughness, depth: &depth }),
            };
            denoiser.denoise(&inputs, &FrameInputs::new(camera, frame_size)).unwrap();
        }
        let found: Vec<_> = denoiser.faults().map(|(_, place, fault)| format!("{place}: {}", fault.kind)).collect();
        assert!(found.is_empty(), "{found:#?}");
    }
}
