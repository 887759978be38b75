//! Debug views: what they show, and in which colours.

use serde::{Deserialize, Serialize};

/// What the texture `debug_view` shows of each pixel, as linear colours from 0 to 1. `docs/debug-views.md` says how to
/// read each.
///
/// Grey pixels are left out: sky, or too rough. Magenta ones hold no usable number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[repr(u8)]
#[non_exhaustive]
pub enum DebugView {
    /// Frames that the history holds, red where it begins anew.
    HistoryLength,
    /// How much limpid takes the brightness for noise: its deviation over time.
    Variance,
    /// Hit distance in the input, as a share of the way from the camera over the surface to what the ray hit.
    HitDistance,
    /// The averages that filters and history are measured with: of 8x8 pixels in the published pipeline, else of 4x4.
    Average,
    /// How far motion vectors are from what the camera's motion alone would give. Black where nothing but the camera
    /// moves and they are right.
    MotionError,
    /// Which 8x8 tiles are denoised, and whether they hold mirrors (up to `coverage.mirror_roughness`), rougher
    /// surfaces, or both. With [`whole_blocks`](crate::settings::Features::whole_blocks) also which 4x4 pixels are worked on
    /// as a whole.
    TileClasses,
    /// Where there is no history, and why.
    Disocclusion,
    /// Whose motion leads to the history: that of the surface, or that of what it reflects.
    Candidate,
}

/// A colour and what it stands for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Key {
    /// Linear colour, 0 to 1.
    pub color: [f32; 3],
    /// What it stands for.
    pub label: &'static str,
}

/// What the colours of a view stand for. Pixels have a colour of `keys` or one between two neighbours of `ramp`; those
/// of [`DebugView::Average`] may have any.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Legend {
    /// What the view shows and in which unit.
    pub title: &'static str,
    /// Colours at equal steps, with everything between two being mixed from them. Empty where there is none.
    pub ramp: &'static [Key],
    /// Colours that stand for themselves.
    pub keys: &'static [Key],
}

const LEFT_OUT: [f32; 3] = [0.05, 0.05, 0.05];
const FINE: [f32; 3] = [0.0, 0.0, 0.0];
const RED: [f32; 3] = [0.85, 0.03, 0.03];
const GREEN: [f32; 3] = [0.05, 0.6, 0.1];
const BLUE: [f32; 3] = [0.05, 0.2, 0.9];
const YELLOW: [f32; 3] = [0.9, 0.6, 0.02];
const PALE: [f32; 3] = [0.9, 0.8, 0.5];
const MAGENTA: [f32; 3] = [1.0, 0.0, 1.0];

const fn key(color: [f32; 3], label: &'static str) -> Key {
    Key { color, label }
}

/// The ramp of `kernels/shared/debug_view.wgsl`.
const fn ramp(labels: [&'static str; 5]) -> [Key; 5] {
    [
        key([0.01, 0.01, 0.1], labels[0]),
        key([0.03, 0.09, 0.5], labels[1]),
        key([0.0, 0.35, 0.4], labels[2]),
        key([0.3, 0.7, 0.1], labels[3]),
        key([1.0, 0.9, 0.4], labels[4]),
    ]
}

const GREY: Key = key(LEFT_OUT, "left out");

impl DebugView {
    /// All views, with the names that settings and the command line use.
    pub const ALL: &[(&str, DebugView)] = &[
        ("history-length", DebugView::HistoryLength),
        ("variance", DebugView::Variance),
        ("hit-distance", DebugView::HitDistance),
        ("average", DebugView::Average),
        ("motion-error", DebugView::MotionError),
        ("tile-classes", DebugView::TileClasses),
        ("disocclusion", DebugView::Disocclusion),
        ("candidate", DebugView::Candidate),
    ];

    /// What its colours stand for.
    pub fn legend(self) -> Legend {
        match self {
            Self::HistoryLength => Legend {
                title: "history length, frames",
                ramp: const { &ramp(["2", "4", "8", "16", "32"]) },
                keys: const { &[key(RED, "begins anew"), GREY] },
            },
            Self::Variance => Legend {
                title: "deviation of brightness over time",
                ramp: const { &ramp(["1/256", "1/64", "1/16", "1/4", "1"]) },
                keys: const { &[key(RED, "not known yet"), GREY] },
            },
            Self::HitDistance => Legend {
                title: "hit distance over the surface's depth",
                ramp: const { &ramp(["0", "1/3", "1", "3", "far"]) },
                keys: const { &[key(MAGENTA, "0, negative or no number"), GREY] },
            },
            Self::Average => Legend {
                title: "average radiance, x / (1 + x)",
                ramp: &[],
                keys: const { &[key(MAGENTA, "no number"), GREY] },
            },
            Self::MotionError => Legend {
                title: "motion against a static scene, pixels",
                ramp: const { &ramp(["1/8", "1/2", "2", "8", "32"]) },
                keys: const {
                    &[
                        key(FINE, "as in a static scene"),
                        key(MAGENTA, "no number"),
                        key(LEFT_OUT, "no surface or no last frame"),
                    ]
                },
            },
            Self::TileClasses => Legend {
                title: "8x8 tiles",
                ramp: &[],
                keys: const {
                    &[
                        key(BLUE, "mirrors"),
                        key(YELLOW, "rougher surfaces"),
                        key(GREEN, "both"),
                        key(PALE, "4x4 pixels as a whole"),
                        key(LEFT_OUT, "nothing to denoise"),
                    ]
                },
            },
            Self::Disocclusion => Legend {
                title: "disocclusion",
                ramp: &[],
                keys: const {
                    &[
                        key(FINE, "has history"),
                        key(RED, "something else was there"),
                        key(BLUE, "outside, or no last frame"),
                        GREY,
                    ]
                },
            },
            Self::Candidate => Legend {
                title: "history by the motion of",
                ramp: const { &[key(GREEN, "surface"), key(BLUE, "reflection")] },
                keys: const { &[key(YELLOW, "by search or at an edge (preset reference)"), key(RED, "none found"), GREY] },
            },
        }
    }
}
