/*
 * A denoiser made of nothing but a folder that `limpid export --target spirv` wrote: manifest.json says what to
 * allocate, bind and dispatch, whatever the settings were.
 */
#ifndef DENOISER_H
#define DENOISER_H

#include "gpu.h"

typedef struct Denoiser Denoiser;

/* An image of yours, in VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL while the denoiser runs. */
typedef struct Input {
    const char *name; /* in the manifest: `radiance`, `normal`... */
    const Image *image;
} Input;

/* For images of up to `width` x `height` pixels. */
Denoiser *denoiser_new(const Gpu *gpu, const char *export_folder, uint32_t width, uint32_t height, const Input *inputs,
                       uint32_t input_count);
void denoiser_free(Denoiser *denoiser);

/* Sets what it owns to zero. Record it once, before the first frame. */
void denoiser_clear(const Denoiser *denoiser, VkCommandBuffer commands);

/*
 * Records the passes of a stage: "classify", before you trace rays, or "denoise", after it. `number` counts frames
 * from 0, `width` and `height` are those of this frame. The GPU has finished the frame before.
 */
void denoiser_record(const Denoiser *denoiser, VkCommandBuffer commands, const char *stage, uint32_t number,
                     uint32_t width, uint32_t height);

/* The constant buffer, to be filled before a frame is submitted. */
void *denoiser_constants(const Denoiser *denoiser);

/* The denoised image of frame `number`, in VK_IMAGE_LAYOUT_GENERAL, as the last compute shader wrote it. */
const Image *denoiser_output(const Denoiser *denoiser, uint32_t number);

#endif
