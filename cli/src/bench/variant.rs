//! What is compared: presets, single settings, and the pipeline with one feature left out.

use anyhow::Result;
use glam::UVec2;
use limpid::{Plan, Preset, Settings};
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

/// Name, what is left out of the default preset, and the settings that leave it out without being a feature.
pub const ABLATIONS: &[(&str, &str, &[&str])] = &[
    (
        "short-history",
        "history counts as one frame",
        &["accumulate.mirror_history_seconds=0", "accumulate.max_history_seconds=0"],
    ),
    (
        "long-mirror-history",
        "history of mirrors as long as of other surfaces",
        &["accumulate.mirror_history_seconds=0.5"],
    ),
    ("no-outlier-cut", "outliers stay where they are", &["accumulate.outlier_factor=65504"]),
    ("no-excess", "what is cut off from outliers is lost", &["accumulate.excess_limit=0"]),
    ("no-disagreement-limit", "two histories apart count in full", &["accumulate.disagreement_limit=1000"]),
    ("round-footprint", "footprints as wide as long at grazing angles", &["footprint.grazing_width=1"]),
    ("no-near-taps", "blocks alone", &["features.near_taps=0"]),
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
    /// without what [`ABLATIONS`] turn off by other settings; `load` turns `PATH=VALUE` options into settings.
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

/// Names of the features that settings have on, of their pipeline: without one of another the plan is the same.
fn features_of(settings: &Settings) -> Result<Vec<String>> {
    let plan = |settings: &Settings| Plan::new(settings, UVec2::ONE).map(|(plan, _)| plan);
    let (whole, json) = (plan(settings)?, serde_json::to_value(settings)?);
    let mut names = Vec::new();
    for (name, _) in json["features"].as_object().into_iter().flatten().filter(|(_, value)| **value == true) {
        let mut json = json.clone();
        json["features"][name] = false.into();
        if plan(&serde_json::from_value(json)?)? != whole {
            names.push(name.clone());
        }
    }
    Ok(names)
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
