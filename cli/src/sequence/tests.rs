//! Sequences written and read back, and as other programs write them.

mod damage;

use std::fs;
use std::path::{Path, PathBuf};

use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Blocks, Compression, Encoding, FlatSamples, Image, ImageAttributes, Layer,
    LayerAttributes, LineOrder, Text, Vec2 as Size, WritableImage,
};
use glam::{Mat4, UVec2, Vec2, Vec3};
use limpid::Camera;

use super::*;

/// A folder that is removed with the value.
struct Folder(PathBuf);

impl Folder {
    fn new(test: &str) -> Self {
        let path = std::env::temp_dir().join(format!("limpid-{}-{test}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

const SIZE: UVec2 = UVec2::new(19, 35);

/// Perspective, near plane 0.1, far plane 500.
const PROJECTION: Mat4 = Mat4::from_cols_array_2d(&[
    [1.36, 0.0, 0.0, 0.0],
    [0.0, 2.41, 0.0, 0.0],
    [0.0, 0.0, -1.0002, -1.0],
    [0.0, 0.0, -0.10002, 0.0],
]);

/// A frame whose values half floats can hold.
fn frame(number: u32) -> Frame {
    let pixels = (SIZE.x * SIZE.y) as usize;
    let value = |i: usize, c: usize| ((i * 7 + c * 3 + number as usize) % 1000) as f32 / 8.0;
    let eye = Vec3::new(number as f32 * 0.3, 1.1, 4.7);
    Frame {
        number,
        size: SIZE,
        reset: number.is_multiple_of(4),
        seconds: 0.125 * (1 + number) as f32,
        camera: Camera {
            world_to_view: Mat4::from_rotation_y(0.7) * Mat4::from_translation(-eye),
            view_to_clip: PROJECTION,
            jitter: Vec2::new(0.125, -0.3),
        },
        radiance: (0..pixels).map(|i| [0, 1, 2, 3].map(|c| value(i, c))).collect(),
        normal: (0..pixels).map(|i| [0, 1, 2].map(|c| value(i, c) / 128.0)).collect(),
        roughness: (0..pixels).map(|i| value(i, 1) / 128.0).collect(),
        depth: (0..pixels).map(|i| value(i, 4) / 0.3).collect(),
        motion: (0..pixels).map(|i| [0, 1].map(|c| value(i, c) / -700.0)).collect(),
        hit_motion: number
            .is_multiple_of(3)
            .then(|| (0..pixels).map(|i| [7, 2, 4].map(|c| value(i, c) / -64.0)).collect()),
        reference: (number > 0).then(|| (0..pixels).map(|i| [0, 1, 2].map(|c| value(i, c + 5))).collect()),
    }
}

fn open(dir: &Path) -> Result<Sequence, SequenceError> {
    Sequence::open(dir, &ChannelNames::default())
}

#[test]
fn a_written_sequence_reads_back_equal() {
    let folder = Folder::new("round-trip");
    let frames = [frame(0), frame(3), frame(4)];
    write_sequence(&folder.0, "demo", 0.35, &frames).unwrap();
    let sequence = open(&folder.0).unwrap();
    assert_eq!((sequence.name().as_str(), sequence.size()), ("demo", SIZE));
    assert_eq!((sequence.exposure(), sequence.len()), (0.35, 3));
    for (i, frame) in frames.iter().enumerate() {
        let read = sequence.load(i).unwrap();
        assert_eq!(&read, frame);
        assert!(read.warnings().is_empty());
    }
    let (size, rgb) = read_rgb(&sequence.path(1).unwrap()).unwrap();
    assert_eq!(size, SIZE);
    assert!(rgb.iter().zip(&frames[1].radiance).all(|(rgb, a)| rgb[..] == a[..3]));
    assert_eq!(fs::read_dir(&folder.0).unwrap().count(), 4, "no temporary file stays");
    assert!(matches!(sequence.load(3), Err(SequenceError::NoSuchFrame { index: 3, len: 3, .. })));
}

#[test]
fn an_output_keeps_the_attributes_of_its_input() {
    let folder = Folder::new("attributes");
    let input = folder.0.join("in.exr");
    let samples = FlatSamples::F32(vec![1.0; 12]);
    let mut image = Image::from_channels((4, 3), AnyChannels::sort(vec![AnyChannel::new("R", samples)].into()));
    image.layer_data.attributes.owner = Some(Text::from("Ada"));
    image.layer_data.attributes.layer_position = Size(-5, 2);
    let shutter = AttributeValue::F32(0.5);
    image.layer_data.attributes.other.insert(Text::from("shutter"), shutter.clone());
    image.write().to_file(&input).unwrap();

    let output = folder.0.join("out.exr");
    let metadata = Metadata::read(&input).unwrap();
    write_exr(&output, UVec2::new(4, 3), &[[1e6, f32::NAN, -1.5]; 12], &metadata).unwrap();
    let meta = exr::meta::MetaData::read_from_file(&output, true).unwrap();
    let attributes = &meta.headers[0].own_attributes;
    assert_eq!(attributes.owner, Some(Text::from("Ada")));
    assert_eq!(attributes.layer_position, Size(-5, 2));
    assert_eq!(attributes.other.get(&Text::from("shutter")), Some(&shutter));
    assert_eq!(meta.headers[0].compression, Compression::ZIP16);
    let (_, rgb) = read_rgb(&output).unwrap();
    assert!(rgb.iter().all(|p| p[0] == 65504.0 && p[1].is_nan() && p[2] == -1.5));

    let error = write_exr(&output, UVec2::new(4, 4), &[[0.0; 3]; 12], &metadata).unwrap_err();
    assert!(error.to_string().contains("expected 16 pixels, found 12"), "{error}");
}

/// The images of `frame` as Blender's passes: each with its name and channels.
fn blender_passes(frame: &Frame) -> Vec<(&'static str, Vec<AnyChannel<FlatSamples>>)> {
    fn channels<const N: usize>(names: [&str; N], image: &[[f32; N]]) -> Vec<AnyChannel<FlatSamples>> {
        let plane = |c: usize| FlatSamples::F32(image.iter().map(|pixel| pixel[c]).collect());
        (0..N).map(|c| AnyChannel::new(names[c], plane(c))).collect()
    }
    let depth: Vec<[f32; 1]> = frame.depth.iter().map(|&z| [z]).collect();
    let ids = FlatSamples::U32((0..frame.pixels() as u32).collect());
    vec![
        ("ViewLayer.Combined", channels(["R", "G", "B", "A"], &frame.radiance)),
        ("ViewLayer.Depth", channels(["Z"], &depth)),
        ("ViewLayer.Id", vec![AnyChannel::new("V", ids)]),
        ("ViewLayer.Normal", channels(["X", "Y", "Z"], &frame.normal)),
        ("ViewLayer.Vector", channels(["X", "Y"], &frame.motion)),
    ]
}

#[test]
fn files_as_blender_writes_them_are_read() {
    let folder = Folder::new("blender");
    let mut frame = Frame { hit_motion: None, ..frame(0) };
    write_sequence(&folder.0, "blender", 1.0, [&frame]).unwrap();
    // Channels stored as whole numbers.
    frame.roughness = (0..frame.pixels()).map(|i| i as f32).collect();
    let names = ChannelNames::parse([
        "radiance=ViewLayer.Combined",
        "hit_distance=ViewLayer.Combined.A",
        "normal=ViewLayer.Normal",
        "roughness=ViewLayer.Id.V",
        "depth=ViewLayer.Depth.Z",
        "motion=ViewLayer.Vector.X,ViewLayer.Vector.Y",
    ])
    .unwrap();
    let sequence = Sequence::open(&folder.0, &names).unwrap();
    let path = sequence.path(0).unwrap();

    use Compression::{PIZ, RLE, Uncompressed, ZIP1, ZIP16};
    for (i, compression) in [Uncompressed, RLE, ZIP1, ZIP16, PIZ].into_iter().enumerate() {
        let encoding = Encoding {
            compression,
            blocks: if i % 2 == 0 { Blocks::ScanLines } else { Blocks::Tiles(Size(16, 8)) },
            line_order: LineOrder::Increasing,
        };
        let full_names = |(pass, mut channels): (&str, Vec<AnyChannel<FlatSamples>>)| {
            for channel in &mut channels {
                channel.name = Text::from(format!("{pass}.{}", channel.name).as_str());
            }
            channels
        };
        let channels = blender_passes(&frame).into_iter().flat_map(full_names).collect();
        Image::from_encoded_channels((19, 35), encoding, AnyChannels::sort(channels)).write().to_file(&path).unwrap();
        assert_eq!(sequence.load(0).unwrap(), frame, "{compression}");
    }

    // One part for each pass.
    let part = |(pass, channels): (&str, Vec<AnyChannel<FlatSamples>>)| {
        let attributes = LayerAttributes::named(pass);
        let channels = AnyChannels::sort(channels.into());
        Layer::new((19, 35), attributes, Encoding::default(), channels)
    };
    let parts: Vec<_> = blender_passes(&frame).into_iter().map(part).collect();
    let windows = ImageAttributes::with_size((19, 35));
    Image::from_layers(windows, parts).write().to_file(&path).unwrap();
    assert_eq!(sequence.load(0).unwrap(), frame);
}

#[test]
fn errors_name_file_field_and_channel() {
    let folder = Folder::new("errors");
    let dir = &folder.0;
    let message = || match open(dir) {
        Err(error) => error.to_string(),
        Ok(sequence) => sequence.load(0).unwrap_err().to_string(),
    };
    let camera = dir.join("camera.json");
    assert_eq!(message(), format!("{}: no such file", camera.display()));

    write_sequence(dir, "errors", 1.0, [frame(0)]).unwrap();
    let json = fs::read_to_string(&camera).unwrap();
    let good: serde_json::Value = serde_json::from_str(&json).unwrap();
    let with = |change: &dyn Fn(&mut serde_json::Value)| {
        let mut json = good.clone();
        change(&mut json);
        fs::write(&camera, json.to_string()).unwrap();
        message()
    };
    let explained = |field: &str, rest: &str| format!("{}: field `{field}`: {rest}", camera.display());
    assert_eq!(
        with(&|json| drop(json["frames"][0].as_object_mut().unwrap().remove("view"))),
        explained("frames[0].view", "expected a list of 4 rows, found nothing")
    );
    assert_eq!(
        with(&|json| json["frames"][0]["proj"][2][1] = "x".into()),
        explained("frames[0].proj[2][1]", "expected a finite number, found \"x\"")
    );
    let flat = serde_json::json!([[1, 2, 3, 4], [2, 4, 6, 8], [0, 0, 1, 0], [0, 0, 0, 1]]);
    assert_eq!(
        with(&|json| json["frames"][0]["view"] = flat.clone()),
        explained(
            "frames[0].view",
            "expected a matrix that can be inverted, found [[1,2,3,4],[2,4,6,8],[0,0,1,0],[0,0,0,1]]"
        )
    );
    let image = dir.join("frame_0000.exr");
    assert_eq!(
        with(&|json| json["width"] = 20.into()),
        format!("{}: expected 20x35 pixels, found 19x35", image.display())
    );
    fs::write(&camera, "{").unwrap();
    assert!(message().starts_with(&format!("{}: not valid JSON: ", camera.display())));

    fs::write(&camera, &json).unwrap();
    let names = ChannelNames::parse(["reference=truth"]).unwrap();
    let error = Sequence::open(dir, &names).unwrap().load(0).unwrap_err();
    assert_eq!(
        error.to_string(),
        format!(
            "{}: no channel `truth.R` for reference; the file has Z, hit_motion.X, hit_motion.Y, hit_motion.Z, motion.X, motion.Y, normal.X, \
             normal.Y, normal.Z, reflection.A, reflection.B, reflection.G, reflection.R, roughness; \
             name another one with reference=NAME",
            image.display()
        )
    );
    fs::write(&image, b"\x89PNG\r\n").unwrap();
    assert_eq!(
        message(),
        format!("{}: not an EXR file: expected the first bytes 76 2f 31 01, found 89 50 4e 47", image.display())
    );
    fs::remove_file(&image).unwrap();
    assert_eq!(message(), format!("{}: no such file", image.display()));
}

#[test]
fn values_that_are_not_finite_are_counted() {
    let mut frame = frame(1);
    frame.radiance[3] = [f32::NAN, f32::INFINITY, 0.0, f32::NAN];
    frame.depth[0] = f32::NEG_INFINITY;
    frame.reference.as_mut().unwrap()[5][2] = f32::NAN;
    assert_eq!(
        frame.warnings().to_string(),
        "values that are NaN or infinite: radiance 2, hit_distance 1, depth 1, reference 1"
    );
}
