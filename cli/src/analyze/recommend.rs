//! The smallest settings that suit a sequence, and what they save by the plan.

use std::fmt;

use anyhow::{Context, Result};
use glam::UVec2;
use limpid::settings::Pipeline;
use limpid::{Plan, Settings};
use serde::Serialize;
use serde_json::{Map, Value, json};

use super::needs::{LIGHT_ROUGHNESS, OUTLIER_ROUGHNESS, REFLECTION_UP_TO, WHOLE_ROUGHNESS};
use super::{Content, Needs, percent};
use crate::bench::counts::Counts;

/// A setting that suits the sequence better.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Change {
    /// Where in [`Settings`], such as `features.light_change`.
    pub setting: String,
    /// Its value, as in a settings file.
    pub value: Value,
    /// What was found in the data.
    pub because: String,
    /// What has to stay so, for it to be right of more than these frames.
    pub holds_while: String,
}

impl Change {
    pub(super) fn new(setting: &str, value: Value, because: impl Into<String>, holds_while: &str) -> Self {
        let (because, holds_while) = (because.into(), holds_while.to_owned());
        Self { setting: setting.to_owned(), value, because, holds_while }
    }

    pub(super) fn off(feature: &str, because: impl Into<String>, holds_while: &str) -> Self {
        Self::new(&format!("features.{feature}"), Value::Bool(false), because, holds_while)
    }
}

impl fmt::Display for Change {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} = {}", self.setting, self.value)
    }
}

/// Settings with changes.
///
/// # Errors
///
/// When a change names no setting, or the settings are refused.
pub fn apply<'c>(settings: &Settings, changes: impl IntoIterator<Item = &'c Change>) -> Result<Settings> {
    let mut json = serde_json::to_value(settings)?;
    for change in changes {
        let pointer = format!("/{}", change.setting.replace('.', "/"));
        let slot = json.pointer_mut(&pointer).with_context(|| format!("there is no setting `{}`", change.setting))?;
        *slot = change.value.clone();
    }
    let settings: Settings = serde_json::from_value(json)?;
    settings.validate()?;
    Ok(settings)
}

/// A setting with the value as short as it can be written.
pub(super) fn number(value: f32) -> Value {
    value.to_string().parse::<f64>().map_or(Value::Null, |value| json!(value))
}

/// Entries of `settings` that differ from those of `default`.
fn difference(default: &Value, settings: &Value) -> Option<Value> {
    match (default, settings) {
        (Value::Object(default), Value::Object(settings)) => {
            let differs = |(key, value): (&String, &Value)| {
                let base = default.get(key).unwrap_or(&Value::Null);
                difference(base, value).map(|change| (key.clone(), change))
            };
            let all: Map<String, Value> = settings.iter().filter_map(differs).collect();
            (!all.is_empty()).then_some(Value::Object(all))
        }
        (default, settings) => (default != settings).then(|| shortened(settings)),
    }
}

/// Numbers as short as single precision lets them be.
fn shortened(value: &Value) -> Value {
    match value {
        Value::Array(items) => Value::Array(items.iter().map(shortened).collect()),
        Value::Object(items) => Value::Object(items.iter().map(|(key, item)| (key.clone(), shortened(item))).collect()),
        Value::Number(n) if n.is_f64() => n.as_f64().map_or(Value::Null, |n| number(n as f32)),
        other => other.clone(),
    }
}

/// What differs from the default preset, as TOML that `--settings` reads; empty where nothing does.
///
/// # Errors
///
/// When settings cannot be written, which those that validate can.
pub fn toml_of(settings: &Settings) -> Result<String> {
    let default = serde_json::to_value(Settings::default())?;
    match difference(&default, &serde_json::to_value(settings)?) {
        Some(changes) => Ok(toml::to_string(&changes)?),
        None => Ok(String::new()),
    }
}

/// Share of surfaces that may be an exception to what a feature is left out for.
const FEW: f64 = 1e-3;
/// Share of cells that chance makes look as if their light changed.
const CHANCE: f64 = 0.02;
/// Frames that have to continue another to say that something never happens.
const ENOUGH_FRAMES: usize = 4;

/// What the sequence does not use of `settings`.
pub(super) fn smallest(content: &Content, needs: &Needs, settings: &Settings) -> Vec<Change> {
    let [smoothest, roughest] = needs.roughness;
    if smoothest > roughest {
        return Vec::new();
    }
    let mut changes = coverage(content, needs, settings);
    changes.extend(match settings.pipeline {
        Pipeline::Footprint => footprint(needs, settings),
        _ => published(needs, settings),
    });
    let json = serde_json::to_value(settings).unwrap_or_default();
    changes.retain(|change| json.pointer(&format!("/{}", change.setting.replace('.', "/"))) != Some(&change.value));
    changes
}

fn coverage(content: &Content, needs: &Needs, settings: &Settings) -> Vec<Change> {
    let mut changes = Vec::new();
    if let Some(threshold) = needs.traced_up_to {
        let because = format!("nothing rougher than {threshold:.3} is traced");
        changes.push(Change::new("coverage.roughness_threshold", number(threshold), because, "no ray is traced there"));
    }
    if content.roughness_is_constant && needs.traced_up_to.is_none() {
        let because = format!("all surfaces have roughness {}", needs.roughness[0]);
        let value = number(needs.roughness[0]);
        changes.push(Change::new("features.constant_roughness", value, because, "no other material is added"));
    }
    let uses_mirrors = settings.pipeline == Pipeline::Published || settings.coverage.ray_list.is_some();
    let mirrors = needs.mirrors_up_to.filter(|mirrors| uses_mirrors && *mirrors > settings.coverage.mirror_roughness);
    if let Some(mirrors) = mirrors.filter(|_| needs.camera_rests && needs.continued >= ENOUGH_FRAMES) {
        let because = format!("rays up to roughness {mirrors:.3} hit the same in every frame");
        let holds_while = "they are traced as perfect mirrors";
        changes.push(Change::new("coverage.mirror_roughness", number(mirrors), because, holds_while));
    }
    changes
}

/// Whether nothing that is seen, directly or reflected, changes.
fn all_rests(needs: &Needs) -> bool {
    let is_calm = needs.light_changes <= CHANCE && needs.reflections_change <= FEW;
    needs.continued >= ENOUGH_FRAMES && needs.camera_rests && needs.moving <= FEW && is_calm
}

/// Whether the input holds no noise, as far as it can be told.
fn is_clean(needs: &Needs) -> bool {
    needs.continued >= ENOUGH_FRAMES && needs.camera_rests && needs.noisy.is_some_and(|noisy| noisy <= FEW)
}

const CAMERA_RESTS: &str = "camera and lens stay as they are";

fn footprint(needs: &Needs, settings: &Settings) -> Vec<Change> {
    let [smoothest, roughest] = needs.roughness;
    let clip_roughness = settings.accumulate.clip_roughness;
    let mut changes = Vec::new();
    if is_clean(needs) {
        let because =
            format!("only {} of pixels at rest change: there is no noise", percent(needs.noisy.unwrap_or(0.0)));
        changes.push(Change::off("spatial_filter", because, "rays hold no noise"));
    } else if needs.narrow <= FEW {
        let because = format!("filters of {} of surfaces are wider than 3 pixels", percent(1.0 - needs.narrow));
        changes.push(Change::new("features.near_taps", json!(0), because, "no smoother material is added"));
    }
    if roughest <= LIGHT_ROUGHNESS {
        let because = format!("the roughest surface has {roughest:.3}; it acts above {LIGHT_ROUGHNESS}");
        changes.push(Change::off("light_change", because, "no rougher material is added"));
    } else if needs.continued >= ENOUGH_FRAMES && needs.light_changes <= CHANCE {
        let because = format!("light changes in {} of a frame at most", percent(needs.light_changes));
        changes.push(Change::off("light_change", because, "lamps stay as bright as they are"));
    }
    let whole_roughness = clip_roughness.max(WHOLE_ROUGHNESS);
    if roughest < whole_roughness {
        let because = format!("the roughest surface has {roughest:.3}; it acts from {whole_roughness} on");
        changes.push(Change::off("whole_blocks", because, "no rougher material is added"));
    }
    if roughest < OUTLIER_ROUGHNESS {
        let because = format!("the roughest surface has {roughest:.3}; it acts from {OUTLIER_ROUGHNESS} on");
        changes.push(Change::off("outlier_spread", because, "no rougher material is added"));
    } else if needs.outliers <= 1e-5 {
        let because = format!("no sample is {} times as bright as all around", settings.accumulate.outlier_factor);
        changes.push(Change::off("outlier_spread", because, "no smaller or brighter lamp is added"));
    }
    if smoothest >= clip_roughness {
        let because = format!("the smoothest surface has {smoothest:.3}; it acts below {clip_roughness}");
        changes.push(Change::off("history_clip", because, "no smoother material is added"));
    } else if all_rests(needs) {
        changes.push(Change::off("history_clip", "nothing moves and no reflection changes", "all of that stays so"));
    }
    let reflects_motion = needs.moving_hits > FEW;
    if reflects_motion {
        let because = format!("{} of surfaces reflect things that move", percent(needs.moving_hits));
        changes.push(Change::new("features.hit_motion", json!(true), because, "hit motion is supplied"));
    } else {
        changes.push(Change::off("hit_motion", "no hit motion says that reflected things move", "none does"));
    }
    // Where reflected things move they are not seen where they were.
    changes.extend(motion(needs).filter(|change| !(reflects_motion && change.setting == "features.mirror_parallax")));
    changes
}

/// One of the two ways to find history, where both lead to the same place.
fn motion(needs: &Needs) -> Option<Change> {
    let [smoothest, roughest] = needs.roughness;
    if needs.continued < ENOUGH_FRAMES {
        return None;
    }
    if needs.camera_rests && needs.moving <= 0.0 && roughest < REFLECTION_UP_TO {
        let because = "neither camera nor surfaces move: motion vectors say nothing";
        return Some(Change::off("surface_motion", because, "camera and surfaces stay where they are"));
    }
    if needs.camera_rests {
        let because = "the camera rests: reflected points are seen where they were";
        return Some(Change::off("mirror_parallax", because, CAMERA_RESTS));
    }
    (smoothest >= REFLECTION_UP_TO).then(|| {
        let because = format!("the smoothest surface has {smoothest:.3}: reflections move with their surface");
        Change::off("mirror_parallax", because, "no smoother material is added")
    })
}

fn published(needs: &Needs, settings: &Settings) -> Vec<Change> {
    let mut changes = Vec::new();
    let mirrors = settings.coverage.mirror_roughness.max(needs.mirrors_up_to.unwrap_or(0.0));
    if is_clean(needs) || needs.roughness[1] <= mirrors {
        changes.push(Change::off("spatial_filter", "there is no noise of the lobe to filter", "rays hold none"));
    }
    if needs.continued >= ENOUGH_FRAMES && needs.camera_rests {
        if needs.moving <= 0.0 {
            let because = "nothing moves: history is always where the first guess is";
            changes.push(Change::off("history_search", because, CAMERA_RESTS));
            changes.push(Change::off("edge_repair", because, CAMERA_RESTS));
        }
        let because = "the camera rests: reflected points are seen where they were";
        changes.push(Change::off("mirror_parallax", because, CAMERA_RESTS));
    }
    changes
}

/// What else could be left out of settings: whether a sequence misses it can only be measured. Of several values of one
/// setting the leanest comes first.
pub fn untried(settings: &Settings, recommended: &[Change]) -> Vec<Change> {
    const FEATURES: [&str; 11] = [
        "both_histories",
        "block_interpolation",
        "spatial_filter",
        "wide_filter",
        "outlier_spread",
        "history_clip",
        "light_change",
        "history_search",
        "edge_repair",
        "mirror_parallax",
        "surface_motion",
    ];
    const NEAR_TAPS: [u32; 5] = [0, 2, 4, 6, 8];
    const WIDE_TAPS: [u32; 2] = [1, 2];
    let (because, holds_while) = ("its loss stays within the bound", "scenes are like these frames");
    // The motion of what was hit is of use only where it is reflected.
    let is_reflected = recommended.iter().any(|change| change.setting == "features.hit_motion" && change.value == true);
    let features = FEATURES.iter().filter(|feature| !(is_reflected && **feature == "mirror_parallax"));
    let off = features.map(|feature| Change::off(feature, because, holds_while));
    let fewer = |path, choices: &[u32], now| {
        let fewer = choices.iter().filter(move |taps| **taps < now).map(|taps| json!(taps)).collect::<Vec<_>>();
        fewer.into_iter().map(move |taps| Change::new(path, taps, because, holds_while))
    };
    let taps = fewer("features.near_taps", &NEAR_TAPS, settings.features.near_taps).chain(fewer(
        "features.wide_taps",
        &WIDE_TAPS,
        settings.features.wide_taps,
    ));
    let cost = |settings: &Settings| Plan::new(settings, UVec2::splat(8)).ok().map(|(plan, _)| plan);
    let (base, given) = (apply(settings, recommended).ok(), cost(settings));
    let changes_plan = |change: &Change| {
        let alone = apply(settings, [change]).ok().and_then(|settings| cost(&settings));
        let with = base.as_ref().and_then(|base| apply(base, [change]).ok()).and_then(|settings| cost(&settings));
        alone.is_some() && alone != given && with.is_some() && with != base.as_ref().and_then(cost)
    };
    taps.chain(off).filter(changes_plan).collect()
}

/// What settings cost by the plan, at 1920x1080.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cost {
    /// Bytes a pixel that limpid allocates, each resource on its own.
    pub bytes: f64,
    /// The same where resources share memory.
    pub shared_bytes: f64,
    /// Bytes a pixel that passes read and write.
    pub moved_bytes: f64,
    /// Dispatches.
    pub passes: usize,
    /// Resources bound, over all passes.
    pub bindings: usize,
    /// Images that the caller supplies.
    pub inputs: usize,
    /// SPIR-V instructions of all kernels.
    pub instructions: u64,
}

impl Cost {
    /// Costs of settings.
    ///
    /// # Errors
    ///
    /// As [`Plan::new`].
    pub fn new(settings: &Settings) -> Result<Self> {
        let size = UVec2::new(1920, 1080);
        let (plan, _) = Plan::new(settings, size)?;
        let counts = Counts::new(settings, size)?;
        Ok(Self {
            bytes: counts.bytes_allocated,
            shared_bytes: counts.bytes_shared,
            moved_bytes: counts.bytes_read + counts.bytes_written,
            passes: counts.dispatches,
            bindings: plan.passes.iter().map(|pass| pass.bindings.len()).sum(),
            inputs: plan.inputs().count(),
            instructions: counts.instructions.values().sum(),
        })
    }

    fn rows(&self) -> [(&'static str, f64); 7] {
        [
            ("bytes a pixel", self.bytes),
            ("the same, sharing memory", self.shared_bytes),
            ("bytes read and written", self.moved_bytes),
            ("passes", self.passes as f64),
            ("bindings", self.bindings as f64),
            ("images to supply", self.inputs as f64),
            ("SPIR-V instructions", self.instructions as f64),
        ]
    }
}

/// Given and recommended, side by side.
pub(super) fn cost_table(given: &Cost, recommended: &Cost) -> String {
    let mut text = format!("    {:<26}{:>10}{:>14}{:>9}\n", "predicted, at 1920x1080", "given", "recommended", "saved");
    for ((name, before), (_, after)) in given.rows().into_iter().zip(recommended.rows()) {
        let digits = if before.fract() == 0.0 && after.fract() == 0.0 { 0 } else { 1 };
        let saved = percent(1.0 - after / before);
        text += &format!("    {name:<26}{before:>10.digits$}{after:>14.digits$}{saved:>9}\n");
    }
    text
}
