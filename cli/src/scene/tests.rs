//! What the scenes promise, checked on tiny images.

use super::camera::pixel_uv;
use super::lobe::Lobe;
use super::sampler::Sampler;
use super::*;
use glam::{Vec2, Vec4};

const TINY: UVec2 = UVec2::new(32, 18);

/// Samples and density of the lobe describe the same distribution: a smooth function has the same
/// mean under both, and the density integrates to one where nothing falls below the surface.
#[test]
fn lobe_density_matches_its_samples() {
    let count = 1 << 16;
    for (roughness, tilt) in [(0.3_f32, 0.2_f32), (0.5, 0.9), (0.7, 0.0), (0.9, 1.3)] {
        let normal = Vec3::new(0.3, 0.8, -0.2).normalize();
        let view = glam::Quat::from_axis_angle(normal.any_orthonormal_vector(), tilt) * normal;
        let lobe = Lobe::new(normal, view, roughness);
        let test = |direction: Vec3| 1.0 + direction.x + 2.0 * direction.z * direction.z;
        let (mut sampled, mut integral, mut kept, mut total) = (0.0_f64, 0.0_f64, 0, 0.0_f64);
        for index in 0..count {
            let random = Sampler::spread(1, index).pair();
            if let Some(direction) = lobe.sample(random) {
                sampled += f64::from(test(direction));
                kept += 1;
            }
            // Uniform over the sphere.
            let direction = uniform_direction(random);
            let density = f64::from(lobe.density(direction)) * 4.0 * std::f64::consts::PI;
            integral += f64::from(test(direction)) * density;
            total += density;
        }
        let count = f64::from(count);
        let (sampled, integral) = (sampled / count, integral / count);
        assert!((sampled - integral).abs() < 0.01 * integral, "{sampled} {integral}");
        let (kept, total) = (f64::from(kept) / count, total / count);
        assert!((kept - total).abs() < 0.01, "{kept} {total}");
    }
}

fn uniform_direction(random: Vec2) -> Vec3 {
    let (z, angle) = (1.0 - 2.0 * random.x, std::f32::consts::TAU * random.y);
    (Vec2::from_angle(angle) * (1.0 - z * z).max(0.0).sqrt()).extend(z)
}

/// The mean of many noisy frames is the reference, within the standard error of that mean. Lamps
/// are made larger and dimmer, or else thousands of frames would miss their rare reflections.
#[test]
fn reference_is_the_mean_of_the_signal() {
    let size = UVec2::new(16, 9);
    let frames = 3000;
    for mut scene in all() {
        temper(&mut scene);
        let gbuffer = scene.gbuffer(0, size);
        let pixels: Vec<_> = pixels(size).collect();
        let reference = scene.reference(0, &gbuffer, 4096);
        // Seeds depend on the frame, so a scene at rest gives fresh noise in every frame.
        let mut sums = vec![[0.0_f64; 2]; pixels.len()];
        for frame in 0..frames {
            let values = scene.trace(frame, &gbuffer, &pixels);
            for (sum, value) in sums.iter_mut().zip(values) {
                let value = f64::from(value[0] + value[1] + value[2]);
                *sum = [sum[0] + value, sum[1] + value * value];
            }
        }
        let (mut beyond, mut difference, mut variance) = (0, 0.0, 0.0);
        for (sum, reference) in sums.iter().zip(&reference) {
            let [mean, square] = sum.map(|sum| sum / f64::from(frames));
            let error = (square - mean * mean) / f64::from(frames);
            let expected = f64::from(reference.iter().sum::<f32>());
            // The reference has a small error of its own.
            let slack = 4.0 * error.sqrt() + 0.01 * expected + 1e-4;
            beyond += usize::from((mean - expected).abs() > slack);
            difference += mean - expected;
            variance += error;
        }
        let name = scene.name;
        assert!(beyond <= 1, "{name}: {beyond} pixels are off");
        let deviations = difference / variance.sqrt();
        assert!(deviations.abs() < 4.0, "{name}: off by {deviations} deviations");
    }
}

/// Stops all movement and softens all lamps.
fn temper(scene: &mut Scene) {
    for object in &mut scene.objects {
        (object.movement, object.dark) = (Movement::default(), [0.0; 2]);
        object.material.emission = (object.material.emission / 40.0).min(Vec3::splat(3.0));
        if let (Shape::Sphere { radius }, true) = (&mut object.shape, object.material.emission != Vec3::ZERO) {
            *radius = (2.5 * *radius).max(0.15);
        }
    }
    if let Some(sun) = &mut scene.sky.sun {
        (sun.radius, sun.radiance) = (sun.radius * 5.0, sun.radiance / 60.0);
    }
    scene.shots.truncate(1);
    (scene.shots[0].turn, scene.shots[0].travel) = (0.0, Vec3::ZERO);
}

/// `trace` agrees with `render`, pixel by pixel, and pixels outside of the image are empty.
#[test]
fn traced_pixels_equal_rendered_ones() {
    let scene = by_name("mirrors").expect("a built-in scene");
    let frame = scene.render(5, TINY, 0);
    let some = [UVec2::new(3, 17), UVec2::new(31, 9), UVec2::new(12, 12), TINY];
    let traced = scene.trace(5, &scene.gbuffer(5, TINY), &some);
    for (pixel, value) in some[..3].iter().zip(&traced) {
        assert_eq!(*value, frame.radiance[(pixel.y * TINY.x + pixel.x) as usize]);
    }
    assert_eq!(traced[3], [0.0; 4]);
}

/// The point behind a pixel, carried back by its object and seen by the last camera, appears at
/// uv - motion; and depth is its distance along the view axis.
#[test]
fn motion_and_depth_agree_with_matrices() {
    for scene in all() {
        for number in [1, 7, 13] {
            let frame = scene.gbuffer(number, TINY);
            let (camera, before) = (frame.camera, scene.camera(number - 1, TINY));
            let inverse = (camera.view_to_clip * camera.world_to_view).inverse();
            let mut moving = 0;
            for (index, pixel) in pixels(TINY).enumerate() {
                let (uv, depth) = (pixel_uv(pixel, TINY), frame.depth[index]);
                // Unproject through the clip depth, on another path than the renderer's rays.
                let view_depth = if depth > 0.0 { depth } else { 900.0 };
                let clip = camera.view_to_clip * Vec4::new(0.0, 0.0, -view_depth, 1.0);
                let ndc = Vec4::new(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y, clip.z / clip.w, 1.0);
                let world = inverse * ndc;
                let world = world.truncate() / world.w;
                let carried = (depth > 0.0).then(|| {
                    let (moves, then) = carried_back(&scene, number, world, 5e-3 * view_depth);
                    moving += usize::from(moves);
                    then
                });
                let eye = camera.world_to_view.inverse().w_axis.truncate();
                let then = carried.map_or((world - eye).extend(0.0), |world| world.extend(1.0));
                let clip = before.view_to_clip * before.world_to_view * then;
                let then = Vec2::new(0.5 + 0.5 * clip.x / clip.w, 0.5 - 0.5 * clip.y / clip.w);
                let error = (uv - Vec2::from(frame.motion[index]) - then).length();
                assert!(error < 2e-4, "{} {number} {pixel}: {error}", scene.name);
            }
            let rests = scene.objects.iter().all(|object| object.movement == Movement::default());
            assert_eq!(moving == 0, rests, "{}: {moving} moving pixels", scene.name);
        }
    }
}

/// Whether the object whose surface is within `tolerance` of a point moves, and where it had the point a frame ago.
fn carried_back(scene: &Scene, number: u32, world: Vec3, tolerance: f32) -> (bool, Vec3) {
    let [now, then] = [number, number - 1].map(|number| scene.time(number));
    let off = |object: &Object| {
        let pose = object.pose(now);
        surface_distance(object, pose.rotation.inverse() * (world - pose.position))
    };
    let object = scene.objects.iter().min_by(|a, b| off(a).total_cmp(&off(b))).expect("a scene has objects");
    assert!(off(object) < tolerance, "{}: nothing here", scene.name);
    let (now, then) = (object.pose(now), object.pose(then));
    (now != then, then.position + then.rotation * (now.rotation.inverse() * (world - now.position)))
}

/// What perfect mirrors reflect, one hit distance along the reflected ray, has moved as the object there.
#[test]
fn hit_motion_is_that_of_what_mirrors_show() {
    for name in ["mirrors", "carousel"] {
        let scene = by_name(name).expect("a built-in scene");
        let (number, size) = (7, UVec2::new(64, 36));
        let frame = scene.render(number, size, 0);
        let hit_motion = frame.hit_motion.as_ref().expect("scenes know it");
        let (view, mut moving) = (View::new(&frame.camera), 0);
        for (index, pixel) in pixels(size).enumerate().filter(|(index, _)| frame.roughness[*index] < 0.01) {
            let surface = Surface::read(&frame, &view, pixel).expect("sky is rough");
            let [.., distance] = frame.radiance[index];
            if distance >= 10_000.0 {
                assert_eq!(hit_motion[index], [0.0; 3], "{name} {pixel}");
                continue;
            }
            let world = surface.origin - surface.view.reflect(surface.normal) * distance;
            let (moves, then) = carried_back(&scene, number, world, 0.02);
            moving += usize::from(moves);
            let error = (Vec3::from(hit_motion[index]) - (world - then)).length();
            assert!(error < 2e-5, "{name} {pixel}: {error}");
            assert!(moves || hit_motion[index] == [0.0; 3]);
        }
        assert!(moving > 10, "{name}: {moving}");
        let cut = scene.render(0, size, 0).hit_motion.expect("scenes know it");
        assert!(cut.iter().all(|motion| *motion == [0.0; 3]), "{name}");
    }
}

/// How far a local point is from a shape's surface, by the shape's implicit function.
fn surface_distance(object: &Object, point: Vec3) -> f32 {
    let outside = |away: Vec3| away.max(Vec3::ZERO).length() + away.max_element().min(0.0);
    let distance = match object.shape {
        Shape::Sphere { radius } => point.length() - radius,
        Shape::Cuboid { half } => outside(point.abs() - half),
        Shape::Cylinder { radius, half_height } => {
            let across = Vec2::new(point.x, point.z).length() - radius;
            outside(Vec3::new(across, point.y.abs() - half_height, f32::NEG_INFINITY))
        }
        Shape::Capsule { radius, half_height } => {
            let spine = Vec3::Y * point.y.clamp(-half_height, half_height);
            (point - spine).length() - radius
        }
        Shape::Panel { half } => outside(point.abs() - half.extend(0.0)),
    };
    distance.abs()
}

/// [`REFERENCE_SAMPLES`] keep their promise: the difference to a reference of twice the samples,
/// which contains the first, has half of the first one's error variance.
#[test]
fn references_have_converged() {
    let size = UVec2::new(64, 36);
    for scene in all() {
        let gbuffer = scene.gbuffer(3, size);
        let [reference, better] = [1, 2].map(|k| scene.reference(3, &gbuffer, k * REFERENCE_SAMPLES));
        let surfaces = gbuffer.depth.iter().filter(|depth| **depth > 0.0).count();
        let square = |(a, b): (f32, f32)| f64::from(a / (1.0 + a) - b / (1.0 + b)).powi(2);
        let pairs = reference.as_flattened().iter().copied().zip(better.as_flattened().iter().copied());
        let error = 2.0 * pairs.map(square).sum::<f64>() / (3 * surfaces) as f64;
        assert!(error < 1e-4, "{}: PSNR {:.1} dB", scene.name, -10.0 * error.log10());
    }
}

/// A frame rate changes how long the steps are, not what happens.
#[test]
fn every_frame_rate_shows_the_same_moments() {
    for name in ["dolly", "switch"] {
        let scene = by_name(name).expect("a built-in scene");
        let slow = by_name(&format!("{name}@30")).expect("the same at 30 frames per second");
        for number in [2, 6, 7, 14] {
            let (ours, theirs) = (slow.gbuffer(number, TINY), scene.gbuffer(2 * number, TINY));
            assert_eq!((ours.depth, ours.reset), (theirs.depth, theirs.reset), "{name} {number}");
            let lit = |scene: &Scene, frame| World::new(scene, frame).lights.len();
            assert_eq!(lit(&slow, number), lit(&scene, 2 * number), "{name} {number}");
        }
    }
    assert!(["dolly@0", "dolly@", "dolly@NaN", "@24"].iter().all(|name| by_name(name).is_none()));
}

/// Values stay in their documented ranges in every scene, resets included.
#[test]
fn frames_are_well_formed() {
    for scene in all() {
        for number in [0, 12, 23] {
            let frame = scene.render(number, TINY, 4);
            let cut = scene.shots.iter().any(|shot| shot.first == number);
            assert_eq!(frame.reset, cut, "{} {number}", scene.name);
            let reference = frame.reference.as_ref().expect("asked for");
            for (index, mean) in reference.iter().enumerate() {
                let sky = frame.depth[index] == 0.0;
                let normal = Vec3::from(frame.normal[index]);
                let radiance = frame.radiance[index];
                assert!(normal.is_normalized() != sky && (normal == Vec3::ZERO) == sky);
                assert!(radiance.iter().all(|x| x.is_finite() && *x >= 0.0));
                assert!(mean.iter().all(|x| x.is_finite() && *x >= 0.0));
                assert!(Vec2::from(frame.motion[index]).is_finite());
                assert!(!frame.reset || frame.motion[index] == [0.0; 2]);
                assert!((0.0..=1.0).contains(&frame.roughness[index]));
                assert!((0.1..1000.0).contains(&frame.depth[index]) || sky);
                assert!((0.0..=10_000.0).contains(&radiance[3]));
                let dark = radiance == [0.0; 4] && *mean == [0.0; 3];
                assert!(!sky || (dark && frame.roughness[index] == 1.0));
            }
        }
    }
}

/// Empty images and frames far away are answered, not refused; names resolve.
#[test]
fn odd_requests_are_answered() {
    for (scene, name) in all().into_iter().zip(NAMES) {
        assert_eq!((scene.name, by_name(name).as_ref()), (name, Some(&scene)));
        assert!(scene.render(3, UVec2::ZERO, 2).depth.is_empty());
        let far = scene.render(100_000, UVec2::new(4, 4), 1);
        assert!(far.radiance.iter().flatten().all(|x| x.is_finite()));
    }
    assert!(by_name("nowhere").is_none());
}
