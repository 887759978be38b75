// The constants of one frame, the same buffer for every kernel. Mirrored by `limpid::FrameConstants`;
// a test compares names, offsets and size. Spaces and signs: see "Conventions" in the crate docs.

struct Frame {
    // Position relative to the camera, in world axes, of (x w, y w, depth, 1): x, y in pixels with centres
    // at .5, w = clip_w.x + clip_w.y depth.
    world_from_pixel: mat4x4<f32>,
    // Homogeneous uv of last frame (x / w, y / w) of such a camera-relative position.
    prev_uv_from_world: mat4x4<f32>,
    // Position relative to this frame's camera of (x w, y w, depth, 1) in last frame's pixels and depth, with
    // w = prev_clip_w.x + prev_clip_w.y depth.
    world_from_prev_pixel: mat4x4<f32>,
    // Columns that rotate a world direction into the axes of the environment map.
    environment_from_world: mat4x4<f32>,
    // linear depth = |(x + y d) / (z + w d)| of the depth d that the caller supplies.
    depth_from_device: vec4<f32>,
    // The same for last frame's.
    prev_depth_from_device: vec4<f32>,
    // Weights of the Gaussian neighbourhood at 1, 2, 3 and 4 pixels; the centre has 1.
    neighborhood_weights: vec4<f32>,
    // World-space direction the camera looks in; w is unused.
    forward: vec4<f32>,
    clip_w: vec2<f32>,
    prev_clip_w: vec2<f32>,
    // Sky where the supplied depth is at or below x, or at or above y.
    sky_depth: vec2<f32>,
    motion_scale: vec2<f32>,
    motion_offset: vec2<f32>,
    jitter_uv: vec2<f32>,
    size: vec2<u32>,
    // 0 when there is no usable history (first frame, camera cut).
    prev_size: vec2<u32>,
    exposure: f32,
    inverse_exposure: f32,
    // Pixels that a unit of length covers, at a depth of one unit where the camera has a perspective.
    pixels_per_unit: f32,

    // Settings: see `limpid::Settings` for meaning, unit and range.
    roughness_threshold: f32,
    mirror_roughness: f32,
    ray_variance_threshold: f32,
    environment_mip_scale: f32,
    parallax_normal_cosine: f32,
    parallax_normal_margin: f32,
    parallax_roughness_margin: f32,
    surface_color_gate: f32,
    disocclusion_normal_falloff: f32,
    disocclusion_depth_falloff: f32,
    disocclusion_threshold: f32,
    disocclusion_tap_fraction: f32,
    max_history: f32,
    min_history_cap: f32,
    history_roughness_falloff: f32,
    variance_luminance_floor: f32,
    average_history_blend: f32,
    average_luminance_falloff: f32,
    average_weight_floor: f32,
    prefilter_radiance_falloff: f32,
    prefilter_radiance_variance_falloff: f32,
    prefilter_radiance_weight_floor: f32,
    prefilter_normal_power: f32,
    prefilter_depth_falloff: f32,
    prefilter_variance_falloff: f32,
    prefilter_variance_weight_floor: f32,
    stability: f32,
    clip_scale: f32,
    clip_average_pull: f32,
    clip_extent_floor: f32,
    // Longest histories, in frames.
    accumulate_max_history: f32,
    accumulate_mirror_history: f32,
    accumulate_clip_roughness: f32,
    accumulate_clip_scale: f32,
    outlier_factor: f32,
    excess_limit: f32,
    disagreement_limit: f32,
    light_change_sigma: f32,
    light_change_share: f32,
    // Share of each frame in the brightness that it is compared with next.
    light_change_rate: f32,
    filter_scale: f32,
    excess_scale: f32,
    grazing_width: f32,
    // Steps per frame in which a history length is stored, a whole number.
    history_length_steps: f32,
    // Roughness of all surfaces, where it is the same for all.
    constant_roughness: f32,
}

@group(0) @binding(0) var<uniform> frame: Frame;

// Centre of a pixel in uv, origin top left.
fn pixel_uv(pixel: vec2<u32>) -> vec2<f32> {
    return (vec2<f32>(pixel) + 0.5) / vec2<f32>(frame.size);
}

// Camera-relative position at linear `depth` of a place on screen, in pixels.
fn position_at(place: vec2<f32>, depth: f32) -> vec3<f32> {
    let w = frame.clip_w.x + frame.clip_w.y * depth;
    return (frame.world_from_pixel * vec4<f32>(place * w, depth, 1.0)).xyz;
}

// Camera-relative position of the surface that `pixel` shows at linear `depth`.
fn world_position(pixel: vec2<u32>, depth: f32) -> vec3<f32> {
    return position_at(vec2<f32>(pixel) + 0.5, depth);
}

// Unit direction from the camera to a camera-relative position; all parallel for an orthographic camera.
fn view_direction(position: vec3<f32>) -> vec3<f32> {
    // Scaled first: the square of a length very near or far is no number that can be divided by.
    let magnitude = max(max(abs(position.x), abs(position.y)), abs(position.z));
    return select(normalize(position / magnitude), frame.forward.xyz, frame.clip_w.y == 0.0);
}
