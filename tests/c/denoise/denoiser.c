#include "denoiser.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "expression.h"
#include "json.h"
#include "names.h"

enum { MAX_SETS = 8, MAX_BINDINGS = 32, PHASES = 2 };

/* A resource of the manifest: constants, a texture or buffer of ours, or an image of the caller. */
typedef struct Resource {
    const char *name;
    uint32_t copies; /* 2: in frame n the current copy is n % 2 */
    int is_texture;
    Image images[2];
    Buffer buffer;
    const Image *input;
} Resource;

typedef struct Pass {
    const Json *entry; /* of the manifest */
    VkDescriptorSetLayout set_layouts[MAX_SETS];
    VkPipelineLayout layout;
    VkPipeline pipeline;
    VkDescriptorSet sets[PHASES][MAX_SETS];
    const Resource *grid; /* buffer with the number of workgroups, or NULL */
} Pass;

struct Denoiser {
    const Gpu *gpu;
    const Json *output; /* of the manifest: resource and copy */
    Resource *resources;
    Pass *passes;
    uint32_t resource_count, pass_count;
    uint32_t set_count; /* the manifest's highest set number and one */
    VkDescriptorPool pool;
};

static Resource *find_resource(const Denoiser *denoiser, const char *name) {
    for (uint32_t i = 0; i < denoiser->resource_count; i++) {
        if (strcmp(denoiser->resources[i].name, name) == 0) {
            return &denoiser->resources[i];
        }
    }
    die("manifest.json: there is no resource `%s`", name);
}

/* ---- Resources ------------------------------------------------------------------------------------------------- */

static void make_resource(const Gpu *gpu, const Json *entry, uint32_t width, uint32_t height, Resource *resource) {
    resource->name = json_string(entry, "name");
    resource->copies = json_uint(entry, "copies");
    resource->is_texture = json_is(entry, "kind", "texture");
    if (resource->is_texture) {
        const VkFormat format = (VkFormat)vulkan_value(json_string(json_get(entry, "format"), "vulkan"));
        const uint32_t x = (uint32_t)evaluate(json_string(entry, "width"), width, height);
        const uint32_t y = (uint32_t)evaluate(json_string(entry, "height"), width, height);
        /* Transfers are for clearing and for reading the output back. */
        const VkImageUsageFlags usage = VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_STORAGE_BIT
                                        | VK_IMAGE_USAGE_TRANSFER_DST_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT;
        for (uint32_t copy = 0; copy < resource->copies; copy++) {
            resource->images[copy] = image_new(gpu, format, x, y, usage);
        }
    } else if (json_is(entry, "kind", "buffer")) {
        const VkDeviceSize bytes = evaluate(json_string(entry, "bytes"), width, height);
        VkBufferUsageFlags usage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT;
        if (json_true(entry, "is_indirect")) {
            usage |= VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT;
        }
        resource->buffer = buffer_new(gpu, bytes, usage, 0);
    }
}

static void make_resources(Denoiser *denoiser, const Json *manifest, uint32_t width, uint32_t height) {
    denoiser->output = json_get(manifest, "output");
    const Json *entries = json_get(manifest, "resources"), *entry = entries->first;
    denoiser->resource_count = entries->count;
    denoiser->resources = calloc(entries->count, sizeof(Resource));
    for (Resource *resource = denoiser->resources; entry != NULL; entry = entry->next, resource++) {
        make_resource(denoiser->gpu, entry, width, height, resource);
        if (json_is(entry, "kind", "constants")) {
            const uint32_t bytes = json_uint(json_get(manifest, "constants"), "size");
            resource->buffer = buffer_new(denoiser->gpu, bytes, VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT, 1);
        }
    }
}

/* ---- Passes ---------------------------------------------------------------------------------------------------- */

static void make_layouts(const Denoiser *denoiser, Pass *pass) {
    const VkDevice device = denoiser->gpu->device;
    for (uint32_t set = 0; set < denoiser->set_count; set++) {
        VkDescriptorSetLayoutBinding bindings[MAX_BINDINGS];
        uint32_t count = 0;
        for (const Json *entry = json_get(pass->entry, "bindings")->first; entry != NULL; entry = entry->next) {
            const Json *at = json_get(entry, "spirv");
            if (json_uint(at, "set") == set && count < MAX_BINDINGS) {
                const VkDescriptorSetLayoutBinding binding = {
                    .binding = json_uint(at, "binding"),
                    .descriptorType = (VkDescriptorType)vulkan_value(json_string(at, "type")),
                    .descriptorCount = 1,
                    .stageFlags = VK_SHADER_STAGE_COMPUTE_BIT};
                bindings[count++] = binding;
            }
        }
        const VkDescriptorSetLayoutCreateInfo info = {.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO,
                                                      .bindingCount = count,
                                                      .pBindings = bindings};
        check(vkCreateDescriptorSetLayout(device, &info, NULL, &pass->set_layouts[set]), "vkCreateDescriptorSetLayout");
    }
    const VkPipelineLayoutCreateInfo info = {.sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO,
                                             .setLayoutCount = denoiser->set_count,
                                             .pSetLayouts = pass->set_layouts};
    check(vkCreatePipelineLayout(device, &info, NULL, &pass->layout), "vkCreatePipelineLayout");
}

static void make_pipeline(const Gpu *gpu, const char *folder, Pass *pass) {
    const Json *shader = json_get(json_get(pass->entry, "shaders"), "spirv");
    size_t size;
    char *const code = read_file(folder, json_string(shader, "file"), &size);
    const VkShaderModuleCreateInfo module_info = {.sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO,
                                                  .codeSize = size,
                                                  .pCode = (const uint32_t *)(const void *)code};
    VkShaderModule module;
    check(vkCreateShaderModule(gpu->device, &module_info, NULL, &module), "vkCreateShaderModule");
    const VkComputePipelineCreateInfo info = {
        .sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO,
        .stage = {.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO,
                  .stage = VK_SHADER_STAGE_COMPUTE_BIT,
                  .module = module,
                  .pName = json_string(shader, "entry_point")},
        .layout = pass->layout};
    check(vkCreateComputePipelines(gpu->device, VK_NULL_HANDLE, 1, &info, NULL, &pass->pipeline),
          "vkCreateComputePipelines");
    vkDestroyShaderModule(gpu->device, module, NULL);
    free(code);
}

/* The copy that an entry of the manifest names. */
static const Image *image_in_phase(const Resource *resource, const Json *entry, uint32_t phase) {
    const int is_previous = json_is(entry, "copy", "previous");
    return &resource->images[resource->copies == 2 ? (is_previous ? 1 - phase : phase) : 0];
}

static void write_descriptor(const Denoiser *denoiser, VkDescriptorSet set, const Json *binding, uint32_t phase) {
    const Resource *resource = find_resource(denoiser, json_string(binding, "resource"));
    const VkDescriptorBufferInfo buffer = {.buffer = resource->buffer.buffer, .range = VK_WHOLE_SIZE};
    const VkDescriptorImageInfo image = {
        .imageView = resource->is_texture ? image_in_phase(resource, binding, phase)->view
                     : resource->input    ? resource->input->view
                                          : VK_NULL_HANDLE,
        .imageLayout = resource->is_texture ? VK_IMAGE_LAYOUT_GENERAL : VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL};
    const Json *at = json_get(binding, "spirv");
    const VkWriteDescriptorSet write = {.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET,
                                        .dstSet = set,
                                        .dstBinding = json_uint(at, "binding"),
                                        .descriptorCount = 1,
                                        .descriptorType = (VkDescriptorType)vulkan_value(json_string(at, "type")),
                                        .pImageInfo = &image,
                                        .pBufferInfo = &buffer};
    vkUpdateDescriptorSets(denoiser->gpu->device, 1, &write, 0, NULL);
}

/* Sets for even and for odd frames, so that nothing has to be written later. */
static void make_sets(const Denoiser *denoiser, Pass *pass) {
    for (uint32_t phase = 0; phase < PHASES; phase++) {
        const VkDescriptorSetAllocateInfo info = {.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO,
                                                  .descriptorPool = denoiser->pool,
                                                  .descriptorSetCount = denoiser->set_count,
                                                  .pSetLayouts = pass->set_layouts};
        check(vkAllocateDescriptorSets(denoiser->gpu->device, &info, pass->sets[phase]), "vkAllocateDescriptorSets");
        for (const Json *entry = json_get(pass->entry, "bindings")->first; entry != NULL; entry = entry->next) {
            write_descriptor(denoiser, pass->sets[phase][json_uint(json_get(entry, "spirv"), "set")], entry, phase);
        }
    }
}

static void make_pool(Denoiser *denoiser, uint32_t binding_count) {
    const VkDescriptorType types[] = {VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, VK_DESCRIPTOR_TYPE_SAMPLED_IMAGE,
                                      VK_DESCRIPTOR_TYPE_STORAGE_IMAGE, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER};
    VkDescriptorPoolSize sizes[4];
    for (uint32_t i = 0; i < 4; i++) {
        sizes[i].type = types[i];
        sizes[i].descriptorCount = PHASES * binding_count;
    }
    const VkDescriptorPoolCreateInfo info = {.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO,
                                             .maxSets = PHASES * denoiser->pass_count * denoiser->set_count,
                                             .poolSizeCount = 4,
                                             .pPoolSizes = sizes};
    check(vkCreateDescriptorPool(denoiser->gpu->device, &info, NULL, &denoiser->pool), "vkCreateDescriptorPool");
}

static void make_passes(Denoiser *denoiser, const Json *manifest, const char *folder) {
    const Json *entries = json_get(manifest, "passes");
    uint32_t binding_count = 0;
    denoiser->pass_count = entries->count;
    denoiser->passes = calloc(entries->count, sizeof(Pass));
    for (const Json *pass = entries->first; pass != NULL; pass = pass->next) {
        for (const Json *entry = json_get(pass, "bindings")->first; entry != NULL; entry = entry->next) {
            const uint32_t set = json_uint(json_get(entry, "spirv"), "set");
            denoiser->set_count = set >= denoiser->set_count ? set + 1 : denoiser->set_count;
            binding_count++;
        }
    }
    if (denoiser->set_count > MAX_SETS) {
        die("manifest.json: set %u, expected at most %d", denoiser->set_count - 1, MAX_SETS - 1);
    }
    make_pool(denoiser, binding_count);
    const Json *entry = entries->first;
    for (Pass *pass = denoiser->passes; entry != NULL; entry = entry->next, pass++) {
        const Json *grid = json_get(entry, "grid");
        pass->entry = entry;
        pass->grid = json_is(grid, "kind", "indirect") ? find_resource(denoiser, json_string(grid, "resource")) : NULL;
        make_layouts(denoiser, pass);
        make_pipeline(denoiser->gpu, folder, pass);
        make_sets(denoiser, pass);
    }
}

Denoiser *denoiser_new(const Gpu *gpu, const char *export_folder, uint32_t width, uint32_t height, const Input *inputs,
                       uint32_t input_count) {
    const Json *manifest = json_read(export_folder, "manifest.json");
    if (json_uint(manifest, "manifest_version") != 1) {
        die("manifest.json has version %u, expected 1", json_uint(manifest, "manifest_version"));
    }
    Denoiser *denoiser = calloc(1, sizeof *denoiser);
    denoiser->gpu = gpu;
    make_resources(denoiser, manifest, width, height);
    for (const Json *entry = json_get(manifest, "resources")->first; entry != NULL; entry = entry->next) {
        if (json_is(entry, "kind", "input")) {
            Resource *resource = find_resource(denoiser, json_string(entry, "name"));
            for (uint32_t i = 0; i < input_count; i++) {
                resource->input = strcmp(inputs[i].name, resource->name) == 0 ? inputs[i].image : resource->input;
            }
            if (resource->input == NULL) {
                die("the image `%s` is missing; these settings need it", resource->name);
            }
        }
    }
    make_passes(denoiser, manifest, export_folder);
    return denoiser;
}

void denoiser_free(Denoiser *denoiser) {
    const VkDevice device = denoiser->gpu->device;
    for (uint32_t i = 0; i < denoiser->pass_count; i++) {
        const Pass *pass = &denoiser->passes[i];
        vkDestroyPipeline(device, pass->pipeline, NULL);
        vkDestroyPipelineLayout(device, pass->layout, NULL);
        for (uint32_t set = 0; set < denoiser->set_count; set++) {
            vkDestroyDescriptorSetLayout(device, pass->set_layouts[set], NULL);
        }
    }
    vkDestroyDescriptorPool(device, denoiser->pool, NULL);
    for (uint32_t i = 0; i < denoiser->resource_count; i++) {
        Resource *resource = &denoiser->resources[i];
        buffer_free(denoiser->gpu, &resource->buffer);
        image_free(denoiser->gpu, &resource->images[0]);
        image_free(denoiser->gpu, &resource->images[1]);
    }
    free(denoiser->passes);
    free(denoiser->resources);
    free(denoiser);
}

/* ---- A frame --------------------------------------------------------------------------------------------------- */

void denoiser_clear(const Denoiser *denoiser, VkCommandBuffer commands) {
    const VkClearColorValue zero = {{0}};
    const VkImageSubresourceRange whole = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
    for (const Resource *resource = denoiser->resources; resource < denoiser->resources + denoiser->resource_count;
         resource++) {
        for (uint32_t copy = 0; resource->is_texture && copy < resource->copies; copy++) {
            const Image *image = &resource->images[copy];
            change_layout(commands, image, VK_IMAGE_LAYOUT_UNDEFINED, VK_IMAGE_LAYOUT_GENERAL,
                          VK_PIPELINE_STAGE_TOP_OF_PIPE_BIT, 0, VK_PIPELINE_STAGE_TRANSFER_BIT,
                          VK_ACCESS_TRANSFER_WRITE_BIT);
            vkCmdClearColorImage(commands, image->image, VK_IMAGE_LAYOUT_GENERAL, &zero, 1, &whole);
        }
        if (resource->buffer.buffer != VK_NULL_HANDLE && resource->buffer.mapped == NULL) {
            vkCmdFillBuffer(commands, resource->buffer.buffer, 0, VK_WHOLE_SIZE, 0);
        }
    }
    barrier(commands, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_ACCESS_TRANSFER_WRITE_BIT,
            VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT);
}

/* One side of a barrier of the manifest. */
static VkPipelineStageFlags scope(const Json *side, VkAccessFlags *accesses) {
    VkPipelineStageFlags stages = 0;
    *accesses = 0;
    if (json_true(side, "kernel_reads")) {
        stages |= VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT;
        *accesses |= VK_ACCESS_SHADER_READ_BIT;
    }
    if (json_true(side, "kernel_writes")) {
        stages |= VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT;
        *accesses |= VK_ACCESS_SHADER_WRITE_BIT;
    }
    if (json_true(side, "indirect")) {
        stages |= VK_PIPELINE_STAGE_DRAW_INDIRECT_BIT;
        *accesses |= VK_ACCESS_INDIRECT_COMMAND_READ_BIT;
    }
    return stages;
}

static void record_barrier(VkCommandBuffer commands, const Json *entry) {
    if (entry->kind != JSON_NULL) {
        VkAccessFlags before_accesses, after_accesses;
        const VkPipelineStageFlags before = scope(json_get(entry, "before"), &before_accesses);
        const VkPipelineStageFlags after = scope(json_get(entry, "after"), &after_accesses);
        barrier(commands, before, before_accesses & VK_ACCESS_SHADER_WRITE_BIT, after, after_accesses);
    }
}

void denoiser_record(const Denoiser *denoiser, VkCommandBuffer commands, const char *stage, uint32_t number,
                     uint32_t width, uint32_t height) {
    for (const Pass *pass = denoiser->passes; pass < denoiser->passes + denoiser->pass_count; pass++) {
        if (!json_is(pass->entry, "stage", stage)) {
            continue;
        }
        record_barrier(commands, json_get(pass->entry, "barrier"));
        vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pass->pipeline);
        vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pass->layout, 0, denoiser->set_count,
                                pass->sets[number % PHASES], 0, NULL);
        const Json *grid = json_get(pass->entry, "grid");
        if (pass->grid != NULL) {
            vkCmdDispatchIndirect(commands, pass->grid->buffer.buffer, json_uint(grid, "offset"));
        } else {
            vkCmdDispatch(commands, (uint32_t)evaluate(json_string(grid, "x"), width, height),
                          (uint32_t)evaluate(json_string(grid, "y"), width, height),
                          (uint32_t)evaluate(json_string(grid, "z"), width, height));
        }
    }
}

void *denoiser_constants(const Denoiser *denoiser) {
    return find_resource(denoiser, "frame")->buffer.mapped;
}

const Image *denoiser_output(const Denoiser *denoiser, uint32_t number) {
    return image_in_phase(find_resource(denoiser, json_string(denoiser->output, "resource")), denoiser->output,
                          number % PHASES);
}
