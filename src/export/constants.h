/* ---- Constants of a frame -------------------------------------------------------------------------------------- */

/* A camera. Matrices are for column vectors, column by column: element (row, column) is [4 * column + row]. */
typedef struct LimpidCamera {
    float world_to_view[16]; /* a rigid motion, either handedness */
    float view_to_clip[16];  /* without jitter; depth 0 to 1, standard or reversed, finite or infinite, no skew */
    float jitter[2];         /* where in the pixel the camera sampled, in pixels from its centre, x right, y down */
} LimpidCamera;

/* What changes from frame to frame. */
typedef struct LimpidInputs {
    LimpidCamera camera;
    uint32_t size[2];    /* pixels of this frame, at most those allocated */
    float exposure;      /* factor that brings radiance near 1, above 0 */
    float frame_seconds; /* time since the frame before, above 0 */
    int reset;           /* not 0: history is of no use (camera cut) */
} LimpidInputs;

/*
 * The frame that was denoised last. Without the feature gbuffer_copy, set `reset` in the frame after a change of `depth`,
 * `sky_distance`, `roughness_threshold` or `constant_roughness`: what was denoised is read from last frame's images.
 */
typedef struct LimpidPrevious {
    LimpidCamera camera;
    uint32_t size[2];
} LimpidPrevious;

static inline double limpid_at(const float *m, int row, int column) {
    return (double)m[4 * column + row];
}

/* out = a * b */
static inline void limpid_multiply(const double *a, const double *b, double *out) {
    for (int column = 0; column < 4; column++) {
        for (int row = 0; row < 4; row++) {
            double sum = 0.0;
            for (int i = 0; i < 4; i++) {
                sum += a[4 * i + row] * b[4 * column + i];
            }
            out[4 * column + row] = sum;
        }
    }
}

/* The inverse of an affine matrix. */
static inline void limpid_inverse(const float *m, double *out) {
    double a[3][3], c[3][3];
    for (int row = 0; row < 3; row++) {
        for (int column = 0; column < 3; column++) {
            a[row][column] = limpid_at(m, row, column);
        }
    }
    for (int row = 0; row < 3; row++) {
        for (int column = 0; column < 3; column++) {
            const int r1 = (row + 1) % 3, r2 = (row + 2) % 3, c1 = (column + 1) % 3, c2 = (column + 2) % 3;
            c[row][column] = a[r1][c1] * a[r2][c2] - a[r1][c2] * a[r2][c1];
        }
    }
    const double determinant = a[0][0] * c[0][0] + a[0][1] * c[0][1] + a[0][2] * c[0][2];
    for (int column = 0; column < 3; column++) {
        for (int row = 0; row < 3; row++) {
            out[4 * column + row] = c[column][row] / determinant;
        }
        out[4 * column + 3] = 0.0;
    }
    for (int row = 0; row < 3; row++) {
        out[12 + row] = 0.0;
        for (int i = 0; i < 3; i++) {
            out[12 + row] -= out[4 * i + row] * limpid_at(m, i, 3);
        }
    }
    out[15] = 1.0;
}

/* NULL if a camera can be used, otherwise what is wrong with it. */
static inline const char *limpid_check_camera(const LimpidCamera *camera) {
    const float *view = camera->world_to_view, *clip = camera->view_to_clip;
    for (int i = 0; i < 16; i++) {
        if (!isfinite(view[i])) {
            return "camera.world_to_view has entries that are not finite";
        }
        if (!isfinite(clip[i])) {
            return "camera.view_to_clip has entries that are not finite";
        }
    }
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            double dot = 0.0;
            for (int k = 0; k < 3; k++) {
                dot += limpid_at(view, i, k) * limpid_at(view, j, k);
            }
            if (fabs(dot - (i == j ? 1.0 : 0.0)) > 1e-3) {
                return "camera.world_to_view is not a rigid motion";
            }
        }
    }
    if (limpid_at(view, 3, 0) != 0.0 || limpid_at(view, 3, 1) != 0.0 || limpid_at(view, 3, 2) != 0.0
        || limpid_at(view, 3, 3) != 1.0) {
        return "camera.world_to_view is not a rigid motion";
    }
    if (limpid_at(clip, 0, 1) != 0.0 || limpid_at(clip, 1, 0) != 0.0 || limpid_at(clip, 2, 0) != 0.0
        || limpid_at(clip, 2, 1) != 0.0 || limpid_at(clip, 3, 0) != 0.0 || limpid_at(clip, 3, 1) != 0.0) {
        return "camera.view_to_clip is skewed or has an oblique near plane";
    }
    if (limpid_at(clip, 0, 0) * limpid_at(clip, 1, 1) == 0.0
        || limpid_at(clip, 2, 2) * limpid_at(clip, 3, 3) == limpid_at(clip, 2, 3) * limpid_at(clip, 3, 2)) {
        return "camera.view_to_clip is singular";
    }
    if (!isfinite(camera->jitter[0]) || !isfinite(camera->jitter[1])) {
        return "camera.jitter is not finite";
    }
    return NULL;
}

static inline void limpid_store(const double *matrix, float *out) {
    for (int i = 0; i < 16; i++) {
        out[i] = (float)matrix[i];
    }
}

/*
 * (x w, y w, depth, 1), x and y in pixels, to view space, with w = clip_w[0] + clip_w[1] * depth. Returns the sign of
 * view-space z in front of the camera.
 */
static inline double limpid_pixel_to_view(const LimpidSettings *settings, const LimpidCamera *camera,
                                          const uint32_t *size, double *view_from_pixel, float *clip_w) {
    const float *p = camera->view_to_clip;
    const double ndc_y = settings->ndc_y == LIMPID_NDC_Y_UP ? 1.0 : -1.0;
    const double w_per_z = limpid_at(p, 3, 2), z_per_z = limpid_at(p, 2, 2);
    const double reversed = settings->depth == LIMPID_DEPTH_REVERSED_DEVICE ? -1.0 : 1.0;
    const double sign =
        w_per_z != 0.0 ? (w_per_z < 0.0 ? -1.0 : 1.0) : (signbit(z_per_z) ? -1.0 : 1.0) * reversed;
    const double w[2] = {limpid_at(p, 3, 3), w_per_z * sign};
    const double scale[2] = {2.0 / (double)size[0], -2.0 * ndc_y / (double)size[1]};
    const double start[2] = {-1.0, ndc_y};
    memset(view_from_pixel, 0, 16 * sizeof *view_from_pixel);
    for (int i = 0; i < 2; i++) {
        const double offset = scale[i] * (double)camera->jitter[i] + start[i];
        const double diagonal = limpid_at(p, i, i);
        view_from_pixel[5 * i] = scale[i] / diagonal;
        view_from_pixel[8 + i] = (offset * w[1] - limpid_at(p, i, 2) * sign) / diagonal;
        view_from_pixel[12 + i] = (offset * w[0] - limpid_at(p, i, 3)) / diagonal;
        clip_w[i] = (float)w[i];
    }
    view_from_pixel[10] = sign;
    view_from_pixel[15] = 1.0;
    return sign;
}

/* Linear depth = |(out[0] + out[1] d) / (out[2] + out[3] d)| of the depth d that you supply. */
static inline void limpid_fill_depth(const LimpidSettings *settings, const LimpidCamera *camera, float *out) {
    const float *p = camera->view_to_clip;
    const int is_linear = settings->depth == LIMPID_DEPTH_LINEAR;
    out[0] = is_linear ? 0.0f : (float)limpid_at(p, 2, 3);
    out[1] = is_linear ? 1.0f : (float)-limpid_at(p, 3, 3);
    out[2] = is_linear ? 1.0f : (float)-limpid_at(p, 2, 2);
    out[3] = is_linear ? 0.0f : (float)limpid_at(p, 3, 2);
}

/* Pixels and depth of this frame to positions relative to the camera. */
static inline void limpid_fill_position(
    const LimpidSettings *settings, const LimpidInputs *inputs, const double *view_to_world, LimpidFrame *frame) {
    const float *p = inputs->camera.view_to_clip;
    double view_from_pixel[16], rotation[16], world_from_pixel[16];
    const double sign =
        limpid_pixel_to_view(settings, &inputs->camera, inputs->size, view_from_pixel, frame->clip_w);
    for (int i = 0; i < 16; i++) {
        rotation[i] = i < 12 ? view_to_world[i] : (i == 15 ? 1.0 : 0.0);
    }
    limpid_multiply(rotation, view_from_pixel, world_from_pixel);
    limpid_store(world_from_pixel, frame->world_from_pixel);

    const double *z = rotation + 8;
    const double length = sqrt(z[0] * z[0] + z[1] * z[1] + z[2] * z[2]);
    for (int i = 0; i < 3; i++) {
        frame->forward[i] = (float)(sign * z[i] / length);
    }
    frame->forward[3] = 0.0f;
    frame->pixels_per_unit = (float)((double)inputs->size[1] * fabs(limpid_at(p, 1, 1)) / 2.0);

    limpid_fill_depth(settings, &inputs->camera, frame->depth_from_device);
    if (settings->depth == LIMPID_DEPTH_LINEAR) {
        frame->sky_depth[0] = 0.0f;
        frame->sky_depth[1] = settings->sky_distance;
    } else {
        const int is_reversed = settings->depth == LIMPID_DEPTH_REVERSED_DEVICE;
        frame->sky_depth[0] = is_reversed ? 0.0f : -FLT_MAX;
        frame->sky_depth[1] = is_reversed ? FLT_MAX : 1.0f;
    }
}

/* Positions to last frame's uv, and last frame's pixels and depth to positions, all relative to this frame's camera. */
static inline void limpid_fill_reprojection(const LimpidSettings *settings, const LimpidCamera *previous,
                                            const uint32_t *prev_size, const double *view_to_world,
                                            LimpidFrame *frame) {
    const double ndc_y = settings->ndc_y == LIMPID_NDC_Y_UP ? 1.0 : -1.0;
    const double uv_from_ndc[16] = {0.5, 0, 0, 0, 0, -0.5 * ndc_y, 0, 0, 0, 0, 1, 0, 0.5, 0.5, 0, 1};
    double clip[16], view[16], product[16], from_world[16], from_relative[16];
    double eye[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    for (int i = 0; i < 16; i++) {
        clip[i] = (double)previous->view_to_clip[i];
        view[i] = (double)previous->world_to_view[i];
    }
    for (int i = 0; i < 3; i++) {
        eye[12 + i] = view_to_world[12 + i];
    }
    limpid_multiply(uv_from_ndc, clip, product);
    limpid_multiply(product, view, from_world);
    limpid_multiply(from_world, eye, from_relative);
    limpid_store(from_relative, frame->prev_uv_from_world);
    limpid_fill_depth(settings, previous, frame->prev_depth_from_device);

    double prev_view_to_world[16], view_from_pixel[16], world_from_pixel[16];
    limpid_inverse(previous->world_to_view, prev_view_to_world);
    for (int i = 0; i < 3; i++) {
        prev_view_to_world[12 + i] -= eye[12 + i];
    }
    limpid_pixel_to_view(settings, previous, prev_size, view_from_pixel, frame->prev_clip_w);
    limpid_multiply(prev_view_to_world, view_from_pixel, world_from_pixel);
    limpid_store(world_from_pixel, frame->world_from_prev_pixel);
}

/* Frames of a history that is so many seconds long. */
static inline float limpid_frames(float seconds, const LimpidInputs *inputs) {
    return fminf(fmaxf(seconds / inputs->frame_seconds, 1.0f), 31.0f);
}

/*
 * Fills the constant buffer. `previous` is the frame that was denoised last, NULL if there is none.
 * Returns NULL, or what is wrong with the inputs; `frame` is not to be used then.
 */
static inline const char *limpid_fill_constants(
    const LimpidSettings *settings, const LimpidInputs *inputs, const LimpidPrevious *previous, LimpidFrame *frame) {
    const char *problem = limpid_check_camera(&inputs->camera);
    if (problem == NULL && previous != NULL) {
        problem = limpid_check_camera(&previous->camera);
    }
    if (problem != NULL) {
        return problem;
    }
    if (inputs->size[0] == 0 || inputs->size[1] == 0 || inputs->size[0] > 16384 || inputs->size[1] > 16384) {
        return "size is not 1 to 16384 in each direction";
    }
    if (!(isnormal(inputs->exposure) && inputs->exposure > 0.0f)) {
        return "exposure is not a finite number above 0";
    }
    if (!(isnormal(inputs->frame_seconds) && inputs->frame_seconds > 0.0f)) {
        return "frame_seconds is not a finite number above 0";
    }
    const LimpidCamera *prev_camera = previous != NULL ? &previous->camera : &inputs->camera;
    const uint32_t *prev_size = previous != NULL ? previous->size : inputs->size;
    double view_to_world[16];
    limpid_inverse(inputs->camera.world_to_view, view_to_world);
    memset(frame, 0, sizeof *frame);
    limpid_fill_position(settings, inputs, view_to_world, frame);
    limpid_fill_reprojection(settings, prev_camera, prev_size, view_to_world, frame);
    for (int column = 0; column < 3; column++) {
        for (int row = 0; row < 3; row++) {
            frame->environment_from_world[4 * column + row] = settings->environment_from_world[3 * column + row];
        }
    }
    frame->environment_from_world[15] = 1.0f;
    for (int i = 0; i < 4; i++) {
        const float distance = (float)(i + 1);
        frame->neighborhood_weights[i] = expf(-settings->neighborhood_falloff * distance * distance / 25.0f);
    }
    for (int i = 0; i < 2; i++) {
        const double jitter = (double)inputs->camera.jitter[i] / (double)inputs->size[i];
        const double prev_jitter = (double)prev_camera->jitter[i] / (double)prev_size[i];
        frame->motion_scale[i] = settings->motion_scale[i];
        frame->motion_offset[i] = settings->motion_includes_jitter ? (float)(jitter - prev_jitter) : 0.0f;
        frame->jitter_uv[i] = (float)jitter;
        frame->size[i] = inputs->size[i];
        frame->prev_size[i] = previous != NULL && !inputs->reset ? prev_size[i] : 0;
    }
    frame->exposure = inputs->exposure;
    frame->inverse_exposure = 1.0f / inputs->exposure;
    limpid_copy_settings(settings, frame);
    frame->accumulate_max_history = limpid_frames(settings->max_history_seconds, inputs);
    frame->accumulate_mirror_history = limpid_frames(settings->mirror_history_seconds, inputs);
    frame->light_change_rate = 1.0f - expf(-inputs->frame_seconds / settings->light_change_seconds);
    frame->history_length_steps = floorf(255.0f / settings->max_history);
    return NULL;
}
