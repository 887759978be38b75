//! The list of rays that the renderer is asked to trace.

mod support;

use glam::{UVec2, Vec3};
use limpid::Settings;
use limpid::settings::{Pipeline, RayList, RaysPerQuad};
use support::{Gpu, Pixel, Run, SKY, Scene, WALL, linear_settings, noise, positions, still_frame};

const SIZE: UVec2 = UVec2::new(83, 45);

#[derive(Clone, Copy, PartialEq, Debug)]
enum Kind {
    Sky,
    TooRough,
    Mirror,
    Glossy,
}

fn is_denoised(kind: Kind) -> bool {
    matches!(kind, Kind::Mirror | Kind::Glossy)
}

struct Ray {
    pixel: UVec2,
    /// The pixels of its quad that receive a copy.
    copies: Vec<UVec2>,
}

fn settings(rays_per_quad: RaysPerQuad, variance_threshold: Option<f32>) -> Settings {
    let mut settings = linear_settings();
    settings.coverage.roughness_threshold = 0.9;
    let mut list = RayList::default();
    list.rays_per_quad = rays_per_quad;
    list.variance_threshold = variance_threshold;
    settings.coverage.ray_list = Some(list);
    settings
}

fn scene(kinds: &[Kind], radiance: impl Fn(UVec2) -> f32) -> Scene {
    let mut kinds = kinds.iter();
    Scene::new(SIZE, |p| {
        let pixel = match kinds.next().unwrap() {
            Kind::Sky => SKY,
            Kind::TooRough => Pixel { roughness: 1.0, ..WALL },
            Kind::Mirror => Pixel { roughness: 0.005, ..WALL },
            Kind::Glossy => WALL,
        };
        Pixel { radiance: Vec3::splat(radiance(p)), ..pixel }
    })
}

fn index(p: UVec2) -> usize {
    (p.y * SIZE.x + p.x) as usize
}

/// Classifies only, and reads the list. Checks that the indirect grid covers it.
fn classify(run: &mut Run<'_>, scene: &Scene) -> Vec<Ray> {
    let images = scene.upload(run.gpu);
    let mut encoder = run.gpu.encoder();
    run.denoiser.encode_classify(&run.gpu.queue, &mut encoder, &images.inputs(), &still_frame(scene.size)).unwrap();
    run.gpu.queue.submit([encoder.finish()]);
    let list = run.denoiser.ray_list().unwrap();
    let args = run.gpu.read_words(list.args);
    let words = run.gpu.read_words(list.rays);
    let &[x, y, z, count] = &args[list.args_offset as usize / 4..][..4] else { unreachable!() };
    // 64 rays a workgroup, 4096 workgroups a row.
    let groups = count.div_ceil(64);
    assert_eq!([x, y, z], [groups.min(4096), groups.div_ceil(4096), 1], "grid for {count} rays");
    let ray = |word: &u32| {
        let pixel = UVec2::new(word & 0x3fff, (word >> 14) & 0x3fff);
        let others = [UVec2::new(1, 0), UVec2::new(0, 1), UVec2::new(1, 1)];
        let copies = (0..3).filter(|bit| word >> (28 + bit) & 1 == 1).map(|bit| pixel ^ others[bit]).collect();
        assert_eq!(word >> 31, 0);
        Ray { pixel, copies }
    };
    words[..count as usize].iter().map(ray).collect()
}

/// The pixels that share a ray: a quad, or a row of it.
fn shared(rays_per_quad: RaysPerQuad, p: UVec2) -> UVec2 {
    match rays_per_quad {
        RaysPerQuad::One => p / 2,
        RaysPerQuad::Two => UVec2::new(p.x / 2, p.y),
        RaysPerQuad::Four => p,
    }
}

/// Every pixel that gets a ray: those that `insist`, and of each group of pixels that share one the first on
/// the sampling pattern, else the first at all.
fn expected_rays(rays_per_quad: RaysPerQuad, kinds: &[Kind], insists: impl Fn(UVec2) -> bool) -> Vec<UVec2> {
    let on_pattern = |p: UVec2| rays_per_quad != RaysPerQuad::Two || (p.x + p.y).is_multiple_of(2);
    let needs_ray = |p: UVec2| p.cmplt(SIZE).all() && is_denoised(kinds[index(p)]);
    let stands_for_others = |p: UVec2| {
        let quad = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|offset| p / 2 * 2 + UVec2::from(offset));
        let in_group = |q: &UVec2| needs_ray(*q) && shared(rays_per_quad, *q) == shared(rays_per_quad, p);
        let group = || quad.into_iter().filter(in_group);
        group().find(|q| on_pattern(*q)).or_else(|| group().next()) == Some(p)
    };
    positions(SIZE).filter(|p| needs_ray(*p) && (insists(*p) || stands_for_others(*p))).collect()
}

fn assert_covers_each_pixel_once(rays: &[Ray], kinds: &[Kind], what: &str) {
    let mut covered = vec![0; kinds.len()];
    for ray in rays {
        for p in ray.copies.iter().chain([&ray.pixel]) {
            assert!(p.cmplt(SIZE).all(), "{what}: {p} of the ray at {} is off screen", ray.pixel);
            assert_eq!(*p / 2, ray.pixel / 2, "{what}: outside the quad");
            covered[index(*p)] += 1;
        }
    }
    for (p, (count, kind)) in positions(SIZE).zip(covered.iter().zip(kinds)) {
        assert_eq!(*count, i32::from(is_denoised(*kind)), "{what}: {kind:?} at {p}");
    }
}

fn sorted(mut pixels: Vec<UVec2>) -> Vec<UVec2> {
    pixels.sort_by_key(|p| (p.y, p.x));
    pixels
}

#[test]
fn each_denoised_pixel_gets_one_ray_or_copy_and_no_ray_is_wasted() {
    let Some(gpu) = Gpu::open() else { return };
    for rays_per_quad in [RaysPerQuad::One, RaysPerQuad::Two, RaysPerQuad::Four] {
        let mut run = Run::new(&gpu, &settings(rays_per_quad, None), SIZE);
        // Shares of sky, too rough and mirror pixels, in whole tiles and single pixels.
        for (seed, [sky, rough, mirror]) in
            [[0.5, 0.1, 0.1], [0.8, 0.1, 0.05], [0.0, 0.0, 0.0], [0.1, 0.1, 0.8], [1.0, 0.0, 0.0]]
                .into_iter()
                .enumerate()
        {
            let kinds: Vec<Kind> = positions(SIZE)
                .map(|p| {
                    let at = if noise(50, p / 8) < 0.3 { p / 8 } else { p };
                    match noise(seed as u32, at) {
                        x if x < sky => Kind::Sky,
                        x if x < sky + rough => Kind::TooRough,
                        x if x < sky + rough + mirror => Kind::Mirror,
                        _ => Kind::Glossy,
                    }
                })
                .collect();
            let what = format!("{rays_per_quad:?}, mask {seed}");
            let rays = classify(&mut run, &scene(&kinds, |_| 1.0));
            assert_covers_each_pixel_once(&rays, &kinds, &what);
            let traced = sorted(rays.iter().map(|ray| ray.pixel).collect());
            let expected = expected_rays(rays_per_quad, &kinds, |p| kinds[index(p)] == Kind::Mirror);
            assert_eq!(traced, sorted(expected), "{what}");
        }
    }
}

#[test]
fn pixels_that_vary_get_their_own_rays() {
    let Some(gpu) = Gpu::open() else { return };
    let threshold = 0.02;
    let modes =
        [RaysPerQuad::One, RaysPerQuad::Two].map(|rays| [Pipeline::Footprint, Pipeline::Published].map(|p| (rays, p)));
    for (rays_per_quad, pipeline) in modes.into_iter().flatten() {
        let mut settings = settings(rays_per_quad, Some(threshold));
        settings.pipeline = pipeline;
        let mut run = Run::new(&gpu, &settings, SIZE);
        let kinds: Vec<Kind> =
            positions(SIZE).map(|p| if noise(3, p) < 0.3 { Kind::Sky } else { Kind::Glossy }).collect();
        let flickers = |p: UVec2| p.x < 40;
        let mut variance = vec![0.0; kinds.len()];
        for frame in 0..6 {
            let scene = scene(&kinds, |p| match flickers(p) {
                true => 4.0 * noise(frame, p).round(),
                false => 1.0,
            });
            // Classifies, then denoises what was classified.
            let rays = classify(&mut run, &scene);
            let images = scene.upload(&gpu);
            let mut encoder = gpu.encoder();
            run.denoiser.encode_denoise(&mut encoder, &images.inputs()).unwrap();
            let copies = run.copy_out(&mut encoder, SIZE);
            gpu.queue.submit([encoder.finish()]);

            let what = format!("{pipeline:?}, {rays_per_quad:?}, frame {frame}");
            assert_covers_each_pixel_once(&rays, &kinds, &what);
            let varies = |p: UVec2| variance[index(p)] > threshold;
            let traced = sorted(rays.iter().map(|ray| ray.pixel).collect());
            assert_eq!(traced, sorted(expected_rays(rays_per_quad, &kinds, varies)), "{what}");
            if frame > 0 {
                // The check says something: most of one half varies, nothing of the other half does.
                let varying: Vec<UVec2> = traced.iter().copied().filter(|p| varies(*p)).collect();
                let beside = 40 + 8;
                assert!(varying.iter().all(|p| p.x < beside), "{what}: calm pixels vary");
                let candidates = positions(SIZE).filter(|p| flickers(*p) && is_denoised(kinds[index(*p)])).count();
                assert!(varying.len() * 2 > candidates, "{what}: {} of {candidates} vary", varying.len());
            }
            variance = run.read(&copies).output.iter().map(|texel| texel[3]).collect();
        }
    }
}

#[test]
fn a_long_list_has_a_grid_of_several_rows() {
    let Some(gpu) = Gpu::open() else { return };
    let size = UVec2::new(1100, 300);
    let mut run = Run::new(&gpu, &settings(RaysPerQuad::Four, None), size);
    let rays = classify(&mut run, &Scene::new(size, |_| WALL));
    let traced = sorted(rays.iter().map(|ray| ray.pixel).collect());
    assert!(traced.into_iter().eq(positions(size)));
}
