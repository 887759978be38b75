//! Normals that are derived from depth are those of the surfaces that depth shows.

use std::cell::Cell;

use glam::{DMat4, DQuat, DVec2, DVec3, UVec2, camera::rh};
use limpid::settings::DepthEncoding;
use limpid_harness::eye::{Eye, any_turn, any_vector};
use limpid_harness::strategy::{any_spec, noise};
use limpid_harness::{Case, Change, Executor, Images, Pixel, Snapshot, Step, for_all};
use proptest::prelude::*;

const SIZE: UVec2 = UVec2::new(64, 40);

/// A flat disk: a point on it, its normal, its radius.
#[derive(Debug, Clone, Copy)]
struct Disk {
    centre: DVec3,
    normal: DVec3,
    radius: f64,
}

/// Before a camera of one kind of projection.
#[derive(Debug, Clone)]
struct Scene {
    eye: Eye,
    depth: DepthEncoding,
    disks: Vec<Disk>,
}

impl Scene {
    /// What a pixel shows: which disk, and where.
    fn seen(&self, pixel: UVec2) -> Option<(usize, DVec3)> {
        let (origin, direction) = self.eye.ray(pixel);
        let hit = |(index, disk): (usize, &Disk)| {
            let point = origin + direction * (disk.normal.dot(disk.centre - origin) / disk.normal.dot(direction));
            let is_hit = (0.2..40.0).contains(&self.eye.depth(point)) && point.distance(disk.centre) < disk.radius;
            is_hit.then_some((index, point))
        };
        let hits = self.disks.iter().enumerate().filter_map(hit);
        hits.min_by(|(_, a), (_, b)| self.eye.depth(*a).total_cmp(&self.eye.depth(*b)))
    }

    /// Unit normal that a pixel shows, towards the camera.
    fn normal(&self, index: usize, pixel: UVec2) -> DVec3 {
        let normal = self.disks[index].normal;
        normal * -normal.dot(self.eye.ray(pixel).1).signum()
    }

    /// Whether a side of the pixel goes on for two pixels, along both axes, so that depth tells the normal.
    fn is_told(&self, index: usize, pixel: UVec2) -> bool {
        let shows = |offset: glam::IVec2| {
            let at = pixel.as_ivec2() + offset;
            let is_inside = at.min_element() >= 0 && at.cmplt(SIZE.as_ivec2()).all();
            is_inside && self.seen(at.as_uvec2()).is_some_and(|(other, _)| other == index)
        };
        [glam::IVec2::X, glam::IVec2::Y]
            .into_iter()
            .all(|axis| [axis, -axis].into_iter().any(|step| shows(step) && shows(step * 2)))
    }

    fn case(&self) -> Case {
        let pixel = |p: UVec2| {
            let sky = if self.depth == DepthEncoding::Device { 1.0 } else { 0.0 };
            let depth = self.seen(p).map_or(sky, |(_, point)| match self.depth {
                DepthEncoding::Linear => self.eye.depth(point) as f32,
                _ => self.eye.device_depth(point) as f32,
            });
            // There are no normals to be taken by mistake.
            Pixel { depth, normal: [f32::NAN; 3], ..Pixel::WALL }
        };
        let mut case = Case::still(SIZE, 0, |_, _| Pixel::WALL);
        case.settings.conventions.depth = self.depth;
        case.settings.features.normal_input = false;
        case.steps = vec![Step { change: Change::None, frame: self.eye.frame(), images: Images::new(SIZE, pixel) }];
        case
    }
}

/// The normal of a guide's second word: an octahedral map in 2 x 11 bits (Meyer et al. 2010).
fn unpacked(word: u32) -> DVec3 {
    let p = DVec2::new(f64::from(word & 2047), f64::from((word >> 11) & 2047)) * (2.0 / 2047.0) - 1.0;
    let z = 1.0 - p.x.abs() - p.y.abs();
    let folded = if z < 0.0 {
        (1.0 - DVec2::new(p.y, p.x).abs()) * DVec2::new(1f64.copysign(p.x), 1f64.copysign(p.y))
    } else {
        p
    };
    folded.extend(z).normalize()
}

/// A large disk that faces the camera more or less, and smaller ones in front of it.
fn any_scene() -> impl Strategy<Value = Scene> {
    let aspect = SIZE.x as f32 / SIZE.y as f32;
    let projections = vec![
        (rh::proj::directx::perspective(1.0, aspect, 0.1, 500.0), DepthEncoding::Linear),
        (rh::proj::directx::perspective(1.0, aspect, 0.1, 500.0), DepthEncoding::Device),
        (rh::proj::directx::perspective_infinite_reverse(1.0, aspect, 0.1), DepthEncoding::ReversedDevice),
        (rh::proj::directx::orthographic(-8.0, 8.0, -5.0, 5.0, 0.1, 100.0), DepthEncoding::Linear),
        (rh::proj::directx::orthographic(-8.0, 8.0, -5.0, 5.0, 0.1, 100.0), DepthEncoding::Device),
    ];
    let camera = (any_vector(20.0), any_turn(3.0), prop::sample::select(projections));
    let disk = (any_vector(3.0), any_turn(1.2), 0.5f64..3.0);
    (camera, any_turn(1.2), prop::collection::vec(disk, 0..4)).prop_map(
        |((position, rotation, (projection, depth)), tilt, disks)| {
            let projection: DMat4 = projection.as_dmat4();
            let eye = Eye { projection, ..Eye::new(position, rotation, SIZE) };
            let placed = |offset: DVec3, tilt: DQuat, radius| Disk {
                centre: position + rotation * (offset - DVec3::Z * 8.0),
                normal: rotation * tilt * DVec3::Z,
                radius,
            };
            let mut all = vec![placed(DVec3::ZERO, tilt, 200.0)];
            all.extend(disks.into_iter().map(|(offset, tilt, radius)| placed(offset, tilt, radius)));
            Scene { eye, depth, disks: all }
        },
    )
}

#[test]
fn depth_tells_the_normals_of_flat_things_up_to_their_edges() {
    let (told, right, at_edges) = (Cell::new(0u32), Cell::new(0u32), Cell::new(0u32));
    let property = |executor: &mut dyn Executor, scene: Scene| {
        let snapshot = &scene.case().run(executor)[0];
        let guide = &snapshot.0["guide"];
        for y in 0..SIZE.y {
            for x in 0..SIZE.x {
                let pixel = UVec2::new(x, y);
                let Some((index, _)) = scene.seen(pixel) else { continue };
                let found = unpacked(guide[(2 * (y * SIZE.x + x) + 1) as usize]);
                // Always towards the camera.
                prop_assert!(found.dot(scene.eye.ray(pixel).1) < 0.05, "{pixel}: {found}");
                if !scene.is_told(index, pixel) {
                    at_edges.set(at_edges.get() + 1);
                    continue;
                }
                told.set(told.get() + 1);
                let apart = found.angle_between(scene.normal(index, pixel));
                right.set(right.get() + u32::from(apart < 0.01));
            }
        }
        Ok(())
    };
    for_all(file!(), 64, any_scene(), property);
    // Where surfaces meet, depth goes on as straight over the edge by chance.
    let wrong = told.get() - right.get();
    assert!(told.get() > 80_000 && wrong < told.get() / 200, "{wrong} of {}", told.get());
    assert!(at_edges.get() > 100);
}

/// A sphere is not flat: its normals are found to the angle that a pixel or two turn them by.
#[test]
fn depth_tells_the_normals_of_a_sphere() {
    let eye = Eye::new(DVec3::ZERO, DQuat::IDENTITY, SIZE);
    let (centre, radius) = (DVec3::new(0.3, -0.2, -6.0), 2.5);
    let seen = |p: UVec2| {
        let (_, direction) = eye.ray(p);
        let along = direction.dot(centre);
        let below = along * along - centre.length_squared() + radius * radius;
        (below > 0.0).then(|| direction * (along - below.sqrt()))
    };
    let mut case = Case::still(SIZE, 1, |_, p| Pixel {
        depth: seen(p).map_or(0.0, |point| eye.depth(point) as f32),
        ..Pixel::WALL
    });
    case.settings.features.normal_input = false;
    let snapshot = &case.run(&mut *limpid_harness::fastest())[0];
    let guide = &snapshot.0["guide"];
    let mut worst: f64 = 0.0;
    let mut pixels = 0;
    for (index, point) in (0..SIZE.element_product()).map(|i| (i, seen(UVec2::new(i % SIZE.x, i / SIZE.x)))) {
        let Some(point) = point else { continue };
        let normal = (point - centre) / radius;
        // Nearer to its outline a pixel covers too much of it.
        if -normal.dot(point.normalize()) > 0.4 {
            worst = worst.max(unpacked(guide[(2 * index + 1) as usize]).angle_between(normal));
            pixels += 1;
        }
    }
    assert!(pixels > 400 && worst < 0.05, "{worst} over {pixels} pixels");
}

/// Whatever depth holds, normals are directions: everything that comes out is a number, and the same where the image of
/// normals says something else.
#[test]
fn the_image_of_normals_is_not_looked_at() {
    let property = |executor: &mut dyn Executor, mut spec: limpid_harness::strategy::Spec| {
        let change = |settings: &mut limpid::Settings| {
            let features = &mut settings.features;
            (features.normal_input, features.gbuffer_copy, features.packed_guide) = (false, true, true);
        };
        change(&mut spec.settings);
        spec.later_settings.iter_mut().for_each(change);
        let case = spec.case();
        let mut other = case.clone();
        for (index, step) in other.steps.iter_mut().enumerate() {
            for (i, pixel) in step.images.pixels.iter_mut().enumerate() {
                pixel.normal = [noise(index as u32, UVec2::new(i as u32, 5)) - 0.5, f32::NAN, 0.2];
            }
        }
        let (a, b): (Vec<Snapshot>, Vec<Snapshot>) = (case.run(executor), other.run(executor));
        prop_assert!(a.iter().all(Snapshot::is_finite));
        for (a, b) in a.iter().zip(&b) {
            prop_assert!(a == b);
        }
        Ok(())
    };
    for_all(file!(), 16, any_spec(), property);
}
