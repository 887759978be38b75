//! `limpid bench`.

use std::collections::HashSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, Result, bail};
use clap::Args;
use glam::UVec2;
use indicatif::{ProgressBar, ProgressStyle};
use limpid::{Preset, Settings};

use super::denoise::create_dir;
use super::interrupt;
use super::parse_size;
use super::settings::SettingsOptions;
use crate::backend::{self, Choice};
use crate::bench::compare::compare;
use crate::bench::counts::Counts;
use crate::bench::measure::{Observer, run_group};
use crate::bench::record::VariantInfo;
use crate::bench::scaling::{Sizes, scaling};
use crate::bench::subject::{self, Rendering};
use crate::bench::variant::{Group, REFERENCE, Variant};
use crate::bench::yardstick::Yardstick;
use crate::bench::{Config, Report, Subject, figures, markdown, page, table};
use crate::cost::{Driver, Job};
use crate::picture;
use crate::scene;
use crate::sequence::{ChannelNames, write_atomically};

/// Measures error against run time, over presets, settings and features, and writes a report.
///
/// Writes to the output folder: report.html (everything, loads nothing), bench.json, bench.csv, measured.md (tables),
/// figures/*.svg and pictures/*.png. Ctrl-C keeps what is finished; --resume goes on.
#[derive(Debug, Args)]
pub(super) struct Bench {
    /// Built-in scene, or `events`, in which things change suddenly. Can be given more than once; all of them if
    /// neither --scene nor --sequence is given.
    #[arg(long, value_name = "NAME")]
    scene: Vec<String>,
    /// Folder with a sequence that has references; see docs/sequence.md. Can be given more than once.
    #[arg(long, value_name = "DIR")]
    sequence: Vec<PathBuf>,
    /// Channel of the EXR files for an input, as for `limpid denoise`.
    #[arg(long, value_name = "INPUT=NAME")]
    channel: Vec<String>,
    /// Image size of built-in scenes.
    #[arg(long, default_value = "320x180", value_parser = parse_size, value_name = "WIDTHxHEIGHT")]
    size: UVec2,
    /// Frames of a built-in scene, and most frames of a folder.
    #[arg(long, default_value_t = 16, value_parser = clap::value_parser!(u32).range(2..=10_000))]
    frames: u32,
    /// Rays a pixel of references of built-in scenes.
    #[arg(long, default_value_t = scene::REFERENCE_SAMPLES, value_parser = clap::value_parser!(u32).range(1..))]
    samples: u32,
    /// How often each frame is timed; 0 measures errors and counts alone, which are the same in every run.
    #[arg(long, default_value_t = 3)]
    repetitions: u32,
    /// Preset to measure; all of them if not given. `reference` always takes part. Can be given more than once.
    #[arg(long)]
    preset: Vec<String>,
    /// TOML or JSON file with settings that differ from the default preset. Can be given more than once.
    #[arg(long, value_name = "FILE")]
    settings: Vec<PathBuf>,
    /// One setting with one or more values, such as resolve.stability=0.3,0.5: the default preset with each of
    /// them. Can be given more than once.
    #[arg(long, value_name = "PATH=VALUE,...")]
    set: Vec<String>,
    /// Another denoiser to measure on the same frames in turn; `oidn` wants Python with numpy and pyoidn. What is
    /// not installed is skipped.
    #[arg(long, value_enum)]
    yardstick: Option<Yardstick>,
    /// Do not measure the default preset without each of its features.
    #[arg(long)]
    no_ablations: bool,
    /// Most seconds to spend on run time over image sizes, for each preset; 0 leaves it out.
    #[arg(long, default_value_t = 40, value_name = "SECONDS")]
    scaling_seconds: u64,
    /// Image size for run time, instead of the usual ones and whatever it takes, such as 7680x4320. A size for which
    /// there is not enough memory becomes the largest of its shape for which there is.
    #[arg(long, value_parser = parse_size, value_name = "WIDTHxHEIGHT")]
    scaling_size: Vec<UVec2>,
    /// What to run on.
    #[arg(long, value_enum, default_value_t)]
    backend: Choice,
    /// Folder to write to.
    #[arg(long, default_value = "limpid-bench", value_name = "DIR")]
    out: PathBuf,
    /// Go on with an interrupted run in the output folder.
    #[arg(long)]
    resume: bool,
    /// Replace a report that exists.
    #[arg(long)]
    force: bool,
    /// Compare two bench.json: what got better or worse beyond noise. Fails if an error or a count got worse.
    #[arg(long, num_args = 2, value_names = ["BEFORE", "AFTER"])]
    compare: Option<Vec<PathBuf>>,
}

/// What RADV compiles for, where it is installed.
const GPU: &str = "navi21";

/// Variants measured together with the reference, so that not too many are in memory.
const GROUP: usize = 6;

fn progress_bar(length: u64, what: &str) -> ProgressBar {
    let style =
        ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len}, {eta} left").expect("the template is valid");
    ProgressBar::new(length).with_style(style).with_message(what.to_owned())
}

fn read_report(path: &Path) -> Result<Report> {
    let text = fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    serde_json::from_str(&text).with_context(|| format!("{} is no report of limpid bench", path.display()))
}

fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    write_atomically(path, |file| std::io::Write::write_all(file, bytes))
        .with_context(|| format!("cannot write {}", path.display()))
}

fn compare_files(before: &Path, after: &Path) -> Result<()> {
    let comparison = compare(&read_report(before)?, &read_report(after)?);
    super::print(&comparison.to_string())?;
    match comparison.worse() {
        0 => Ok(()),
        worse => bail!("{worse} of {} values got worse", comparison.compared),
    }
}

/// Options on top of the default preset.
fn load_options(options: &[String]) -> Result<Settings> {
    SettingsOptions::new("default", None, options).load()
}

/// Moves the bar and keeps the last frame of each variant as a picture.
struct Watcher<'b> {
    bar: &'b ProgressBar,
    folder: &'b Path,
    failure: Option<anyhow::Error>,
}

impl Observer for Watcher<'_> {
    fn denoised(&mut self, subject: &Subject, variant: &Variant, frame: usize, radiance: &[[f32; 3]]) -> bool {
        self.bar.inc(1);
        let is_shown = frame + 1 == subject.frames.len() && subject.events.is_empty();
        if is_shown && variant.group != Group::Ablation {
            let picture = picture::tone_map(radiance, subject.frames[frame].size, subject.exposure);
            let path = self.folder.join(picture_name(&subject.name, &variant.name));
            self.failure = picture::write_png(&path, &picture).with_context(|| path.display().to_string()).err();
        }
        self.failure.is_none() && !interrupt::requested()
    }
}

fn picture_name(sequence: &str, variant: &str) -> String {
    let safe = |c: char| if c.is_alphanumeric() || "-_.=".contains(c) { c } else { '_' };
    format!("{sequence}--{variant}.png").chars().map(safe).collect()
}

impl Bench {
    fn variants(&self) -> Result<Vec<Variant>> {
        let mut variants: Vec<Variant> = Variant::baselines().into();
        for name in &self.preset {
            if !Preset::ALL.iter().any(|(known, _)| known == name) {
                bail!("there is no preset `{name}`");
            }
        }
        let is_wanted = |name: &str| self.preset.is_empty() || self.preset.iter().any(|p| p == name);
        let presets = Preset::ALL.iter().filter(|(name, _)| *name == REFERENCE || is_wanted(name));
        variants.extend(presets.map(|(name, preset)| Variant::preset(name, *preset)));
        if let Some(yardstick) = self.yardstick {
            match yardstick.open() {
                Ok(_) => variants.push(yardstick.variant()),
                Err(error) => eprintln!("SKIPPED: yardstick {}: {error:#}", yardstick.name()),
            }
        }
        for file in &self.settings {
            let settings = SettingsOptions::new("default", Some(file), &[]).load()?;
            let name = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            let note = format!("default preset with {}", file.display());
            variants.push(Variant { name, group: Group::Chosen, note, settings: Some(settings) });
        }
        for option in &self.set {
            variants.extend(Variant::sweep(option, load_options)?);
        }
        if !self.no_ablations {
            variants.extend(Variant::ablations(load_options)?);
        }
        for (index, variant) in variants.iter().enumerate() {
            if variants[..index].iter().any(|other| other.name == variant.name) {
                bail!("two variants are called `{}`", variant.name);
            }
        }
        Ok(variants)
    }

    fn config(&self) -> Config {
        Config { size: self.size, frames: self.frames, samples: self.samples, repetitions: self.repetitions }
    }

    fn json_path(&self) -> PathBuf {
        self.out.join("bench.json")
    }

    fn start(&self, choice: Choice, variants: &[Variant]) -> Result<Report> {
        let device = backend::open(choice, &Settings::default(), UVec2::splat(8))?.device().to_owned();
        let (driver, program) = (Driver::find(None).ok(), std::env::current_exe()?);
        let compiled =
            |settings: &Settings| Job { program: &program, settings, kernels: None }.run(driver.as_ref()?, GPU).ok();
        let info = |variant: &Variant| {
            let settings = variant.settings.as_ref();
            let counts = settings.map(|settings| Counts::new(settings, UVec2::new(1920, 1080))).transpose()?;
            Ok(VariantInfo { variant: variant.clone(), counts, compiled: settings.and_then(compiled) })
        };
        let mut report = Report {
            limpid: env!("CARGO_PKG_VERSION").to_owned(),
            config: self.config(),
            device,
            variants: variants.iter().map(info).collect::<Result<_>>()?,
            sequences: Vec::new(),
            runs: Vec::new(),
            scaling: Vec::new(),
        };
        let path = self.json_path();
        if self.resume {
            report.resume(read_report(&path)?)?;
        } else if path.exists() && !self.force {
            bail!("{} exists; use --resume to go on, --force to replace or --out to write elsewhere", path.display());
        }
        Ok(report)
    }

    /// Built-in sequences and folders, each with how to get it.
    fn sources(&self) -> Vec<Source<'_>> {
        let built_in: Vec<&str> = match (&self.scene[..], &self.sequence[..]) {
            ([], []) => subject::names().collect(),
            (scenes, _) => scenes.iter().map(String::as_str).collect(),
        };
        let folders = self.sequence.iter().map(|path| Source::Folder(path));
        built_in.into_iter().map(Source::BuiltIn).chain(folders).collect()
    }

    /// The frames of a source; `None` when interrupted.
    fn load(&self, source: &Source<'_>) -> Result<Option<Subject>> {
        match source {
            Source::Folder(path) => Subject::folder(path, &ChannelNames::parse(&self.channel)?, self.frames).map(Some),
            Source::BuiltIn(name) => {
                let bar = progress_bar(subject::frame_count(name, self.frames).into(), &format!("rendering {name}"));
                let progress = || {
                    bar.inc(1);
                    !interrupt::requested()
                };
                let (size, frames, samples) = (self.size, self.frames, self.samples);
                let subject = Subject::built_in(name, &Rendering { size, frames, samples, progress: &progress });
                bar.finish_and_clear();
                subject
            }
        }
    }

    fn save(&self, report: &Report) -> Result<()> {
        write(&self.json_path(), &serde_json::to_vec(report)?)
    }

    /// Measures everything that the report lacks on a sequence; whether it came to the end.
    fn measure(&self, choice: Choice, subject: &Subject, report: &mut Report) -> Result<bool> {
        let variants: Vec<Variant> = report.variants.iter().map(|info| info.variant.clone()).collect();
        let lacking: Vec<&Variant> =
            variants.iter().filter(|v| report.run(&subject.name, &v.name).is_none() && v.name != REFERENCE).collect();
        let Some(reference) = variants.iter().find(|variant| variant.name == REFERENCE) else { return Ok(true) };
        if !report.sequences.iter().any(|sequence| sequence.name == subject.name) {
            report.sequences.push(subject.info());
        }
        let pictures = self.out.join("pictures");
        self.keep_reference(subject, &pictures)?;
        let repetitions = |v: &Variant| if v.is_timed() { self.repetitions.max(1) } else { 1 };
        let work: u32 = lacking.iter().map(|v| repetitions(v)).sum();
        let groups = lacking.len().div_ceil(GROUP) as u32 * self.repetitions.max(1);
        let bar = progress_bar(
            u64::from(work + groups) * subject.frames.len() as u64,
            &format!("measuring {}", subject.name),
        );
        for group in lacking.chunks(GROUP) {
            let group: Vec<&Variant> = std::iter::once(reference).chain(group.iter().copied()).collect();
            let mut watcher = Watcher { bar: &bar, folder: &pictures, failure: None };
            let runs = run_group(choice, subject, &group, self.repetitions, &mut watcher)?;
            if let Some(failure) = watcher.failure {
                return Err(failure);
            }
            let Some(runs) = runs else { return Ok(false) };
            for run in runs {
                if report.run(&run.sequence, &run.variant).is_none() {
                    report.runs.push(run);
                }
            }
            self.save(report)?;
        }
        bar.finish_and_clear();
        Ok(true)
    }

    fn keep_reference(&self, subject: &Subject, folder: &Path) -> Result<()> {
        let last = subject.frames.last().filter(|_| subject.events.is_empty());
        if let Some((frame, reference)) = last.and_then(|frame| Some((frame, frame.reference.as_ref()?))) {
            let path = folder.join(picture_name(&subject.name, "converged"));
            picture::write_png(&path, &picture::tone_map(reference, frame.size, subject.exposure))
                .with_context(|| format!("cannot write {}", path.display()))?;
        }
        Ok(())
    }

    fn measure_scaling(&self, choice: Choice, subject: &Subject, report: &mut Report) -> Result<()> {
        let presets = report.variants.iter().map(|info| info.variant.clone()).filter(|v| v.group == Group::Preset);
        let presets: Vec<Variant> = presets.collect();
        for variant in presets {
            if report.scaling.iter().any(|point| point.variant == variant.name) || interrupt::requested() {
                continue;
            }
            let sizes = match &self.scaling_size[..] {
                [] => Sizes::Within(Duration::from_secs(self.scaling_seconds)),
                sizes => Sizes::Exactly(sizes),
            };
            let first = subject.frames.len().min(2);
            eprintln!("timing {} over image sizes and shares of tiles", variant.name);
            let points = scaling(choice, &variant, &subject.frames[..first], sizes, &interrupt::requested)?;
            // Half a curve would pass for a whole one.
            if !interrupt::requested() {
                report.scaling.extend(points);
            }
        }
        Ok(())
    }

    /// Pictures in the order of sequences and variants.
    fn pictures(&self, report: &Report) -> Vec<(String, Vec<u8>)> {
        let mut pictures = Vec::new();
        for sequence in &report.sequences {
            let names = report.variants.iter().map(|info| info.variant.name.as_str()).chain(["converged"]);
            for name in names {
                let path = self.out.join("pictures").join(picture_name(&sequence.name, name));
                // Those of ablations and of what was interrupted are not there.
                if let Ok(png) = fs::read(path) {
                    pictures.push((format!("{}: {name}", sequence.name), png));
                }
            }
        }
        pictures
    }

    fn finish(&self, report: &Report) -> Result<()> {
        self.save(report)?;
        write(&self.out.join("bench.csv"), table::csv(report).as_bytes())?;
        write(&self.out.join("measured.md"), markdown(report).as_bytes())?;
        for (name, svg) in figures(report) {
            write(&self.out.join("figures").join(format!("{name}.svg")), svg.as_bytes())?;
        }
        write(&self.out.join("report.html"), page(report, &self.pictures(report)).as_bytes())?;
        super::print(&table::summary(report))?;
        eprintln!("wrote {}", self.out.join("report.html").display());
        Ok(())
    }

    pub(super) fn run(&self) -> Result<()> {
        if let Some([before, after]) = self.compare.as_deref() {
            return compare_files(before, after);
        }
        let variants = self.variants()?;
        let choice = backend::settle(self.backend);
        let mut report = self.start(choice, &variants)?;
        for folder in ["figures", "pictures"] {
            create_dir(&self.out.join(folder))?;
        }
        interrupt::listen()?;
        eprintln!("{} variants on {}", variants.len(), report.device);
        let mut names = HashSet::new();
        for source in self.sources() {
            let Some(subject) = self.load(&source)? else { break };
            if !names.insert(subject.name.clone()) {
                bail!("two sequences are called `{}`", subject.name);
            }
            if !self.measure(choice, &subject, &mut report)? {
                break;
            }
            if self.scaling_seconds > 0 && self.repetitions > 0 {
                self.measure_scaling(choice, &subject, &mut report)?;
            }
        }
        self.finish(&report)?;
        if interrupt::requested() {
            bail!("interrupted; what was finished is kept, go on with --resume");
        }
        Ok(())
    }
}

/// Where a sequence comes from.
enum Source<'a> {
    BuiltIn(&'a str),
    Folder(&'a Path),
}
