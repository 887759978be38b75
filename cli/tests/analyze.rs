//! `limpid analyze` on copies of sequences that are broken on purpose: each has to be named, with the right remedy.
//!
//! Built-in scenes always; with `LIMPID_PEER_DATA` also the sequences in its folder `public`. With `--nocapture` it
//! prints the table of `docs/analyze.md`.

use std::io::Write;
use std::path::Path;

use glam::{Mat4, UVec2, Vec2, Vec3};
use limpid::Settings;
use limpid_cli::analyze::{Analysis, Analyzer, Severity};
use limpid_cli::scene;
use limpid_cli::sequence::{ChannelNames, Frame, Sequence};

/// A way to break a sequence, part of the message that names it, and the setting that mends it, if one does.
struct Break {
    name: &'static str,
    apply: fn(&mut Vec<Frame>),
    message: &'static str,
    setting: Option<&'static str>,
    /// Whether a camera at rest tells nothing of it.
    needs_motion: bool,
}

fn each(frames: &mut [Frame], change: impl Fn(&mut Frame)) {
    frames.iter_mut().for_each(change);
}

fn scale_motion(frames: &mut [Frame], scale: impl Fn(UVec2) -> Vec2) {
    for frame in frames {
        let scale = scale(frame.size);
        frame.motion.iter_mut().for_each(|motion| *motion = (Vec2::from(*motion) * scale).to_array());
    }
}

fn change_normals(frames: &mut [Frame], change: impl Fn(&Frame, Vec3) -> Vec3) {
    for frame in frames {
        let normals = frame.normal.iter().map(|normal| change(frame, Vec3::from(*normal)).to_array()).collect();
        frame.normal = normals;
    }
}

fn change_depth(frames: &mut [Frame], change: impl Fn(&Frame, UVec2, f32) -> f32) {
    for frame in frames {
        let place = |i: usize| UVec2::new(i as u32 % frame.size.x, i as u32 / frame.size.x);
        let depth = frame.depth.iter().enumerate();
        let depth = depth.map(|(i, z)| if *z > 0.0 { change(frame, place(i), *z) } else { 0.0 }).collect();
        frame.depth = depth;
    }
}

/// Depth buffer of a distance along the view axis.
fn device_depth(frame: &Frame, distance: f32) -> f32 {
    let clip = frame.camera.view_to_clip * Vec3::new(0.0, 0.0, -distance).extend(1.0);
    clip.z / clip.w
}

/// Distance along the ray of a distance along the view axis.
fn ray_distance(frame: &Frame, pixel: UVec2, distance: f32) -> f32 {
    let ndc = (pixel.as_vec2() + 0.5) / frame.size.as_vec2() * 2.0 - 1.0;
    let ray = frame.camera.view_to_clip.inverse().project_point3(Vec3::new(ndc.x, -ndc.y, 0.5));
    distance * ray.length() / ray.z.abs()
}

/// Gives each frame the camera of another.
fn shift_cameras(frames: &mut [Frame], by: isize) {
    let cameras: Vec<_> = frames.iter().map(|frame| frame.camera).collect();
    for (index, frame) in frames.iter_mut().enumerate() {
        frame.camera = cameras[index.saturating_add_signed(by).min(cameras.len() - 1)];
    }
}

const fn broken(name: &'static str, message: &'static str, apply: fn(&mut Vec<Frame>)) -> Break {
    Break { name, apply, message, setting: None, needs_motion: false }
}

const fn mended(name: &'static str, message: &'static str, setting: &'static str, apply: fn(&mut Vec<Frame>)) -> Break {
    Break { name, apply, message, setting: Some(setting), needs_motion: false }
}

const fn moving(of: Break) -> Break {
    Break { needs_motion: true, ..of }
}

const BREAKS: &[Break] = &[
    moving(mended("motion vectors reversed", "they point the other way", "motion_scale = [-1", |frames| {
        scale_motion(frames, |_| Vec2::NEG_ONE);
    })),
    moving(mended("motion vectors with y up", "one axis points the other way", "motion_scale = [1", |frames| {
        scale_motion(frames, |_| Vec2::new(1.0, -1.0));
    })),
    moving(mended(
        "motion vectors in normalised device coordinates",
        "normalised device",
        "motion_scale = [0.5",
        |frames| {
            scale_motion(frames, |_| Vec2::new(2.0, -2.0));
        },
    )),
    moving(mended("motion vectors in pixels", "they look like pixels", "motion_scale = [0.0", |frames| {
        scale_motion(frames, |size| size.as_vec2());
    })),
    broken("depth buffer for distances", "a depth buffer, not a distance", |frames| {
        change_depth(frames, |frame, _, z| device_depth(frame, z));
    }),
    broken("reversed depth buffer", "a reversed depth buffer", |frames| {
        change_depth(frames, |frame, _, z| 1.0 - device_depth(frame, z));
    }),
    broken("distance along the ray", "distance along the ray", |frames| {
        change_depth(frames, ray_distance);
    }),
    mended("normals times 0.5 plus 0.5", "normals times 0.5 plus 0.5", "normal = \"unsigned\"", |frames| {
        change_normals(frames, |_, n| n * 0.5 + 0.5);
    }),
    broken("normals in view space", "look like view-space normals", |frames| {
        change_normals(frames, |frame, n| frame.camera.world_to_view.transform_vector3(n));
    }),
    broken("normals into the surface", "normals that point into the surface", |frames| {
        change_normals(frames, |_, n| -n);
    }),
    broken("normals of length 3", "normals are not of unit length", |frames| change_normals(frames, |_, n| n * 3.0)),
    moving(broken("view matrices inverted", "look like view to world", |frames| {
        each(frames, |frame| frame.camera.world_to_view = frame.camera.world_to_view.inverse());
    })),
    broken("matrices by columns", "the view matrices are transposed", |frames| {
        each(frames, |frame| {
            frame.camera.world_to_view = frame.camera.world_to_view.transpose();
            frame.camera.view_to_clip = frame.camera.view_to_clip.transpose();
        });
    }),
    mended("projection with y down", "clip space had y the other way", "ndc_y = \"down\"", |frames| {
        let flip = Mat4::from_scale(Vec3::new(1.0, -1.0, 1.0));
        each(frames, |frame| frame.camera.view_to_clip = flip * frame.camera.view_to_clip);
    }),
    moving(broken("matrices a frame late", "look like those of the frame before", |frames| shift_cameras(frames, -1))),
    moving(broken("matrices a frame early", "look like those of the frame after", |frames| shift_cameras(frames, 1))),
    moving(broken("a cut that is not marked", "continues nothing", |frames| {
        // From the middle on, the same is seen in another place of the world.
        let middle = frames.len() / 2;
        let moved = Mat4::from_translation(Vec3::new(40.0, 0.0, 0.0));
        each(&mut frames[middle..], |frame| frame.camera.world_to_view *= moved);
    })),
    broken("NaN in 1 % of radiance", "values are NaN or infinite", |frames| {
        each(frames, |frame| frame.radiance.iter_mut().step_by(100).for_each(|texel| texel[0] = f32::NAN));
    }),
    broken("no hit distances", "surfaces have no hit distance", |frames| {
        each(frames, |frame| frame.radiance.iter_mut().for_each(|texel| texel[3] = 0.0));
    }),
    broken("hit distances over 100", "a quarter of all hit distances are below", |frames| {
        each(frames, |frame| frame.radiance.iter_mut().for_each(|texel| texel[3] *= 0.01));
    }),
    broken("roughness in percent", "is not within 0 and 1", |frames| {
        each(frames, |frame| frame.roughness.iter_mut().for_each(|roughness| *roughness *= 100.0));
    }),
];

fn analyze(frames: &[Frame], settings: &Settings) -> Analysis {
    let mut analyzer = Analyzer::new(frames[0].size, settings, 1.0);
    frames.iter().for_each(|frame| analyzer.add(frame.clone()));
    analyzer.finish().unwrap()
}

/// What is wrong with the analysis of a broken copy, if anything; `row` is its line in the table.
fn complaint(broken: &Break, intact: &[Frame], row: &mut String) -> Option<String> {
    let mut frames = intact.to_vec();
    (broken.apply)(&mut frames);
    let analysis = analyze(&frames, &Settings::default());
    let wrong = |what: &str, analysis: &Analysis| Some(format!("{}: {what}\n{analysis}", broken.name));
    let Some(finding) = analysis.findings.iter().find(|finding| finding.found.contains(broken.message)) else {
        return wrong("not named", &analysis);
    };
    *row = format!("| {} | {}: {} |", broken.name, finding.found, finding.advice);
    if analysis.findings[0].severity != finding.severity {
        return wrong("something else is called worse", &analysis);
    }
    let setting = broken.setting?;
    if !analysis.settings.contains(setting) {
        return wrong("no such remedy", &analysis);
    }
    let mended = analyze(&frames, &toml::from_str(&analysis.settings).unwrap());
    let is_mended = mended.findings.iter().all(|finding| finding.severity == Severity::Note);
    if is_mended { None } else { wrong("the remedy does not mend it", &mended) }
}

fn check(name: &str, intact: &[Frame], camera_moves: bool) {
    let analysis = analyze(intact, &Settings::default());
    assert!(!analysis.has_errors(), "{name}\n{analysis}");
    let mut table = format!("\n| {name} with | what analyze says |\n|---|---|\n");
    let mut complaints = Vec::new();
    for broken in BREAKS.iter().filter(|broken| camera_moves || !broken.needs_motion) {
        let mut row = String::new();
        complaints.extend(complaint(broken, intact, &mut row));
        table = table + &row + "\n";
    }
    println!("{table}");
    assert!(complaints.is_empty(), "{name}: {}", complaints.join("\n"));
}

#[test]
fn what_is_broken_is_named_with_its_remedy() {
    let scene = scene::by_name("courtyard@24").unwrap();
    let frames: Vec<Frame> = (0..6).map(|number| scene.render(number, UVec2::new(192, 108), 0)).collect();
    check("courtyard", &frames, true);
}

#[test]
fn what_is_broken_in_public_sequences_is_named() {
    let Some(data) = std::env::var_os("LIMPID_PEER_DATA") else {
        // Past the harness, which keeps to itself what a passing test prints.
        let _ = writeln!(std::io::stderr(), "SKIPPED: LIMPID_PEER_DATA names no folder with sequences");
        return;
    };
    for (name, camera_moves) in [("orbit", true), ("glossy-room", false)] {
        let path = Path::new(&data).join("public").join(name);
        let sequence = Sequence::open(&path, &ChannelNames::default()).unwrap();
        let frames: Vec<Frame> = (0..8).map(|index| sequence.load(index).unwrap()).collect();
        check(name, &frames, camera_moves);
    }
}
