/* A Vulkan device, images and buffers: what an engine has already. One allocation each, for shortness. */
#ifndef GPU_H
#define GPU_H

#include <vulkan/vulkan.h>

typedef struct Gpu {
    VkInstance instance;
    VkPhysicalDevice physical;
    VkDevice device;
    VkQueue queue;
    VkCommandPool pool;
} Gpu;

typedef struct Image {
    VkImage image;
    VkImageView view;
    VkDeviceMemory memory;
    VkExtent3D size;
} Image;

typedef struct Buffer {
    VkBuffer buffer;
    VkDeviceMemory memory;
    VkDeviceSize size;
    void *mapped; /* of buffers that the CPU uses */
} Buffer;

/* Ends the program unless a call succeeded. */
void check(VkResult result, const char *what);

/* Opens the first device whose name contains `name`; the first of all if that is empty. */
Gpu gpu_open(const char *name);
void gpu_close(Gpu *gpu);

Image image_new(const Gpu *gpu, VkFormat format, uint32_t width, uint32_t height, VkImageUsageFlags usage);
void image_free(const Gpu *gpu, Image *image);

Buffer buffer_new(const Gpu *gpu, VkDeviceSize size, VkBufferUsageFlags usage, int is_mapped);
void buffer_free(const Gpu *gpu, Buffer *buffer);

/* Commands that run once: begin, record, then submit and wait. */
VkCommandBuffer commands_begin(const Gpu *gpu);
void commands_run(const Gpu *gpu, VkCommandBuffer commands);

/* A barrier on all memory. */
void barrier(VkCommandBuffer commands, VkPipelineStageFlags before, VkAccessFlags written, VkPipelineStageFlags after,
             VkAccessFlags used);

/* A barrier on an image that changes its layout. */
void change_layout(VkCommandBuffer commands, const Image *image, VkImageLayout from, VkImageLayout to,
                   VkPipelineStageFlags before, VkAccessFlags written, VkPipelineStageFlags after, VkAccessFlags used);

/* Copies between all of a buffer and the upper left `width` x `height` texels of an image. */
void upload(VkCommandBuffer commands, const Buffer *buffer, const Image *image, uint32_t width, uint32_t height);
void download(VkCommandBuffer commands, const Image *image, const Buffer *buffer, uint32_t width, uint32_t height);

#endif
