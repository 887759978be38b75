//! The motion of what was hit leads to where its reflection was, and does nothing else.

use std::cell::Cell;

use glam::{DVec2, DVec3, UVec2};
use limpid::Settings;
use limpid_harness::eye::{Eye, any_turn, any_vector};
use limpid_harness::strategy::{Spec, any_spec, noise};
use limpid_harness::{Case, Change, Executor, Images, Pixel, Snapshot, Step, for_all};
use proptest::prelude::*;

const SIZE: UVec2 = UVec2::new(64, 40);

/// A flat mirror without end.
#[derive(Debug, Clone, Copy)]
struct Mirror {
    point: DVec3,
    normal: DVec3,
}

impl Mirror {
    /// Where a pixel shows it; `None` beyond its horizon and far away.
    fn seen(&self, eye: &Eye, pixel: UVec2) -> Option<DVec3> {
        let (_, direction) = eye.ray(pixel);
        let t = self.normal.dot(self.point - eye.position) / self.normal.dot(direction);
        (0.2..50.0).contains(&t).then(|| eye.position + direction * t)
    }

    fn image(&self, point: DVec3) -> DVec3 {
        point - self.normal * (2.0 * self.normal.dot(point - self.point))
    }
}

/// A mirror before two cameras that are near to each other.
fn any_view() -> impl Strategy<Value = (Mirror, [Eye; 2])> {
    let eyes = (any_vector(20.0), any_turn(3.0), any_vector(0.1), any_turn(0.03));
    (eyes, 1.0f64..8.0, any_turn(0.9)).prop_map(|((position, rotation, step, turn), distance, tilt)| {
        let mirror = Mirror { point: position - rotation * DVec3::Z * distance, normal: rotation * tilt * DVec3::Z };
        let before = Eye::new(position + step, turn * rotation, SIZE);
        (mirror, [before, Eye::new(position, rotation, SIZE)])
    })
}

/// With the 11 significant bits that the alpha of `radiance` holds.
fn as_half(value: f64) -> f64 {
    f64::from(f32::from_bits(((value as f32).to_bits() + 0x1000) & !0x1fff))
}

/// The last frame shows at each place its own coordinates, this one nothing: what is seen then tells where it came from.
/// `hit_share` is hit distance over distance to the camera.
fn coordinates(mirror: &Mirror, eyes: &[Eye; 2], hit_share: f64, moved: &dyn Fn(UVec2) -> DVec3) -> Case {
    let step = |index: usize| {
        let eye = &eyes[index];
        let pixel = |p: UVec2| {
            let Some(seen) = mirror.seen(eye, p) else { return Pixel { depth: 0.0, ..Pixel::WALL } };
            let uv = (p.as_vec2() + 0.5) / SIZE.as_vec2();
            let [r, g, b] = if index == 0 { [uv.x, uv.y, 1.0] } else { [0.0; 3] };
            Pixel {
                radiance: [r, g, b, as_half(hit_share * seen.distance(eye.position)) as f32],
                normal: mirror.normal.as_vec3().to_array(),
                roughness: 0.0,
                depth: eye.depth(seen) as f32,
                hit_motion: moved(p).as_vec3().to_array(),
                ..Pixel::WALL
            }
        };
        Step { change: Change::None, frame: eye.frame(), images: Images::new(SIZE, pixel) }
    };
    let mut case = Case::still(SIZE, 0, |_, _| Pixel::WALL);
    case.steps = vec![step(0), step(1)];
    let features = &mut case.settings.features;
    (features.hit_motion, features.surface_motion) = (true, false);
    (features.history_clip, features.light_change) = (false, false);
    (features.outlier_spread, features.spatial_filter) = (false, false);
    case
}

/// Last frame's camera saw the reflection of a point where it would have seen the mirror image of the point's place then.
#[test]
fn history_of_a_flat_mirror_is_found_where_the_moved_thing_was_reflected() {
    let (found, in_view) = (Cell::new(0u32), Cell::new(0u32));
    let motion = (any_vector(0.4), any_vector(0.1), 0u32..1000);
    let property =
        |executor: &mut dyn Executor,
         ((mirror, eyes), hit_share, (drift, jitter, seed)): ((Mirror, [Eye; 2]), f64, _)| {
            let (drift, jitter): (DVec3, DVec3) = (drift, jitter);
            let moved = |p: UVec2| drift + jitter * f64::from(noise(seed, p));
            let case = coordinates(&mirror, &eyes, hit_share, &moved);
            let run = case.run(executor);
            let output = run[1].output();
            for y in 0..SIZE.y {
                for x in 0..SIZE.x {
                    let pixel = UVec2::new(x, y);
                    let Some(seen) = mirror.seen(&eyes[1], pixel) else { continue };
                    let (_, along) = eyes[1].ray(pixel);
                    let reflected = along - mirror.normal * (2.0 * along.dot(mirror.normal));
                    let hit = seen + reflected * as_half(hit_share * seen.distance(eyes[1].position));
                    let Some(place) = eyes[0].place(mirror.image(hit - moved(pixel))) else { continue };
                    let corner = (place - 0.5).floor();
                    let taps = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| corner + DVec2::new(i.into(), j.into()));
                    let is_shown = |tap: &DVec2| {
                        let is_inside = tap.min_element() >= 1.0 && tap.cmplt(SIZE.as_dvec2() - 1.0).all();
                        is_inside && mirror.seen(&eyes[0], tap.as_uvec2()).is_some()
                    };
                    if !taps.iter().all(is_shown) {
                        continue;
                    }
                    in_view.set(in_view.get() + 1);
                    let [r, g, b, _] = output[(y * SIZE.x + x) as usize];
                    if b > 0.0 {
                        found.set(found.get() + 1);
                        let came_from = DVec2::new((r / b).into(), (g / b).into()) * SIZE.as_dvec2();
                        prop_assert!(came_from.distance(place) < 0.12, "{pixel}: {came_from}, expected {place}");
                    }
                }
            }
            Ok(())
        };
    for_all(file!(), 24, (any_view(), 0.1f64..2.0, motion), property);
    // A mirror that is seen at grazing angles may fail the tests of its plane in some places.
    assert!(in_view.get() > 5000 && found.get() > in_view.get() / 100 * 98, "{} of {}", found.get(), in_view.get());
}

fn set(spec: &mut Spec, value: bool) {
    let change = |settings: &mut Settings| settings.features.hit_motion = value;
    change(&mut spec.settings);
    spec.later_settings.iter_mut().for_each(change);
}

fn is_same(a: &[Snapshot], b: &[Snapshot]) -> Result<(), TestCaseError> {
    for (frame, (a, b)) in a.iter().zip(b).enumerate() {
        for (name, words) in &a.0 {
            prop_assert!(words == &b.0[name], "{} of frame {} differs", name, frame);
        }
    }
    Ok(())
}

#[test]
fn what_rests_is_found_as_without_the_feature() {
    let property = |executor: &mut dyn Executor, mut spec: Spec| {
        let mut run = |spec: &Spec| {
            let mut case = spec.case();
            case.steps
                .iter_mut()
                .flat_map(|step| &mut step.images.pixels)
                .for_each(|pixel| pixel.hit_motion = [0.0; 3]);
            case.run(executor)
        };
        set(&mut spec, true);
        let with = run(&spec);
        set(&mut spec, false);
        is_same(&with, &run(&spec))
    };
    for_all(file!(), 16, any_spec(), property);
}

#[test]
fn motion_that_is_no_number_counts_as_none() {
    let bad = prop::sample::select(vec![f32::NAN, f32::INFINITY, f32::NEG_INFINITY]);
    let property = |executor: &mut dyn Executor, (mut spec, bad, component): (Spec, f32, usize)| {
        set(&mut spec, true);
        let mut run = |poison: &dyn Fn(&mut [f32; 3])| {
            let mut case = spec.case();
            for (index, step) in case.steps.iter_mut().enumerate() {
                for (i, pixel) in step.images.pixels.iter_mut().enumerate() {
                    if noise(index as u32, UVec2::new(i as u32, 3)) < 0.2 {
                        poison(&mut pixel.hit_motion);
                    }
                }
            }
            case.run(executor)
        };
        is_same(&run(&|motion| motion[component] = bad), &run(&|motion| *motion = [0.0; 3]))
    };
    for_all(file!(), 16, (any_spec(), bad, 0usize..3), property);
}
