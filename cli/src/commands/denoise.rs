//! `limpid denoise`.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::Args;
use indicatif::ProgressBar;

use super::debug_view::DebugViewOptions;
use super::report::{Recorder, noisy_radiance};
use super::settings::SettingsOptions;
use crate::backend::{self, Choice, Denoised};
use crate::legend::with_legend;
use crate::picture;
use crate::sequence::{self, ChannelNames, Frame, Metadata, Sequence};

/// Denoises a sequence of EXR frames.
///
/// SEQUENCE is a folder with camera.json and one multi-channel EXR file a frame; docs/sequence.md describes
/// both. Scores are printed when the frames contain a reference.
#[derive(Debug, Args)]
pub(super) struct Denoise {
    /// Folder with camera.json and the frames.
    sequence: PathBuf,
    /// Folder to write to; frames keep their names.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    settings: SettingsOptions,
    #[command(flatten)]
    debug_view: DebugViewOptions,
    /// Channel of the EXR files for an input, such as depth=ViewLayer.Depth.Z. Inputs are radiance,
    /// hit_distance, normal, roughness, depth, motion, hit_motion and reference; a name stands for all channels that
    /// begin with it, a comma separates exact names. Can be given more than once.
    #[arg(long, value_name = "INPUT=NAME")]
    channel: Vec<String>,
    /// Factor that brings radiance near 1 for the filters, the scores and the pictures; from camera.json if
    /// not given.
    #[arg(long)]
    exposure: Option<f32>,
    /// Also write a PNG of each frame: noisy, denoised and, if there is one, the reference.
    #[arg(long)]
    png: bool,
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

/// Refuses to replace files.
pub(super) fn check_outputs<'p>(outputs: impl Iterator<Item = &'p Path>, force: bool) -> Result<()> {
    let existing: Vec<&Path> = outputs.filter(|path| path.exists()).collect();
    match existing.first() {
        Some(first) if !force => {
            bail!(
                "{} exists ({} in all); use --force to replace or --out to write elsewhere",
                first.display(),
                existing.len()
            )
        }
        _ => Ok(()),
    }
}

/// Creates a folder and its parents.
pub(super) fn create_dir(path: &Path) -> Result<()> {
    fs::create_dir_all(path).with_context(|| format!("cannot create the folder {}", path.display()))
}

/// Noisy, denoised and, if there are such, the reference and the debug view, side by side.
pub(super) fn comparison(frame: &Frame, denoised: &Denoised, exposure: f32) -> image::RgbImage {
    let noisy = noisy_radiance(frame);
    let images = [Some(&noisy), Some(&denoised.radiance), frame.reference.as_ref()];
    let pictures = images.into_iter().flatten().map(|image| picture::tone_map(image, frame.size, exposure));
    let debug_view = denoised.debug_view.iter().map(|colors| picture::display(colors, frame.size));
    picture::side_by_side(&pictures.chain(debug_view).collect::<Vec<_>>())
}

/// Writes a picture.
pub(super) fn write_png(path: &Path, picture: &image::RgbImage) -> Result<()> {
    picture::write_png(path, picture).with_context(|| format!("cannot write {}", path.display()))
}

impl Denoise {
    /// EXR and PNG file of each frame.
    fn outputs(&self, sequence: &Sequence) -> Result<Vec<(PathBuf, PathBuf)>> {
        let same =
            |a: &Path, b: &Path| fs::canonicalize(a).ok().is_some_and(|a| fs::canonicalize(b).is_ok_and(|b| a == b));
        if same(&self.out, &self.sequence) {
            bail!("--out is the folder of the sequence itself; its frames would be replaced");
        }
        let mut outputs: Vec<(PathBuf, PathBuf)> = Vec::new();
        for index in 0..sequence.len() {
            let source = sequence.path(index)?;
            let name = source.file_name().with_context(|| format!("{} names no file", source.display()))?;
            let exr = self.out.join(name);
            if outputs.iter().any(|(other, _)| *other == exr) {
                bail!("two frames of the sequence have files called {}", name.display());
            }
            outputs.push((exr.clone(), exr.with_extension("png")));
        }
        Ok(outputs)
    }

    pub(super) fn run(&self) -> Result<()> {
        let mut settings = self.settings.load()?;
        self.debug_view.apply(&mut settings);
        let view = settings.features.debug_view;
        let writes_png = self.png || view.is_some();
        let channels = ChannelNames::parse(&self.channel)?;
        let sequence = Sequence::open(&self.sequence, &channels)?;
        let outputs = self.outputs(&sequence)?;
        let pictures = outputs.iter().filter(|_| writes_png).map(|(_, png)| png.as_path());
        check_outputs(outputs.iter().map(|(exr, _)| exr.as_path()).chain(pictures), self.force)?;
        let exposure = self.exposure.unwrap_or(sequence.exposure());

        let mut backend = backend::open(self.backend, &settings, sequence.size())?;
        eprintln!("denoising {} on {}", sequence.name(), backend.device());
        create_dir(&self.out)?;
        let mut recorder = Recorder::new(exposure);
        let progress = ProgressBar::new(sequence.len() as u64);
        for (index, (exr, png)) in outputs.iter().enumerate() {
            let (source, frame) = (sequence.path(index)?, sequence.load(index)?);
            let warnings = frame.warnings();
            if !warnings.is_empty() {
                progress.suspend(|| eprintln!("warning: {}: {warnings}", source.display()));
            }
            let denoised = backend.denoise(&frame, exposure, None);
            let denoised = denoised.with_context(|| format!("cannot denoise {}", source.display()))?;
            let metadata: Metadata = sequence.metadata(index)?;
            sequence::write_exr(exr, frame.size, &denoised.radiance, &metadata)?;
            if writes_png {
                write_png(png, &with_legend(&comparison(&frame, &denoised, exposure), view))?;
            }
            recorder.add(&frame, &denoised);
            progress.inc(1);
        }
        progress.finish_and_clear();
        recorder.finish(sequence.name(), backend.as_ref()).print(self.json)
    }
}
