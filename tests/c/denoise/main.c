/*
 * Denoises a sequence with nothing of limpid but an export: shaders, manifest.json and limpid.h.
 *
 *     limpid export --target spirv --out EXPORT
 *     cc -std=c11 -I EXPORT *.c -lvulkan -lm -o denoise
 *     ./denoise EXPORT SEQUENCE OUT [DEVICE]
 *
 * SEQUENCE holds sequence.json (cameras, sizes and formats) and the texels of each image as FRAME.NAME.raw. The result
 * goes to OUT/FRAME.raw: four half floats a pixel.
 *
 * denoiser.c is what an engine needs. The other files are small stand-ins for what an engine has already.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "denoiser.h"
#include "json.h"
#include "limpid.h"
#include "names.h"

enum { MAX_INPUTS = 16, OUTPUT_TEXEL_BYTES = 8 };

/* An image of the sequence, and the memory through which it goes to the GPU. */
typedef struct Texture {
    const char *name;
    Image image;
    Buffer staging;
} Texture;

typedef struct Sequence {
    const char *folder;
    const Json *frames;
    uint32_t width, height; /* of the largest frame */
    Texture textures[MAX_INPUTS];
    uint32_t texture_count;
} Sequence;

static Sequence sequence_open(const Gpu *gpu, const char *folder) {
    const Json *json = json_read(folder, "sequence.json");
    Sequence sequence = {.folder = folder,
                         .frames = json_get(json, "frames"),
                         .width = json_uint(json, "width"),
                         .height = json_uint(json, "height")};
    for (const Json *entry = json_get(json, "inputs")->first; entry != NULL; entry = entry->next) {
        if (sequence.texture_count == MAX_INPUTS) {
            die("sequence.json has more than %d inputs", MAX_INPUTS);
        }
        const uint32_t width = json_uint(entry, "width"), height = json_uint(entry, "height");
        const VkFormat format = (VkFormat)vulkan_value(json_string(entry, "format"));
        const VkDeviceSize bytes = (VkDeviceSize)width * height * json_uint(entry, "texel_bytes");
        Texture *texture = &sequence.textures[sequence.texture_count++];
        texture->name = json_string(entry, "name");
        texture->image =
            image_new(gpu, format, width, height, VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT);
        texture->staging = buffer_new(gpu, bytes, VK_BUFFER_USAGE_TRANSFER_SRC_BIT, 1);
    }
    return sequence;
}

static void sequence_close(const Gpu *gpu, Sequence *sequence) {
    for (uint32_t i = 0; i < sequence->texture_count; i++) {
        image_free(gpu, &sequence->textures[i].image);
        buffer_free(gpu, &sequence->textures[i].staging);
    }
}

/* Copies the images of a frame to the GPU. A frame smaller than an image fills its upper left part. */
static void upload_frame(const Sequence *sequence, VkCommandBuffer commands, uint32_t number, const uint32_t size[2]) {
    for (uint32_t i = 0; i < sequence->texture_count; i++) {
        const Texture *texture = &sequence->textures[i];
        const VkExtent3D whole = texture->image.size;
        const int is_full = whole.width == sequence->width && whole.height == sequence->height;
        char name[256];
        size_t bytes;
        snprintf(name, sizeof name, "%u.%s.raw", number, texture->name);
        char *const texels = read_file(sequence->folder, name, &bytes);
        if (bytes > texture->staging.size) {
            die("%s has %zu bytes, expected at most %zu", name, bytes, (size_t)texture->staging.size);
        }
        memcpy(texture->staging.mapped, texels, bytes);
        upload(commands, &texture->staging, &texture->image, is_full ? size[0] : whole.width,
               is_full ? size[1] : whole.height);
        free(texels);
    }
}

static LimpidInputs read_inputs(const Json *frame) {
    LimpidInputs inputs;
    json_floats(frame, "world_to_view", inputs.camera.world_to_view, 16);
    json_floats(frame, "view_to_clip", inputs.camera.view_to_clip, 16);
    json_floats(frame, "jitter", inputs.camera.jitter, 2);
    inputs.exposure = (float)json_number(frame, "exposure");
    inputs.frame_seconds = (float)json_number(frame, "frame_seconds");
    inputs.size[0] = json_uint(frame, "width");
    inputs.size[1] = json_uint(frame, "height");
    inputs.reset = json_true(frame, "reset");
    return inputs;
}

static void write_output(const char *folder, uint32_t number, const Buffer *readback, size_t bytes) {
    char path[4096];
    snprintf(path, sizeof path, "%s/%u.raw", folder, number);
    FILE *file = fopen(path, "wb");
    if (file == NULL || fwrite(readback->mapped, 1, bytes, file) != bytes || fclose(file) != 0) {
        die("cannot write %s", path);
    }
}

static void denoise_frame(const Gpu *gpu, const Denoiser *denoiser, const Sequence *sequence, const Buffer *readback,
                          uint32_t number, const uint32_t size[2]) {
    const Image *output = denoiser_output(denoiser, number);
    VkCommandBuffer commands = commands_begin(gpu);
    if (number == 0) {
        denoiser_clear(denoiser, commands);
    }
    upload_frame(sequence, commands, number, size);
    denoiser_record(denoiser, commands, "classify", number, size[0], size[1]);
    /* A renderer traces its rays here. This sequence was traced before. */
    denoiser_record(denoiser, commands, "denoise", number, size[0], size[1]);
    barrier(commands, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_ACCESS_SHADER_WRITE_BIT, VK_PIPELINE_STAGE_TRANSFER_BIT,
            VK_ACCESS_TRANSFER_READ_BIT);
    download(commands, output, readback, output->size.width, output->size.height);
    commands_run(gpu, commands);
}

int main(int count, char **arguments) {
    if (count < 4) {
        die("usage: %s EXPORT SEQUENCE OUT [DEVICE]", arguments[0]);
    }
    if (!json_is(json_read(arguments[1], "manifest.json"), "settings_hash", LIMPID_SETTINGS_HASH)) {
        die("this program was compiled with the limpid.h of an export with other settings");
    }
    Gpu gpu = gpu_open(count > 4 ? arguments[4] : "");
    Sequence sequence = sequence_open(&gpu, arguments[2]);
    Input inputs[MAX_INPUTS];
    for (uint32_t i = 0; i < sequence.texture_count; i++) {
        const Input input = {sequence.textures[i].name, &sequence.textures[i].image};
        inputs[i] = input;
    }
    Denoiser *denoiser =
        denoiser_new(&gpu, arguments[1], sequence.width, sequence.height, inputs, sequence.texture_count);
    const size_t bytes = (size_t)sequence.width * sequence.height * OUTPUT_TEXEL_BYTES;
    Buffer readback = buffer_new(&gpu, bytes, VK_BUFFER_USAGE_TRANSFER_DST_BIT, 1);

    const LimpidSettings settings = limpid_settings();
    LimpidPrevious previous;
    uint32_t number = 0;
    for (const Json *entry = sequence.frames->first; entry != NULL; entry = entry->next, number++) {
        const LimpidInputs frame = read_inputs(entry);
        const char *problem =
            limpid_fill_constants(&settings, &frame, number > 0 ? &previous : NULL, denoiser_constants(denoiser));
        if (problem != NULL) {
            die("frame %u: %s", number, problem);
        }
        denoise_frame(&gpu, denoiser, &sequence, &readback, number, frame.size);
        write_output(arguments[3], number, &readback, bytes);
        previous.camera = frame.camera;
        memcpy(previous.size, frame.size, sizeof previous.size);
    }

    buffer_free(&gpu, &readback);
    denoiser_free(denoiser);
    sequence_close(&gpu, &sequence);
    gpu_close(&gpu);
    return 0;
}
