//! Other denoisers to compare with, which run on the same frames in turn with limpid.

use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::Duration;

use anyhow::{Context, Result, bail};
use clap::ValueEnum;

use super::variant::{Group, Variant};
use crate::sequence::Frame;

/// A denoiser that is not limpid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Yardstick {
    /// Intel Open Image Denoise on each frame alone, by the Python package `pyoidn`.
    Oidn,
}

impl Yardstick {
    /// All of them.
    pub const ALL: [Self; 1] = [Self::Oidn];

    /// Name of its variant.
    pub fn name(self) -> &'static str {
        match self {
            Self::Oidn => "oidn",
        }
    }

    /// The variant that stands for it in a report.
    pub fn variant(self) -> Variant {
        let note = match self {
            Self::Oidn => {
                "Intel Open Image Denoise, a neural network for finished pictures, on each frame alone; guides are \
                 normal and, as albedo, roughness"
            }
        };
        Variant { name: self.name().to_owned(), group: Group::Yardstick, note: note.to_owned(), settings: None }
    }

    /// Starts it.
    ///
    /// # Errors
    ///
    /// When what it needs is not installed; the message says what.
    pub fn open(self) -> Result<Oidn> {
        match self {
            Self::Oidn => Oidn::open(),
        }
    }
}

const PYTHON: &str = if cfg!(windows) { "python" } else { "python3" };
const SCRIPT: &str = include_str!("oidn.py");

/// Open Image Denoise in a Python process.
pub struct Oidn {
    child: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
}

/// An image and the time that the network took for it.
pub struct Answer {
    /// Linear radiance, row by row.
    pub radiance: Vec<[f32; 3]>,
    /// By the clock.
    pub time: Duration,
    /// Of all processors together.
    pub cpu_time: Duration,
}

impl Oidn {
    fn open() -> Result<Self> {
        let mut command = Command::new(PYTHON);
        command.args(["-c", SCRIPT]).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null());
        let mut child = command.spawn().with_context(|| format!("cannot run {PYTHON}"))?;
        let input = child.stdin.take().context("a process without standard input")?;
        let mut output = BufReader::new(child.stdout.take().context("a process without standard output")?);
        let mut greeting = String::new();
        output.read_line(&mut greeting)?;
        if greeting.trim() != "ready" {
            child.wait()?;
            bail!("{PYTHON} says `{}`; `pip install numpy pyoidn==2.5.1.0` may help", greeting.trim());
        }
        Ok(Self { child, input, output })
    }

    /// Denoises a frame.
    ///
    /// # Errors
    ///
    /// When the process has ended.
    pub fn denoise(&mut self, frame: &Frame) -> Result<Answer> {
        self.ask(frame).context("Open Image Denoise ended")
    }

    fn ask(&mut self, frame: &Frame) -> Result<Answer> {
        let mut bytes: Vec<u8> = frame.size.to_array().iter().flat_map(|side| side.to_le_bytes()).collect();
        let mut push = |rgb: [f32; 3]| rgb.iter().for_each(|value| bytes.extend(value.to_le_bytes()));
        frame.radiance.iter().for_each(|&[r, g, b, _]| push([r, g, b]));
        frame.normal.iter().for_each(|&normal| push(normal));
        frame.roughness.iter().for_each(|&roughness| push([roughness; 3]));
        self.input.write_all(&bytes)?;
        self.input.flush()?;
        let mut seconds = || -> Result<Duration> {
            let mut bytes = [0; 8];
            self.output.read_exact(&mut bytes)?;
            Ok(Duration::try_from_secs_f64(f64::from_le_bytes(bytes))?)
        };
        let (time, cpu_time) = (seconds()?, seconds()?);
        let mut image = vec![0; 12 * frame.pixels()];
        self.output.read_exact(&mut image)?;
        let values: Vec<f32> = image.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
        Ok(Answer { radiance: values.as_chunks().0.to_vec(), time, cpu_time })
    }
}

/// The process is not left behind.
impl Drop for Oidn {
    fn drop(&mut self) {
        // It may have ended already, and then there is nothing to do.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
