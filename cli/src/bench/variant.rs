//! What is compared: presets, single settings, and the pipeline with one feature left out.

use anyhow::Result;
use limpid::{Preset, Settings};
use serde::{Deserialize, Serialize};

/// Why a variant is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Group {
    /// What there is without a denoiser.
    Baseline,
    /// A denoiser that is not limpid.
    Yardstick,
    /// A preset.
    Preset,
    /// Settings that the user asked for.
    Chosen,
    /// The default preset without one feature.
    Ablation,
}

/// One way to denoise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Variant {
    /// Unique name.
    pub name: String,
    /// Why it is there.
    pub group: Group,
    /// What it is, in a line.
    pub note: String,
    /// Settings; `None` for what is not limpid.
    pub settings: Option<Settings>,
}

/// Name of the variant that times are compared with.
pub const REFERENCE: &str = "reference";
/// Name of the noisy input as a baseline.
pub const NOISY: &str = "noisy";
/// Name of plain accumulation.
pub const ACCUMULATION: &str = "accumulation";

/// Name, what is left out, and the constants that leave it out while the code stays.
pub const ABLATIONS: &[(&str, &str, &[&str])] = &[
    ("no-history", "no temporal accumulation", &["reproject.min_history_cap=1", "reproject.max_history=1"]),
    ("no-parallax", "no reprojection by hit distance", &["reproject.parallax_normal_cosine=1"]),
    ("no-colour-gate", "no colour test on surface history", &["reproject.surface_color_gate=10000"]),
    ("no-disocclusion", "no test of history's normal and depth", &["reproject.disocclusion_threshold=0"]),
    ("no-prefilter", "no spatial blur", &["prefilter.variance_weight_floor=0", "prefilter.variance_falloff=0"]),
    ("no-normal-weight", "blur across normals", &["prefilter.normal_power=0"]),
    ("no-depth-weight", "blur across depth", &["prefilter.depth_falloff=0"]),
    (
        "no-radiance-weight",
        "blur without regard to brightness",
        &["prefilter.radiance_falloff=0", "prefilter.radiance_variance_falloff=0"],
    ),
    ("no-average-weight", "plain 8x8 average", &["reproject.average_luminance_falloff=0"]),
    ("no-average-pull", "clip box around the neighbourhood's mean", &["resolve.clip_average_pull=0"]),
    ("no-clipping", "history and colour are not clipped", &["resolve.clip_scale=1000"]),
];

impl Variant {
    /// What there is without limpid: the noisy input and plain accumulation.
    pub fn baselines() -> [Self; 2] {
        let baseline = |name: &str, note: &str| Self {
            name: name.to_owned(),
            group: Group::Baseline,
            note: note.to_owned(),
            settings: None,
        };
        [
            baseline(NOISY, "one ray a pixel, as traced"),
            baseline(ACCUMULATION, "reprojected by motion vectors and averaged, up to 32 frames, nothing else"),
        ]
    }

    /// Whether its run time is measured.
    pub fn is_timed(&self) -> bool {
        self.group != Group::Baseline
    }

    /// A preset by its name on the command line.
    pub fn preset(name: &str, preset: Preset) -> Self {
        let settings = Some(preset.settings());
        Self { name: name.to_owned(), group: Group::Preset, note: format!("preset {name}"), settings }
    }

    /// The default preset without each of its [`Features`](limpid::settings::Features), whose code is left out, and
    /// without what [`ABLATIONS`] turn off by constants; `load` turns `PATH=VALUE` options into settings.
    ///
    /// # Errors
    ///
    /// Those of `load`.
    pub fn ablations(load: impl Fn(&[String]) -> Result<Settings>) -> Result<Vec<Self>> {
        let ablation = |name: String, note: &str, options: Vec<String>| {
            let note = format!("{note}: {}", options.join(", "));
            Ok(Self { name, group: Group::Ablation, note, settings: Some(load(&options)?) })
        };
        let features = features_of(&Preset::Default.settings())?.into_iter().map(|feature| {
            let option = format!("features.{feature}=false");
            ablation(format!("no-{}", feature.replace('_', "-")), "compiled without", vec![option])
        });
        let constants = ABLATIONS.iter().map(|(name, note, options)| {
            ablation((*name).to_owned(), note, options.iter().map(|option| (*option).to_owned()).collect())
        });
        features.chain(constants).collect()
    }

    /// A variant for each value of `PATH=A,B,C`. Commas inside of brackets separate nothing.
    ///
    /// # Errors
    ///
    /// Those of `load`.
    pub fn sweep(option: &str, load: impl Fn(&[String]) -> Result<Settings>) -> Result<Vec<Self>> {
        let (path, values) = option.split_once('=').unwrap_or((option, ""));
        let variant = |value: String| {
            let name = if option.contains('=') { format!("{path}={value}") } else { path.to_owned() };
            let settings = Some(load(std::slice::from_ref(&name))?);
            Ok(Self { note: format!("default preset with {name}"), name, group: Group::Chosen, settings })
        };
        split_values(values).into_iter().map(variant).collect()
    }
}

/// Names of the features that settings have on.
fn features_of(settings: &Settings) -> Result<Vec<String>> {
    let features = serde_json::to_value(&settings.features)?;
    let features = features.as_object().into_iter().flatten();
    Ok(features.filter(|(_, value)| **value == true).map(|(name, _)| name.clone()).collect())
}

fn split_values(text: &str) -> Vec<String> {
    let mut depth = 0;
    let mut values = vec![String::new()];
    for c in text.chars() {
        match c {
            '[' => depth += 1,
            ']' => depth -= 1,
            ',' if depth == 0 => {
                values.push(String::new());
                continue;
            }
            _ => {}
        }
        values.last_mut().expect("there is always one").push(c);
    }
    values
}
