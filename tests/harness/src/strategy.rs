//! Random cases for proptest. A [`Spec`] is a few numbers, so that failing cases shrink to something that can be
//! read; [`Spec::case`] paints the images.

use glam::{Mat4, Quat, UVec2, Vec2, Vec3};
use limpid::settings::{
    Channel, DepthEncoding, Fallback, Features, NormalEncoding, Number, RayList, RaysPerQuad, RoughnessEncoding,
};
use limpid::{FrameInputs, Preset, Settings};
use proptest::prelude::*;
use proptest::sample::select;

use crate::{Case, Change, Images, Pixel, Step};

/// Repeatable noise, uniform in 0 to 1.
pub fn noise(seed: u32, p: UVec2) -> f32 {
    let mut state = seed.wrapping_mul(0x9e37_79b9) ^ p.x.wrapping_mul(0x85eb_ca6b) ^ p.y.wrapping_mul(0xc2b2_ae35);
    for _ in 0..3 {
        state = (state ^ (state >> 15)).wrapping_mul(0x2c1b_3c6d).rotate_left(11);
    }
    (state >> 8) as f32 / (1 << 24) as f32
}

/// A number at every pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Field {
    /// The same everywhere.
    Constant(f32),
    /// From one value at the left to another at the right.
    Gradient(f32, f32),
    /// Between two values, at random.
    Noise(f32, f32),
    /// One of two values in blocks of so many pixels.
    Blocks(u32, f32, f32),
    /// One value, but another one in a share of the pixels.
    Sprinkled(f32, f32, f32),
}

impl Field {
    /// The value at a pixel.
    pub fn at(self, seed: u32, p: UVec2, size: UVec2) -> f32 {
        match self {
            Self::Constant(value) => value,
            Self::Gradient(a, b) => a + (b - a) * (p.x as f32 + 0.5) / size.x as f32,
            Self::Noise(a, b) => a + (b - a) * noise(seed, p),
            Self::Blocks(block, a, b) => {
                let block = p / block.max(1);
                if (block.x + block.y).is_multiple_of(2) { a } else { b }
            }
            Self::Sprinkled(value, other, share) => {
                if noise(seed, p) < share {
                    other
                } else {
                    value
                }
            }
        }
    }
}

fn field(values: &'static [f32]) -> impl Strategy<Value = Field> {
    let value = move || select(values);
    prop_oneof![
        value().prop_map(Field::Constant),
        (value(), value()).prop_map(|(a, b)| Field::Gradient(a, b)),
        (value(), value()).prop_map(|(a, b)| Field::Noise(a, b)),
        (1u32..12, value(), value()).prop_map(|(block, a, b)| Field::Blocks(block, a, b)),
        (value(), value(), select(&[0.002f32, 0.05, 0.5][..])).prop_map(|(a, b, share)| Field::Sprinkled(a, b, share)),
    ]
}

const RADIANCE: &[f32] =
    &[0.0, 0.5, 1.0, 3.0, 0.01, 1e-4, 6e-8, 1e-6, 100.0, 65504.0, -1.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
const HIT_DISTANCE: &[f32] = &[1.0, 0.0, 0.01, 30.0, 10000.0, 65504.0, -1.0, f32::NAN, f32::INFINITY];
const HIT_MOTION: &[f32] = &[0.0, 0.01, -0.2, 5.0, 1e30, 3e38, f32::NAN, f32::NEG_INFINITY];
const DEPTH: &[f32] = &[4.0, 4.001, 1.0, 0.0, 0.1, 50.0, 1e4, 1e30, 3e38, 1e-30, -1.0, f32::NAN, f32::INFINITY];
/// At and next to every threshold.
const ROUGHNESS: &[f32] = &[
    0.5,
    0.0,
    0.01,
    0.009_999,
    0.010_001,
    0.3,
    0.447_213_6,
    0.447_213_5,
    0.447_213_7,
    1.0,
    0.999_999_9,
    1.000_000_1,
    -0.1,
    7.0,
    f32::NAN,
    f32::INFINITY,
];

/// Where surfaces point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Normals {
    /// At the camera.
    Facing,
    /// Up, as a floor.
    Floor,
    /// At random.
    Random,
    /// Slowly turning, as on a sphere.
    Curved,
    /// Facing and turned away in blocks.
    Opposite,
}

/// How long normals are.
const NORMAL_LENGTH: &[f32] = &[1.0, 0.5, 3.0, 1e-20, 1e-38, 1e18, 1e38, 0.0, f32::NAN];

/// Where surfaces were in the last frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Motion {
    /// The same everywhere, in pixels.
    Uniform(f32, f32),
    /// Grows from the middle.
    Zoom(f32),
    /// Around the middle.
    Rotation(f32),
    /// Rows shift against each other.
    Shear(f32),
    /// At random, up to so many pixels.
    Random(f32),
    /// Blocks that part.
    Discontinuous(f32),
    /// A value in every component, in uv.
    Raw(f32),
}

impl Motion {
    fn at(self, seed: u32, p: UVec2, size: UVec2) -> Vec2 {
        let pixels = size.as_vec2();
        let from_middle = (p.as_vec2() + 0.5) / pixels - 0.5;
        match self {
            Self::Uniform(x, y) => Vec2::new(x, y) / pixels,
            Self::Zoom(by) => from_middle * by,
            Self::Rotation(angle) => from_middle - Vec2::from_angle(angle).rotate(from_middle),
            Self::Shear(by) => Vec2::new(from_middle.y * by, 0.0),
            Self::Random(reach) => (Vec2::new(noise(seed, p), noise(seed ^ 0x55, p)) * 2.0 - 1.0) * reach / pixels,
            Self::Discontinuous(by) => {
                let side = if (p.x / 8 + p.y / 8).is_multiple_of(2) { 1.0 } else { -1.0 };
                Vec2::splat(side * by) / pixels
            }
            Self::Raw(value) => Vec2::splat(value),
        }
    }
}

fn motion() -> impl Strategy<Value = Motion> {
    prop_oneof![
        Just(Motion::Uniform(0.0, 0.0)),
        (-3.0f32..3.0, -3.0f32..3.0).prop_map(|(x, y)| Motion::Uniform(x, y)),
        (-0.5f32..0.5).prop_map(Motion::Zoom),
        (-1.0f32..1.0).prop_map(Motion::Rotation),
        (-0.3f32..0.3).prop_map(Motion::Shear),
        (0.1f32..20.0).prop_map(Motion::Random),
        (0.5f32..12.0).prop_map(Motion::Discontinuous),
        select(&[0.7f32, 3.0, 1e9, 3e38, f32::NAN, f32::INFINITY][..]).prop_map(Motion::Raw),
    ]
}

/// One frame of a [`Spec`].
#[derive(Debug, Clone, PartialEq)]
pub struct FrameSpec {
    /// Size of the frame as a share of the largest size.
    pub scale: (f32, f32),
    /// For whatever is random.
    pub seed: u32,
    /// Radiance of red; the other channels are fractions of it.
    pub radiance: Field,
    /// Hit distance.
    pub hit_distance: Field,
    /// Depth.
    pub depth: Field,
    /// Roughness.
    pub roughness: Field,
    /// Direction of normals.
    pub normals: Normals,
    /// Length of normals.
    pub normal_length: Field,
    /// Motion.
    pub motion: Motion,
    /// Each component of the motion of what was hit.
    pub hit_motion: Field,
    /// How far the camera moved to the right since the beginning.
    pub camera_shift: f32,
    /// How far it turned.
    pub camera_turn: f32,
    /// Where in their pixels the camera sampled.
    pub jitter: (f32, f32),
    /// Exposure.
    pub exposure: f32,
    /// Time since the frame before.
    pub seconds: f32,
    /// Camera cut.
    pub reset: bool,
    /// New largest size as a share of the first, before this frame.
    pub resize: Option<(f32, f32)>,
}

/// Values of a field that are tame: finite and of ordinary size.
fn tame(value: f32) -> bool {
    value == 0.0 || (1e-4..=1e4).contains(&value)
}

fn tame_field(field: Field) -> bool {
    match field {
        Field::Constant(a) => tame(a),
        Field::Gradient(a, b) | Field::Noise(a, b) | Field::Blocks(_, a, b) | Field::Sprinkled(a, b, _) => {
            tame(a) && tame(b)
        }
    }
}

fn any_frame() -> impl Strategy<Value = FrameSpec> {
    let normals = select(vec![Normals::Facing, Normals::Floor, Normals::Random, Normals::Curved, Normals::Opposite]);
    let share = || prop_oneof![3 => Just(1.0f32), 1 => 0.01f32..1.0];
    let images = (
        field(RADIANCE),
        field(HIT_DISTANCE),
        field(DEPTH),
        field(ROUGHNESS),
        normals,
        prop_oneof![4 => Just(Field::Constant(1.0)), 1 => field(NORMAL_LENGTH)],
        (motion(), prop_oneof![Just(Field::Constant(0.0)), field(HIT_MOTION)]),
    );
    let camera = (
        prop_oneof![2 => Just(0.0f32), 1 => -0.5f32..0.5],
        prop_oneof![2 => Just(0.0f32), 1 => -0.1f32..0.1],
        prop_oneof![2 => Just((0.0f32, 0.0f32)), 1 => (-0.5f32..0.5, -0.5f32..0.5)],
        prop_oneof![4 => Just(1.0f32), 1 => select(&[0.001f32, 0.1, 10.0, 1e4][..])],
        prop_oneof![4 => Just(1.0f32 / 60.0), 1 => select(&[1e-6f32, 0.004, 0.1, 1e6][..])],
        prop::bool::weighted(0.1),
    );
    let resize = prop::option::weighted(0.08, (0.2f32..1.5, 0.2f32..1.5));
    ((share(), share()), 0u32..1000, images, camera, resize).prop_map(|(scale, seed, images, camera, resize)| {
        let (radiance, hit_distance, depth, roughness, normals, normal_length, (motion, hit_motion)) = images;
        let (camera_shift, camera_turn, jitter, exposure, seconds, reset) = camera;
        FrameSpec {
            scale,
            seed,
            radiance,
            hit_distance,
            depth,
            roughness,
            normals,
            normal_length,
            motion,
            hit_motion,
            camera_shift,
            camera_turn,
            jitter,
            exposure,
            seconds,
            reset,
            resize,
        }
    })
}

/// A random sequence of frames with settings.
#[derive(Debug, Clone, PartialEq)]
pub struct Spec {
    /// Largest size.
    pub size: UVec2,
    /// Settings.
    pub settings: Settings,
    /// Settings from the second frame on, if they change.
    pub later_settings: Option<Settings>,
    /// Frames.
    pub frames: Vec<FrameSpec>,
}

/// Sizes from 1x1 to a few hundred pixels: odd, prime, thin.
pub fn any_size() -> impl Strategy<Value = UVec2> {
    let side = || prop_oneof![1u32..20, select(&[1u32, 7, 8, 9, 16, 31, 33, 61, 64, 97, 128][..])];
    prop_oneof![
        8 => (side(), side()).prop_map(|(x, y)| UVec2::new(x, y)),
        1 => (1u32..400).prop_map(|x| UVec2::new(x, 1)),
        1 => (1u32..400).prop_map(|y| UVec2::new(2, y)),
    ]
}

/// Sets a number by its path, through serialisation, as a settings file would.
pub fn set_number(settings: &Settings, number: &Number, value: f32) -> Settings {
    let mut json = serde_json::to_value(settings).expect("settings can be serialised");
    let pointer = format!("/{}", number.path.replace('.', "/"));
    *json.pointer_mut(&pointer).expect("the path is a setting") = value.into();
    serde_json::from_value(json).expect("a number is still a number")
}

/// A value in a number's range: the default, an end, or anything, by magnitude.
fn number_value(number: &'static Number) -> impl Strategy<Value = f32> {
    let low = number.low.max(number.high * 1e-7);
    let magnitude = (low.max(1e-9).ln()..=number.high.max(1e-6).ln()).prop_map(f32::exp);
    let clamped = magnitude.prop_map(move |value: f32| value.clamp(number.low, number.high));
    prop_oneof![12 => Just(number.default), 1 => Just(number.low), 1 => Just(number.high), 4 => clamped]
}

/// Features that make sense together.
pub fn any_features() -> impl Strategy<Value = Features> {
    let roughness = prop::option::of(select(&[0.0f32, 0.01, 0.447_213_6, 1.0][..]));
    let taps = (select(&[0u32, 1, 4, 12][..]), select(&[0u32, 7, 16][..]), select(&[1u32, 2, 4, 7][..]));
    (prop::array::uniform18(any::<bool>()), taps, roughness).prop_map(|(on, taps, constant_roughness)| {
        let mut features = Features::default();
        // One of the two has to be on.
        (features.mirror_parallax, features.surface_motion) = (on[0] || !on[1], on[1]);
        (features.history_search, features.edge_repair, features.spatial_filter) = (on[2], on[3], on[4]);
        (features.history_clip, features.average_mixing) = (on[5], on[6]);
        (features.light_change, features.outlier_spread, features.wide_filter) = (on[7], on[8], on[9]);
        (features.gbuffer_copy, features.packed_guide, features.block_statistics) = (on[10], on[11], on[12]);
        features.hit_motion = on[13];
        (features.both_histories, features.whole_blocks) = (on[15], on[16]);
        features.block_interpolation = on[17];
        // Derived normals have to be kept.
        features.normal_input = on[14] || !(features.gbuffer_copy && features.packed_guide);
        (features.near_taps, features.young_taps, features.wide_taps) = taps;
        features.constant_roughness = constant_roughness;
        features
    })
}

/// Settings with conventions that the harness' images keep to, everything else at random.
pub fn any_settings() -> impl Strategy<Value = Settings> {
    let rays = select(vec![RaysPerQuad::One, RaysPerQuad::Two, RaysPerQuad::Four]);
    let ray_list = prop::option::of((rays, prop::option::of(0.0f32..=1.0)));
    let preset = select(Preset::ALL.iter().map(|(_, preset)| *preset).collect::<Vec<_>>());
    let normal = select(vec![NormalEncoding::Signed, NormalEncoding::Signed, NormalEncoding::Octahedral]);
    let fallback = select(vec![Fallback::Black, Fallback::Input, Fallback::Environment]);
    let roughness =
        select(vec![RoughnessEncoding::Perceptual, RoughnessEncoding::Perceptual, RoughnessEncoding::Alpha]);
    let threshold = prop::option::of(select(ROUGHNESS).prop_filter("in range", |v| (0.0..=1.0).contains(v)));
    let numbers: Vec<_> = Settings::numbers().map(number_value).collect();
    let values = (prop::option::of(numbers), prop::option::weighted(0.3, any_features()));
    (preset, normal, fallback, roughness, ray_list, threshold, values).prop_map(
        |(preset, normal, fallback, roughness, ray_list, threshold, (values, features))| {
            let mut settings = preset.settings();
            for (number, value) in Settings::numbers().zip(values.into_iter().flatten()) {
                if value != number.default {
                    settings = set_number(&settings, number, value);
                }
            }
            settings.reproject.min_history_cap = settings.reproject.min_history_cap.min(settings.reproject.max_history);
            settings.features = features.unwrap_or(settings.features);
            settings.conventions.depth = DepthEncoding::Linear;
            settings.conventions.normal = normal;
            settings.conventions.roughness = roughness;
            settings.conventions.roughness_channel = Channel::Red;
            settings.coverage.fallback = fallback;
            if let Some(threshold) = threshold {
                settings.coverage.roughness_threshold = threshold;
            }
            settings.coverage.ray_list = ray_list.map(|(rays_per_quad, variance_threshold)| {
                let mut list = RayList::default();
                list.rays_per_quad = rays_per_quad;
                list.variance_threshold = variance_threshold;
                list
            });
            settings
        },
    )
}

/// Anything.
pub fn any_spec() -> impl Strategy<Value = Spec> {
    let later = prop::option::weighted(0.1, any_settings());
    let frames = prop::collection::vec(any_frame(), 1..5);
    (any_size(), any_settings(), later, frames).prop_map(|(size, settings, later_settings, mut frames)| {
        // Depth and roughness mostly stay as they are: otherwise there would hardly ever be history.
        let first = frames[0].clone();
        for frame in frames.iter_mut().skip(1).filter(|frame| frame.seed % 4 != 0) {
            let (depth, roughness, normals) = (first.depth, first.roughness, first.normals);
            *frame = FrameSpec { depth, roughness, normals, ..frame.clone() };
        }
        Spec { size, settings, later_settings, frames }
    })
}

impl Spec {
    /// Whether all numbers are finite and of ordinary size.
    pub fn is_tame(&self) -> bool {
        self.frames.iter().all(|frame| {
            [frame.radiance, frame.hit_distance, frame.depth, frame.normal_length].into_iter().all(tame_field)
        })
    }

    /// Settings, sizes and images of the whole sequence.
    pub fn case(&self) -> Case {
        let mut size = self.size;
        let step = |(index, spec): (usize, &FrameSpec)| {
            let mut change = Change::None;
            if let Some(scale) = spec.resize {
                size = scaled(self.size, scale);
                change = Change::Resize(size);
            } else if let (1, Some(settings)) = (index, &self.later_settings) {
                change = Change::Settings(Box::new(settings.clone()));
            }
            spec.step(change, scaled(size, spec.scale).min(size))
        };
        let steps = self.frames.iter().enumerate().map(step).collect();
        Case { settings: self.settings.clone(), size: self.size, steps }
    }
}

fn scaled(size: UVec2, scale: (f32, f32)) -> UVec2 {
    (size.as_vec2() * Vec2::from(scale)).round().as_uvec2().max(UVec2::ONE)
}

impl FrameSpec {
    fn normal(&self, p: UVec2, size: UVec2) -> Vec3 {
        let uv = (p.as_vec2() + 0.5) / size.as_vec2() - 0.5;
        let direction = match self.normals {
            Normals::Facing => Vec3::Z,
            Normals::Floor => Vec3::Y,
            Normals::Random => {
                Vec3::new(noise(1, p), noise(2, p), noise(3, p)).map(|value| value * 2.0 - 1.0).normalize_or_zero()
            }
            Normals::Curved => Vec3::new(uv.x, -uv.y, 0.7).normalize(),
            Normals::Opposite => {
                if (p.x / 8 + p.y / 8).is_multiple_of(2) {
                    Vec3::Z
                } else {
                    Vec3::NEG_Z
                }
            }
        };
        direction * self.normal_length.at(self.seed ^ 4, p, size)
    }

    fn pixel(&self, p: UVec2, size: UVec2) -> Pixel {
        let red = self.radiance.at(self.seed, p, size);
        Pixel {
            radiance: [red, red * 0.5, red * 0.25, self.hit_distance.at(self.seed ^ 1, p, size)],
            normal: self.normal(p, size).to_array(),
            // Not of the seed: the same in the next frame.
            roughness: self.roughness.at(2, p, size),
            depth: self.depth.at(3, p, size),
            motion: self.motion.at(self.seed ^ 7, p, size).to_array(),
            hit_motion: [8, 9, 10].map(|salt| self.hit_motion.at(self.seed ^ salt, p, size)),
        }
    }

    fn step(&self, change: Change, size: UVec2) -> Step {
        let mut camera = Case::camera(size);
        let turn = Mat4::from_quat(Quat::from_rotation_y(self.camera_turn));
        camera.world_to_view = turn * Mat4::from_translation(Vec3::new(-self.camera_shift, 0.0, 0.0));
        camera.jitter = Vec2::from(self.jitter);
        let mut frame = FrameInputs::new(camera, size);
        frame.exposure = self.exposure;
        frame.frame_seconds = self.seconds;
        frame.reset = self.reset;
        Step { change, frame, images: Images::new(size, |p| self.pixel(p, size)) }
    }
}
