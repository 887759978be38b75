//! `limpid demo`.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::Args;
use glam::UVec2;
use image::RgbImage;
use indicatif::{ProgressBar, ProgressStyle};
use limpid::DebugView;
use limpid::settings::{RayList, RaysPerQuad};

use super::debug_view::DebugViewOptions;
use super::denoise::{check_outputs, comparison, create_dir, write_png};
use super::parse_size;
use super::report::Recorder;
use super::settings::SettingsOptions;
use crate::backend::{self, Choice};
use crate::legend::with_legend;
use crate::picture;
use crate::scene::{self, Scene};
use crate::sequence::{self, Frame, Metadata};

/// Renders a built-in scene with one noisy ray a pixel, denoises it, and measures the result.
///
/// Writes to the output folder: animation.png (noisy, denoised, reference; browsers play it), comparison.png
/// (the last frame), strip.png (some frames), denoised/*.exr, and noisy/, a sequence that `limpid denoise` reads.
#[derive(Debug, Args)]
pub(super) struct Demo {
    /// Which scene; see --list.
    #[arg(long, default_value = "gallery")]
    scene: String,
    /// List the scenes.
    #[arg(long)]
    list: bool,
    /// Image size.
    #[arg(long, default_value = "320x180", value_parser = parse_size, value_name = "WIDTHxHEIGHT")]
    size: UVec2,
    /// How many frames.
    #[arg(long, default_value_t = 12, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    frames: u32,
    /// Rays a pixel of the reference; 0 renders none and measures no error.
    #[arg(long, default_value_t = scene::REFERENCE_SAMPLES)]
    samples: u32,
    /// Trace only the rays that the classify pass lists: 1, 2 or 4 in each 2x2 pixels.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=4))]
    rays_per_quad: Option<u32>,
    /// Give pixels whose variance was above this, 0 to 1, a ray of their own.
    #[arg(long, requires = "rays_per_quad", value_name = "VARIANCE")]
    extra_rays_above: Option<f32>,
    /// Folder to write to.
    #[arg(long, default_value = "limpid-demo", value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    settings: SettingsOptions,
    #[command(flatten)]
    debug_view: DebugViewOptions,
    /// What to run on.
    #[arg(long, value_enum, default_value_t)]
    backend: Choice,
    /// Replace files that exist.
    #[arg(long)]
    force: bool,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Most rows of the film strip.
const STRIP_ROWS: usize = 4;

fn file_name(number: u32) -> String {
    format!("frame_{number:04}.exr")
}

fn list_scenes() -> Result<()> {
    let lines = scene::all().into_iter().map(|scene| format!("{:<12}{}\n", scene.name, scene.description));
    super::print(&lines.collect::<String>())
}

/// Frames one after another in a PNG that plays.
fn write_animation(path: &Path, frames: &[RgbImage]) -> Result<()> {
    let mut bytes = Vec::new();
    let first = frames.first().context("there is no frame to animate")?;
    let mut encoder = png::Encoder::new(&mut bytes, first.width(), first.height());
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_animated(frames.len() as u32, 0)?;
    encoder.set_frame_delay(1, 8)?;
    let mut writer = encoder.write_header()?;
    for frame in frames {
        writer.write_image_data(frame)?;
    }
    writer.finish()?;
    sequence::write_atomically(path, |file| std::io::Write::write_all(file, &bytes))
        .with_context(|| format!("cannot write {}", path.display()))
}

impl Demo {
    fn ray_list(&self) -> Option<RayList> {
        let rays_per_quad = match self.rays_per_quad? {
            1 => RaysPerQuad::One,
            2 | 3 => RaysPerQuad::Two,
            _ => RaysPerQuad::Four,
        };
        let mut list = RayList::default();
        list.rays_per_quad = rays_per_quad;
        list.variance_threshold = self.extra_rays_above;
        Some(list)
    }

    fn outputs(&self) -> Vec<PathBuf> {
        let pictures =
            ["animation.png", "comparison.png", "strip.png", "noisy/camera.json"].map(|name| self.out.join(name));
        let frames = (0..self.frames)
            .flat_map(|number| ["denoised", "noisy"].map(|dir| self.out.join(dir).join(file_name(number))));
        pictures.into_iter().chain(frames).collect()
    }

    /// All frames; without noisy radiance when only listed rays are to be traced.
    fn render(&self, scene: &Scene, noisy: bool) -> Vec<Frame> {
        let progress = ProgressBar::new(self.frames.into());
        progress.set_style(
            ProgressStyle::with_template("rendering {wide_bar} {pos}/{len}, {eta} left")
                .expect("the template is valid"),
        );
        let frames = (0..self.frames).map(|number| {
            let mut frame = if noisy { scene.render(number, self.size, 0) } else { scene.gbuffer(number, self.size) };
            frame.reference = (self.samples > 0).then(|| scene.reference(number, &frame, self.samples));
            progress.inc(1);
            frame
        });
        let frames = frames.collect();
        progress.finish_and_clear();
        frames
    }

    pub(super) fn run(&self) -> Result<()> {
        if self.list {
            return list_scenes();
        }
        let Some(scene) = scene::by_name(&self.scene) else {
            let names: Vec<_> = scene::all().iter().map(|scene| scene.name).collect();
            bail!("there is no scene `{}`; there are {}", self.scene, names.join(", "));
        };
        if self.rays_per_quad == Some(3) {
            bail!("--rays-per-quad is 3, expected 1, 2 or 4");
        }
        let mut settings = self.settings.load()?;
        self.debug_view.apply(&mut settings);
        if let Some(list) = self.ray_list() {
            settings.coverage.ray_list = Some(list);
        }
        check_outputs(self.outputs().iter().map(PathBuf::as_path), self.force)?;
        let mut backend = backend::open(self.backend, &settings, self.size)?;
        eprintln!(
            "scene {}: rendering {} frames of {}x{}, denoising on {}",
            scene.name,
            self.frames,
            self.size.x,
            self.size.y,
            backend.device()
        );

        let lists_rays = settings.coverage.ray_list.is_some();
        let mut frames = self.render(&scene, !lists_rays);
        for dir in ["denoised", "noisy"] {
            create_dir(&self.out.join(dir))?;
        }
        let exposure = 1.0;
        let mut recorder = Recorder::new(exposure);
        let mut pictures = Vec::new();
        for frame in &mut frames {
            let gbuffer: &Frame = frame;
            let tracer = |pixels: &[UVec2]| scene.trace(gbuffer.number, gbuffer, pixels);
            let denoised = backend.denoise(gbuffer, exposure, lists_rays.then_some(&tracer))?;
            if let Some(traced) = &denoised.traced {
                frame.radiance.clone_from(traced);
            }
            let path = self.out.join("denoised").join(file_name(frame.number));
            sequence::write_exr(&path, frame.size, &denoised.radiance, &Metadata::new(frame.size))?;
            recorder.add(frame, &denoised);
            pictures.push(comparison(frame, &denoised, exposure));
        }
        sequence::write_sequence(&self.out.join("noisy"), scene.name, exposure, &frames)?;
        self.write_pictures(&pictures, settings.features.debug_view)?;
        recorder.finish(scene.name.to_owned(), backend.as_ref()).print(self.json)?;
        eprintln!("wrote {}", self.out.join("animation.png").display());
        Ok(())
    }

    fn write_pictures(&self, pictures: &[RgbImage], view: Option<DebugView>) -> Result<()> {
        let explained: Vec<_> = pictures.iter().map(|picture| with_legend(picture, view)).collect();
        write_animation(&self.out.join("animation.png"), &explained)?;
        if let Some(last) = explained.last() {
            write_png(&self.out.join("comparison.png"), last)?;
        }
        let step = pictures.len().div_ceil(STRIP_ROWS);
        let rows: Vec<_> = pictures.iter().step_by(step).cloned().collect();
        write_png(&self.out.join("strip.png"), &with_legend(&picture::film_strip(&rows, 1), view))
    }
}
