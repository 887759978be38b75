//! Light transport: what one reflected ray brings back, and its expectation.
//!
//! A reflected ray goes on through at most [`MIRRORS`] perfect mirrors and ends on a lamp, which
//! counts fully, in the sky, or on a surface. Surfaces are diffuse in reflections: they get
//! direct light from one sampled light, and ambient light from one sampled direction. The rules
//! hold for noisy signal and reference alike, so the reference is the mean of the signal.

use super::gbuffer::Surface;
use super::light::{Light, LightSample};
use super::lobe::{Lobe, cosine_direction};
use super::sampler::Sampler;
use super::world::{Hit, World};
use glam::{Vec2, Vec3};
use std::f32::consts::FRAC_1_PI;

/// Hit distance of a reflected ray that meets nothing.
const MISS_DISTANCE: f32 = 10_000.0;

/// How many mirrors a reflected ray passes before the next counts as diffuse.
const MIRRORS: u32 = 4;

/// Lamps seen by way of a mirror are no brighter than this: light sampling cannot find such
/// paths, so that a reference could not converge.
const MIRRORED_LAMP: f32 = 4.0;

/// Fainter contributions to the reference are left to chance.
const FAINT: f32 = 0.05;

/// Density, per solid angle, that every light in a lobe is credited with.
const OFF_PEAK: f32 = 0.1;

/// Ambient light fades in crevices; at this distance, world units, to one half.
const AMBIENT_REACH: f32 = 0.5;

/// The noisy signal at a surface: radiance of one reflected ray, and the distance to its hit
/// (10000: nothing hit; 0: the ray would enter the surface).
pub(super) fn one_ray(world: &World, surface: &Surface, sampler: &mut Sampler) -> [f32; 4] {
    let lobe = Lobe::new(surface.normal, surface.view, surface.roughness);
    let Some(direction) = lobe.sample(sampler.pair()) else {
        return [0.0; 4];
    };
    let hit = world.hit(surface.origin, direction);
    let distance = hit.as_ref().map_or(MISS_DISTANCE, |hit| hit.distance);
    let lamp = world.lamp_along(direction, hit.as_ref());
    let lamp = lamp.map_or(Vec3::ZERO, |lamp| world.lights[lamp].radiance);
    let radiance = lamp + reflected(world, hit, direction, sampler);
    [radiance.x, radiance.y, radiance.z, distance]
}

/// What the ray of [`one_ray`] hits, if anything.
pub(super) fn first_hit(world: &World, surface: &Surface, sampler: &mut Sampler) -> Option<Hit> {
    let lobe = Lobe::new(surface.normal, surface.view, surface.roughness);
    world.hit(surface.origin, lobe.sample(sampler.pair())?)
}

/// The mean of the signal at a surface, estimated from `samples` well spread reflected rays.
/// Lamps in the lobe are sought from both ends and weighted by the balance heuristic (Veach and
/// Guibas 1995, "Optimally Combining Sampling Techniques").
pub(super) fn mean(world: &World, surface: &Surface, key: u32, samples: u32) -> [f32; 3] {
    let lobe = Lobe::new(surface.normal, surface.view, surface.roughness);
    let importance: Vec<f32> = world.lights.iter().map(|light| importance_in_lobe(light, surface, &lobe)).collect();
    let total = importance.iter().sum::<f32>().max(f32::MIN_POSITIVE);
    let mut sum = Vec3::ZERO;
    for index in 0..samples {
        let mut sampler = Sampler::spread(key, index);
        let to_lobe = sampler.pair();
        if !lobe.is_mirror() {
            sum += lamp_in_lobe(world, surface.origin, &lobe, &importance, &mut sampler);
        }
        let Some(direction) = lobe.sample(to_lobe) else {
            continue;
        };
        let hit = world.hit(surface.origin, direction);
        if let Some(lamp) = world.lamp_along(direction, hit.as_ref()) {
            let distance = hit.as_ref().map_or(f32::INFINITY, |hit| hit.distance);
            let share = match lobe.density(direction) {
                0.0 => 1.0,
                density => {
                    let rival = world.lights[lamp].density(surface.origin, direction, distance);
                    density / (density + rival * importance[lamp] / total)
                }
            };
            sum += world.lights[lamp].radiance * share;
        }
        sum += reflected(world, hit, direction, &mut sampler);
    }
    (sum / samples.max(1) as f32).to_array()
}

/// The share of lamps in the lobe that is found by sampling a light in proportion to `importance`.
fn lamp_in_lobe(world: &World, origin: Vec3, lobe: &Lobe, importance: &[f32], sampler: &mut Sampler) -> Vec3 {
    let sampled = world.sample_light(origin, |light| importance[light], sampler.pair());
    let roulette = sampler.pair().x;
    let Some((light, sample)) = sampled else {
        return Vec3::ZERO;
    };
    let density = lobe.density(sample.direction);
    let lit = light.radiance * (density / (density + sample.density));
    // Far off the lobe's peak most shadow rays would be wasted.
    let worth = (lit.max_element() / FAINT).min(1.0);
    if roulette >= worth || blocked(world, origin, &sample) {
        return Vec3::ZERO;
    }
    lit / worth
}

/// About how much a light matters in a lobe. Far off the peak some of a large light can still be
/// near it.
fn importance_in_lobe(light: &Light, surface: &Surface, lobe: &Lobe) -> f32 {
    let at_centre = lobe.density(light.centre(surface.origin));
    light.importance(surface.origin, surface.normal) * (at_centre + OFF_PEAK)
}

/// Radiance from the end of a reflected ray, except that of a lamp the ray meets without passing
/// a mirror.
fn reflected(world: &World, first: Option<Hit>, direction: Vec3, sampler: &mut Sampler) -> Vec3 {
    let (mut hit, mut direction, mut tint) = (first, direction, Vec3::ONE);
    let mut mirrors = 0;
    loop {
        let lamp = world.lamp_along(direction, hit.as_ref());
        let glow = match lamp {
            Some(lamp) if mirrors > 0 => dimmed(world.lights[lamp].radiance),
            _ => Vec3::ZERO,
        };
        let Some(surface) = hit else {
            return tint * (glow + world.scene.sky.gradient(direction));
        };
        if lamp.is_some() {
            return tint * glow;
        }
        if mirrors == MIRRORS || !world.is_mirror(&surface) {
            return tint * diffuse(world, &surface, sampler);
        }
        tint *= world.albedo(&surface);
        direction = direction.reflect(surface.normal);
        hit = world.hit(lift(surface.point, surface.normal), direction);
        mirrors += 1;
    }
}

/// Light scattered by a diffuse surface: one sampled light and one ambient ray.
fn diffuse(world: &World, hit: &Hit, sampler: &mut Sampler) -> Vec3 {
    let (to_light, around) = (sampler.pair(), sampler.pair());
    let origin = lift(hit.point, hit.normal);
    let direct = direct(world, origin, hit.normal, to_light);
    let ambient = ambient(world, origin, cosine_direction(hit.normal, around));
    world.albedo(hit) * (direct + ambient)
}

/// Light from one sampled lamp, over a diffuse reflectance of one.
fn direct(world: &World, origin: Vec3, normal: Vec3, random: Vec2) -> Vec3 {
    let importance = |light: usize| world.lights[light].importance(origin, normal);
    let Some((light, sample)) = world.sample_light(origin, importance, random) else {
        return Vec3::ZERO;
    };
    let cosine = normal.dot(sample.direction);
    if cosine <= 0.0 || blocked(world, origin, &sample) {
        return Vec3::ZERO;
    }
    light.radiance * (cosine * FRAC_1_PI / sample.density)
}

/// Light that has been scattered before, along one direction: the sky, or what the nearest
/// surface would scatter in the scene's ambient light, fading in crevices.
fn ambient(world: &World, origin: Vec3, direction: Vec3) -> Vec3 {
    match world.hit(origin, direction) {
        Some(hit) => {
            let openness = hit.distance / (hit.distance + AMBIENT_REACH);
            world.scene.ambient * world.albedo(&hit) * openness
        }
        None => world.scene.sky.gradient(direction),
    }
}

/// Whether a sampled lamp is hidden. The lamp itself, which begins at the sampled distance, does
/// not count.
fn blocked(world: &World, origin: Vec3, sample: &LightSample) -> bool {
    world.occluded(origin, sample.direction, sample.distance * (1.0 - 1e-3))
}

/// A lamp's radiance as seen in a mirror.
fn dimmed(radiance: Vec3) -> Vec3 {
    radiance * (MIRRORED_LAMP / radiance.max_element()).min(1.0)
}

/// Moves a ray's origin off its surface by more than its rounding error.
pub(super) fn lift(point: Vec3, normal: Vec3) -> Vec3 {
    point + normal * (1e-4 * point.abs().max_element().max(1.0))
}
